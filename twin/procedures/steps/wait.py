"""A step and the wait before its measurement: amplitude and phase controlled, settling judged, transients stopped."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twin.procedures.session import Session, StepPlace
from twin.procedures.sine_fit import SineFit
from twin.procedures.steps.amplitude import AmplitudeControl
from twin.procedures.steps.brake import Brake
from twin.procedures.steps.phase import PhaseLock, nearness, relative_phasors
from twin.procedures.steps.settling import SettlingDetector, usual_rate
from twin.procedures.tables import Settle


@dataclass(frozen=True, kw_only=True)
class SineStep:
    """One step.

    `measured_channel` is the one held at the target, empty in open loop; `tolerance` what counts as held; `phase` is
    None where the frequency stays, otherwise it follows `phase_channel` until within `phase_tolerance_rad`.
    """

    place: StepPlace
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
    cycles = max(10, math.ceil(64 * frequency_Hz / sample_rate_Hz))
    return round(cycles / frequency_Hz * sample_rate_Hz) / sample_rate_Hz


class Wait:
    """One step's wait.

    Parameters
    ----------
    session, step
        What runs, and what it asks for; the generator has been set.
    """

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
            fits = session.fits(series, modulation=2, delay_s=delay_s)
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
        turned = relative_phasors(session, fits, step.measured_channel)
        end_ns = start_ns + round(length_s * 1e9)
        time_s = (start_ns - self._holds_ns) * 1e-9
        self._detector.add(turned, {name: fits[name].std for name in turned}, time_s=time_s)
        near = nearness(session, self._detector.steady, step.measured_channel)
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
                nearness=near,
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
