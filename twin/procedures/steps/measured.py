"""A measured stretch as numbers."""

import math
from collections.abc import Mapping

import numpy as np

from twin.procedures.results import StepResult
from twin.procedures.session import Session
from twin.procedures.steps.phasors import relative_phasors
from twin.procedures.steps.step import SineStep
from twin.procedures.steps.wait import Wait
from twin.procedures.stream import Series

HARMONICS = 5


def measured(
    session: Session, step: SineStep, series: Mapping[str, Series], *, wait: Wait, settle_s: float, measure_s: float
) -> StepResult:
    """Fit the measured stretch, whole and in halves."""
    frequency_Hz = session.frequency_Hz
    fits = session.fits(series, frequency_Hz=frequency_Hz, harmonics=HARMONICS, modulation=2)
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
    frequency_Hz = session.frequency_Hz
    halves: list[dict[str, complex]] = []
    for second in (False, True):
        part = {}
        for name, one in series.items():
            middle = len(one.samples) // 2
            samples = one.samples[middle:] if second else one.samples[:middle]
            offset_s = one.offset_s + (middle / one.sample_rate_Hz if second else 0.0)
            part[name] = Series(samples=samples, sample_rate_Hz=one.sample_rate_Hz, offset_s=offset_s)
        fits = session.fits(part, frequency_Hz=frequency_Hz, harmonics=HARMONICS)
        if not fits or step.measure_s * frequency_Hz < 2.0:
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
