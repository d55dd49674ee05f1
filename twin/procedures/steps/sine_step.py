"""One step of a sine procedure: set, hold the amplitude while it settles, measure."""

import math
from collections.abc import Mapping

import numpy as np

from recordings.run import StepState
from twin.procedures.results import StepResult
from twin.procedures.session import Session
from twin.procedures.steps.phase import relative_phasors
from twin.procedures.steps.wait import SineStep, Wait
from twin.procedures.stream import Series


def run_sine_step(session: Session, step: SineStep, *, sample_rate_Hz: float) -> StepResult:
    """Run one step; the generator is left as it was while measuring."""
    session.stream.begin_step()
    holds_ns = session.set_sine(step.frequency_Hz, step.voltage_V)
    session.mark(step.place, StepState.SETTLING, holds_ns, step.frequency_Hz)
    wait = Wait(session, step, holds_ns, sample_rate_Hz)
    measure_ns = session.stream.align(wait.run())
    frequency_Hz = session.frequency_Hz
    count = max(1, round(step.measure_s * sample_rate_Hz))
    end_ns = measure_ns + round(count / sample_rate_Hz * 1e9)
    session.stream.drop_before(measure_ns)
    session.mark(step.place, StepState.MEASURING, measure_ns, frequency_Hz)
    session.recorder.open(measure_ns, end_ns, session.stream.buffered)
    series = session.window(measure_ns, count / sample_rate_Hz)
    result = _measured(
        session, step, series, wait=wait, settle_s=(measure_ns - holds_ns) * 1e-9, measure_s=count / sample_rate_Hz
    )
    if abs(result.amplitude_error) > step.tolerance:
        told = f"{result.amplitude:.4g} instead of {result.target_amplitude:.4g} at {result.frequency_Hz:g} Hz"
        told += f"; the generator is at its limit of {session.voltage_V:g} V" if session.saturated else ""
        session.note("not-held", told, source=result.target_channel)
    session.finish_step(result, end_ns)
    return result


def _measured(
    session: Session, step: SineStep, series: Mapping[str, Series], *, wait: Wait, settle_s: float, measure_s: float
) -> StepResult:
    """Fit the measured stretch, whole and in halves."""
    frequency_Hz = session.frequency_Hz
    fits = session.fits(series, modulation=2)
    phasors = relative_phasors(session, fits, step.measured_channel) if fits else {}
    fit = fits.get(step.measured_channel)
    reached = abs(fit.phasor) if fit else math.nan
    amplitude = reached if step.measured_channel else session.voltage_V
    return StepResult(
        **vars(step.place),
        frequency_Hz=frequency_Hz,
        voltage_V=session.voltage_V,
        amplitude=amplitude,
        settle_s=settle_s,
        measure_s=measure_s,
        settled=wait.settled,
        remaining=wait.remaining,
        drift=_drift(session, step, series, {n: p for n, p in phasors.items() if abs(p) > 10 * fits[n].std}),
        phasors=phasors,
        std={name: one.std for name, one in fits.items()},
        harmonics={name: tuple(map(abs, one.harmonics.tolist())) for name, one in fits.items()},
        distortion={name: one.distortion for name, one in fits.items()},
        peak={name: _peak(one) for name, one in series.items()},
    )


def _drift(
    session: Session, step: SineStep, series: Mapping[str, Series], phasors: Mapping[str, complex]
) -> float | None:
    """Largest relative change between the halves of a measurement of at least two cycles."""
    halves: list[dict[str, complex]] = []
    for second in (False, True):
        part = {}
        for name, one in series.items():
            middle = len(one.samples) // 2
            samples = one.samples[middle:] if second else one.samples[:middle]
            offset_s = one.offset_s + (middle / one.sample_rate_Hz if second else 0.0)
            part[name] = Series(samples=samples, sample_rate_Hz=one.sample_rate_Hz, offset_s=offset_s)
        fits = session.fits(part)
        if not fits or step.measure_s * session.frequency_Hz < 2.0:
            return None
        halves.append(relative_phasors(session, fits, step.measured_channel))
    changes = [
        abs(halves[1][name] - halves[0][name]) / abs(phasor)
        for name, phasor in phasors.items()
        if name in halves[0] and name in halves[1] and phasor
    ]
    return max(changes, default=None)


def _peak(series: Series) -> float:
    known = series.samples[np.isfinite(series.samples)]
    return float(np.abs(known).max()) if len(known) else math.nan
