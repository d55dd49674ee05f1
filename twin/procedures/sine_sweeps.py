"""Stepped sines, ladders, backbones, dwells and ring-downs: which steps they take, in which order."""

import math

from recordings.run import StepState
from recordings.streams import Excitation
from twin.procedures.grid import fixed_frequencies, step_frequencies
from twin.procedures.kinds import Dwell, RingDown, SteppedSine
from twin.procedures.limits import LIMITS
from twin.procedures.results import StepResult
from twin.procedures.session import Session, StepPlace
from twin.procedures.steps.amplitude import AmplitudeControl, FastHold, SlowHold
from twin.procedures.steps.phase import PhaseLock, resonance_phase
from twin.procedures.steps.sine_step import run_sine_step
from twin.procedures.steps.wait import SineStep
from twin.procedures.tables import ways

TIME_CONSTANT_CYCLES = 1 / (2 * math.pi * LIMITS.usual_damping_ratio)
"""Of a free decay, in cycles: what response and phase control assume."""

Sine = SteppedSine | Dwell | RingDown


def run_sine(procedure: Sine, session: Session, *, sample_rate_Hz: float) -> None:
    """Run all sweeps of a sine procedure."""
    runner = _Runner(procedure, session, sample_rate_Hz)
    if isinstance(procedure, SteppedSine) and procedure.control != "phase-resonance" and procedure.order == "frequency":
        runner.frequency_sweeps(procedure)
    else:
        runner.amplitude_sweeps()


class _Runner:
    def __init__(self, procedure: Sine, session: Session, sample_rate_Hz: float) -> None:
        self._procedure, self._session, self._sample_rate_Hz = procedure, session, sample_rate_Hz
        voltage = procedure.control == "voltage"
        self._measured_channel = "" if voltage else procedure.target_channel
        self._target_channel = "voltage" if voltage else procedure.target_channel
        self._unit = "V" if voltage else session.channels[procedure.target_channel].unit.replace("^2", "2")
        lowest = min(fixed_frequencies(procedure)) if isinstance(procedure, SteppedSine) else procedure.frequency
        self._control = self._amplitude_control(TIME_CONSTANT_CYCLES / lowest)
        self._ratios: list[tuple[float, float]] = []

    def frequency_sweeps(self, procedure: SteppedSine) -> None:
        """One sweep over the frequencies for each amplitude and direction."""
        for amplitude in procedure.amplitudes:
            for way in ways(procedure.direction):
                sweep = f"{amplitude:g}{self._unit}-{way}"
                results: list[StepResult] = []

                def responses(results: list[StepResult] = results) -> list[tuple[float, complex]]:
                    return [(result.frequency_Hz, self._response(result)) for result in results]

                frequencies = step_frequencies(procedure, upwards=way == "up", responses=responses)
                for index, frequency in enumerate(frequencies):
                    results.append(self._step(sweep, index, frequency, amplitude))
                self._session.end(StepState.DONE)

    def amplitude_sweeps(self) -> None:
        """One sweep over the amplitudes for each frequency and direction."""
        procedure = self._procedure
        frequencies = fixed_frequencies(procedure) if isinstance(procedure, SteppedSine) else [procedure.frequency]
        for frequency in frequencies:
            start = frequency
            for way in ways(procedure.direction):
                index = 0
                for amplitude in sorted(procedure.amplitudes, reverse=way == "down"):
                    result = self._step(self._name(frequency, way), index, start, amplitude)
                    if procedure.control == "phase-resonance":
                        start = result.frequency_Hz
                    index += 1
                    if isinstance(procedure, RingDown):
                        self._ring_down(procedure, self._name(frequency, way), index)
                        index += 1
                self._session.end(StepState.DONE)

    def _name(self, frequency_Hz: float, way: str) -> str:
        kind: str = self._procedure.procedure
        if self._procedure.control == "phase-resonance":
            kind = "phase-resonance"
        prefix = "" if kind == "stepped-sine" else f"{kind}-"
        return f"{prefix}{frequency_Hz:g}Hz-{way}"

    def _step(self, sweep: str, index: int, frequency_Hz: float, amplitude: float) -> StepResult:
        procedure = self._procedure
        phase = procedure.phase
        step = SineStep(
            place=StepPlace(sweep=sweep, index=index, target_channel=self._target_channel, target_amplitude=amplitude),
            frequency_Hz=frequency_Hz,
            voltage_V=self._first_voltage(frequency_Hz, amplitude),
            measured_channel=self._measured_channel,
            control=self._control,
            tolerance=procedure.controller.tolerance,
            settle=procedure.settle,
            measure_s=self._measure_s(frequency_Hz),
            phase=self._phase_lock(frequency_Hz),
            phase_channel=phase.channel if phase else "",
            phase_tolerance_rad=math.radians(phase.tolerance) if phase else math.inf,
        )
        result = run_sine_step(self._session, step, sample_rate_Hz=self._sample_rate_Hz)
        if result.voltage_V > 0 and result.amplitude > 0:
            self._ratios.append((result.frequency_Hz, result.amplitude / result.voltage_V))
        return result

    def _first_voltage(self, frequency_Hz: float, amplitude: float) -> float:
        """From the ratio of amplitude to voltage met last at the nearest frequency; a whisper if nothing is known."""
        if not self._measured_channel:
            return amplitude
        if not self._ratios:
            return self._procedure.controller.start_voltage
        nearest = min(reversed(self._ratios), key=lambda known: abs(math.log(known[0] / frequency_Hz)))
        return amplitude / nearest[1]

    def _measure_s(self, frequency_Hz: float) -> float:
        if isinstance(self._procedure, Dwell):
            return self._procedure.duration
        return self._procedure.measure.duration_s(frequency_Hz)

    def _amplitude_control(self, time_constant_s: float) -> AmplitudeControl:
        procedure = self._procedure
        if procedure.control == "voltage":
            return AmplitudeControl()
        tolerance = procedure.controller.tolerance
        if self._session.channels[procedure.target_channel].quantity == "force":
            # tight: the response lags behind every step of the force, and their ratio is what is measured
            return FastHold(deadband=0.05 * tolerance)
        return SlowHold(deadband=0.2 * tolerance, time_constant_s=time_constant_s)

    def _phase_lock(self, frequency_Hz: float) -> PhaseLock | None:
        phase, force = self._procedure.phase, self._session.force_channel
        if phase is None or force is None:
            return None
        return PhaseLock(
            start_Hz=frequency_Hz,
            widest_Hz=phase.widest or 0.1 * frequency_Hz,
            target=resonance_phase(self._session.channels[phase.channel], force),
            deadband=math.radians(phase.tolerance) / 4,
            time_constant_s=TIME_CONSTANT_CYCLES / frequency_Hz,
        )

    def _response(self, result: StepResult) -> complex:
        """What an adaptive grid looks at: the channel that moves most of those that are not held."""
        others = [p for name, p in result.phasors.items() if name != result.target_channel]
        return max(others or list(result.phasors.values()), key=abs, default=0j)

    def _ring_down(self, procedure: RingDown, sweep: str, index: int) -> None:
        """Generator to zero, the decay recorded as a step of its own."""
        session = self._session
        frequency_Hz = session.frequency_Hz
        place = StepPlace(sweep=sweep, index=index, target_channel=self._target_channel, target_amplitude=0.0)
        session.stream.begin_step()
        start_ns = session.set_output(Excitation())
        end_ns = start_ns + round(procedure.duration * 1e9)
        session.mark(place, StepState.MEASURING, start_ns, frequency_Hz)
        session.recorder.open(start_ns, end_ns, session.stream.buffered)
        session.stream.wait(end_ns)
        session.finish_step(
            StepResult(
                **vars(place), frequency_Hz=frequency_Hz, voltage_V=0.0, amplitude=0.0, settle_s=0.0,
                measure_s=procedure.duration,
            ),
            end_ns,
        )  # fmt: skip
