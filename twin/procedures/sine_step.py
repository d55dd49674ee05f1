"""One step of a sine procedure: set, hold the amplitude while it settles, measure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from recordings.run import StepState
from twin.procedures.amplitude import AmplitudeControl
from twin.procedures.brake import Brake
from twin.procedures.phase import PhaseLock, resonance_phase
from twin.procedures.results import StepResult
from twin.procedures.session import Place, Session
from twin.procedures.settling import SettlingDetector, usual_rate
from twin.procedures.sine_fit import SineFit
from twin.procedures.stream import Series
from twin.procedures.tables import Settle

__all__ = ["SineStep", "run_sine_step", "window_seconds"]

WINDOW_CYCLES = 10
LEAST_SAMPLES = 64
CONTROL_HARMONICS = 3
MEASURE_HARMONICS = 5


@dataclass(frozen=True, kw_only=True)
class SineStep:
    """What one step asks for; `phase` is None where the frequency stays."""

    place: Place
    frequency_Hz: float
    voltage_V: float
    measured_channel: str
    control: AmplitudeControl
    tolerance: float
    settle: Settle
    measure_s: float
    phase: PhaseLock | None = None
    phase_channel: str = ""
    phase_tolerance_rad: float = math.inf


def window_seconds(frequency_Hz: float, sample_rate_Hz: float) -> float:
    """Length of a control window: at least ten cycles and 64 samples, a whole number of samples."""
    cycles = max(WINDOW_CYCLES, math.ceil(LEAST_SAMPLES * frequency_Hz / sample_rate_Hz))
    return round(cycles / frequency_Hz * sample_rate_Hz) / sample_rate_Hz


def run_sine_step(session: Session, step: SineStep, *, sample_rate_Hz: float) -> StepResult:
    """Run one step; the generator is left as it was while measuring."""
    session.stream.begin_step()
    holds_ns = session.set_sine(step.frequency_Hz, step.voltage_V)
    session.mark(step.place, StepState.SETTLING, holds_ns, step.frequency_Hz)
    wait = _Wait(session, step, holds_ns, sample_rate_Hz)
    measure_ns = session.stream.align(wait.run())
    frequency_Hz = session.frequency_Hz
    count = max(1, round(step.measure_s * sample_rate_Hz))
    end_ns = measure_ns + round(count / sample_rate_Hz * 1e9)
    session.stream.drop_before(measure_ns)
    session.mark(step.place, StepState.MEASURING, measure_ns, frequency_Hz)
    session.recorder.open(measure_ns, end_ns, session.stream.buffered)
    series = _collect(session, measure_ns, count / sample_rate_Hz)
    result = _measured(
        session,
        step,
        series,
        wait=wait,
        settle_s=(measure_ns - holds_ns) * 1e-9,
        measure_s=count / sample_rate_Hz,
    )
    if abs(result.amplitude_error) > step.tolerance:
        session.note("not-held", _not_held(session, result), source=step.measured_channel)
    session.finish_step(result, end_ns)
    session.recorder.close()
    return result


def _collect(session: Session, start_ns: int, duration_s: float) -> dict[str, Series]:
    """A window of any length, read in pieces of a second so that progress is seen."""
    done_s = 0.0
    while done_s < duration_s:
        done_s = min(duration_s, done_s + 1.0)
        session.stream.wait(start_ns + round(done_s * 1e9))
        session.tick()
    return session.window(start_ns, duration_s)


class _Wait:
    """The wait before a measurement, with control running."""

    def __init__(self, session: Session, step: SineStep, holds_ns: int, sample_rate_Hz: float) -> None:
        self._session, self._step, self._sample_rate_Hz = session, step, sample_rate_Hz
        self._holds_ns = self._reference_ns = holds_ns
        # the free decay of the last step, seen from this step's frequency
        known = session.free_rate
        rate = usual_rate(step.frequency_Hz) if known is None else known - 2j * math.pi * step.frequency_Hz
        self._detector = SettlingDetector(step.settle.tolerance, rate=rate, certain=known is not None)
        self._brake = Brake(step.settle.tolerance)
        self._may_detour = step.settle.detours and step.phase is None
        self.settled: bool | None = None

    @property
    def remaining(self) -> float | None:
        """The transient left, as far as the windows show it."""
        left = self._detector.remaining
        return left if math.isfinite(left) else None

    def run(self) -> int:
        """Wait; returns the time from which to measure."""
        step, session = self._step, self._session
        step.control.begin()
        fixed_s = step.settle.seconds
        longest_s = step.settle.maximum if fixed_s is None else fixed_s
        start_ns = self._holds_ns
        while True:
            length_s = window_seconds(session.frequency_Hz, self._sample_rate_Hz)
            after_s = (start_ns - self._holds_ns) * 1e-9 + length_s
            if after_s > longest_s + 1e-9:
                break
            series = session.window(start_ns, length_s)
            delay_s = (start_ns - self._reference_ns) * 1e-9
            fits = session.fits(
                series,
                frequency_Hz=session.frequency_Hz,
                harmonics=CONTROL_HARMONICS,
                modulation=2,
                delay_s=delay_s,
            )
            end_ns = start_ns + round(length_s * 1e9)
            if not fits:
                start_ns = end_ns
                continue
            held = self._regulate(fits, length_s, start_ns)
            start_ns = held if held is not None else end_ns
            if fixed_s is None and held is None and after_s >= step.settle.minimum and self._is_settled(fits):
                self.settled = True
                if self._detector.certain:
                    session.free_rate = self._detector.rate + 2j * math.pi * session.frequency_Hz
                return end_ns
            if fixed_s is None and held is None and self._may_detour:
                back_ns = self._brake.act(self._session, self._detector, length_s=length_s, end_ns=end_ns)
                if back_ns is not None:
                    step.control.begin()
                    start_ns = self._reference_ns = back_ns
        if fixed_s is not None:
            return session.stream.align(self._holds_ns + round(fixed_s * 1e9))
        self.settled = False
        left = self.remaining
        detail = f"after {longest_s:g} s" + (
            "" if left is None else f" about {100 * left:.2g} % of the transient is left"
        )
        session.note("unsettled", detail)
        return start_ns

    def _regulate(self, fits: Mapping[str, SineFit], length_s: float, start_ns: int) -> int | None:
        """Feed detector, amplitude and phase control; the time from which a change holds, None without a change."""
        step, session = self._step, self._session
        turned = _relative_phasors(session, fits, step.measured_channel)
        end_ns = start_ns + round(length_s * 1e9)
        time_s = (start_ns - self._holds_ns) * 1e-9
        self._detector.add(turned, {name: fits[name].std for name in turned}, time_s=time_s)
        nearness = _nearness(session, self._detector.steady, step.measured_channel)
        frequency_Hz, voltage_V = session.frequency_Hz, session.voltage_V
        if step.phase is not None and step.phase_channel in turned:
            angle = float(np.angle(turned[step.phase_channel]))
            frequency_Hz = step.phase.update(angle, frequency_Hz=frequency_Hz, window_s=length_s)
        fit = fits.get(step.measured_channel)
        if fit is not None or not step.measured_channel:
            voltage_V = step.control.update(
                fit.phasor if fit else 0j,
                std=fit.std if fit else 0.0,
                target=step.place.target_amplitude,
                voltage_V=voltage_V,
                window_s=length_s,
                nearness=nearness,
            )
        unmoved = frequency_Hz == session.frequency_Hz
        if unmoved and (voltage_V == session.voltage_V or (session.saturated and voltage_V > session.voltage_V)):
            return None
        holds_ns = session.set_sine(frequency_Hz, voltage_V)
        if not unmoved:  # phases before and after a change of frequency do not compare
            step.control.begin()
            self._reference_ns = max(holds_ns, end_ns)
        return max(holds_ns, end_ns)

    def _is_settled(self, fits: Mapping[str, SineFit]) -> bool:
        step, session = self._step, self._session
        if step.phase is not None and abs(step.phase.error) > step.phase_tolerance_rad:
            return False
        fit = fits.get(step.measured_channel)
        if fit is not None and not session.saturated:
            error = abs(abs(fit.phasor) / step.place.target_amplitude - 1.0)
            if error > max(0.5 * step.tolerance, 3 * fit.std / step.place.target_amplitude):
                return False
        return self._detector.settled


def _relative_phasors(session: Session, fits: Mapping[str, SineFit], target: str) -> dict[str, complex]:
    """Phasors relative to the phase of the force: at rest once settled, whatever the clocks of the devices do."""
    force = session.force_channel
    name = force.name if force is not None and force.name in fits else target
    reference = fits[name].phasor if name in fits else next(iter(fits.values())).phasor
    turn = np.conj(reference) / max(abs(reference), 1e-300)
    return {channel: complex(fit.phasor * turn) for channel, fit in fits.items()}


def _nearness(session: Session, turned: Mapping[str, complex], response: str) -> float | None:
    """cos2 of the phase a response is away from phase resonance: 1 there, small far away; None if it is not known."""
    force = session.force_channel
    if force is None or force.name not in turned or response not in turned or response == force.name:
        return None
    off = float(np.angle(turned[response])) - resonance_phase(session.channels[response], force)
    return math.cos(off) ** 2


def _measured(
    session: Session, step: SineStep, series: Mapping[str, Series], *, wait: _Wait, settle_s: float, measure_s: float
) -> StepResult:
    """Fit the measured stretch, whole and in halves."""
    frequency_Hz = session.frequency_Hz
    fits = session.fits(series, frequency_Hz=frequency_Hz, harmonics=MEASURE_HARMONICS, modulation=2)
    phasors = _relative_phasors(session, fits, step.measured_channel) if fits else {}
    fit = fits.get(step.measured_channel)
    reached = abs(fit.phasor) if fit else math.nan
    amplitude = reached if step.measured_channel else session.voltage_V
    return StepResult(
        sweep=step.place.sweep,
        index=step.place.index,
        frequency_Hz=frequency_Hz,
        target_channel=step.place.target_channel,
        target_amplitude=step.place.target_amplitude,
        voltage_V=session.voltage_V,
        amplitude=amplitude,
        settle_s=settle_s,
        measure_s=measure_s,
        settled=wait.settled,
        remaining=wait.remaining,
        drift=_drift(session, step, series, {n: p for n, p in phasors.items() if abs(p) > 10 * fits[n].std}),
        phasors=phasors,
        std={name: one.std for name, one in fits.items()},
        distortion={name: one.distortion for name, one in fits.items()},
        peak={name: _peak(one) for name, one in series.items()},
    )


def _drift(
    session: Session,
    step: SineStep,
    series: Mapping[str, Series],
    phasors: Mapping[str, complex],
) -> float | None:
    """Largest relative change between the halves of a measurement of at least two cycles."""
    frequency_Hz = session.frequency_Hz
    halves: list[dict[str, complex]] = []
    for second in (False, True):
        part = {}
        for name, one in series.items():
            middle = len(one.samples) // 2
            samples = one.samples[middle:] if second else one.samples[:middle]
            offset_s = one.offset_s + (middle / one.sample_rate_Hz if second else 0.0)
            part[name] = Series(samples=samples, sample_rate_Hz=one.sample_rate_Hz, offset_s=offset_s)
        fits = session.fits(part, frequency_Hz=frequency_Hz, harmonics=MEASURE_HARMONICS)
        if not fits or step.measure_s * frequency_Hz < 2.0:
            return None
        halves.append(_relative_phasors(session, fits, step.measured_channel))
    changes = [
        abs(halves[1][name] - halves[0][name]) / abs(phasor)
        for name, phasor in phasors.items()
        if name in halves[0] and name in halves[1] and phasor
    ]
    return max(changes, default=None)


def _peak(series: Series) -> float:
    known = series.samples[np.isfinite(series.samples)]
    return float(np.abs(known).max()) if len(known) else math.nan


def _not_held(session: Session, result: StepResult) -> str:
    text = f"{result.amplitude:.4g} instead of {result.target_amplitude:.4g} at {result.frequency_Hz:g} Hz"
    return text + (f"; the generator is at its limit of {session.voltage_V:g} V" if session.saturated else "")
