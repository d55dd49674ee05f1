"""Excitation that is not one sine, measured in one piece: the stretch, and what came of it."""

import math
from collections.abc import Mapping

import numpy as np

from recordings.quantities import follows_excitation
from recordings.run import StepState
from twin.procedures.results import StepResult
from twin.procedures.session import Session, StepPlace
from twin.procedures.stream import Series


def measure(session: Session, place: StepPlace, start_ns: int, duration_s: float) -> dict[str, Series]:
    """Record a stretch."""
    end_ns = start_ns + round(duration_s * 1e9)
    session.stream.begin_step()
    session.stream.drop_before(start_ns)
    session.mark(place, StepState.MEASURING, start_ns, 0.0)
    session.recorder.open(start_ns, end_ns, session.stream.buffered)
    return session.window(start_ns, duration_s)


def finish(
    session: Session,
    place: StepPlace,
    series: Mapping[str, Series],
    *,
    voltage_V: float,
    amplitude: float,
    settle_s: float,
    settled: bool | None = None,
    remaining: float | None = None,
    peak_frequency_Hz: float | None = None,
) -> None:
    """Keep what was measured as the one step of its sweep, and end it."""
    duration_s = max((len(one.samples) / one.sample_rate_Hz for one in series.values()), default=0.0)
    peak = {name: float(np.nanmax(np.abs(one.samples), initial=0.0)) for name, one in series.items()}
    end_ns = session.stream.latest_ns
    session.finish_step(
        StepResult(
            sweep=place.sweep, index=place.index, frequency_Hz=0.0, target_channel=place.target_channel,
            target_amplitude=place.target_amplitude, voltage_V=voltage_V, amplitude=amplitude, settle_s=settle_s,
            measure_s=duration_s, settled=settled, remaining=remaining, peak_frequency_Hz=peak_frequency_Hz,
            peak={n: p for n, p in peak.items() if follows_excitation(session.channels[n].quantity)},
        ),
        end_ns,
    )  # fmt: skip
    session.recorder.close()
    session.mark(place, StepState.DONE, end_ns, 0.0)


def rms(series: Series) -> float:
    """Of the samples that are there, without their mean."""
    known = series.samples[np.isfinite(series.samples)]
    return float(np.std(known)) if len(known) else math.nan
