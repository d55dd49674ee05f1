"""Excitation that is not one sine, measured in one piece: the stretch, and what came of it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from recordings.level import Level
from recordings.quantities import follows_excitation
from recordings.run import StepState
from twin.procedures.limits import LIMITS
from twin.procedures.results import StepResult
from twin.procedures.session import Session, StepPlace
from twin.procedures.stream import Series


@dataclass(kw_only=True)
class Size(Level):
    """How large one channel is over a stretch."""

    sample_rate_Hz: float


class Passing:
    """A stretch in pieces, of which one is in memory at a time, however long it is."""

    def __init__(self, session: Session, start_ns: int, duration_s: float) -> None:
        self._session, self._start_ns, self._duration_s = session, start_ns, duration_s
        self._taken_s = 0.0
        self.sizes: dict[str, Size] = {}
        """Of all channels, as far as they were taken."""

    def take(self, until_ns: int | None = None) -> dict[str, Size]:
        """Take the pieces that end before a time; all, waiting for them, without one."""
        while self._taken_s < self._duration_s:
            length_s = min(LIMITS.piece_s, self._duration_s - self._taken_s)
            start_ns = self._start_ns + round(self._taken_s * 1e9)
            if until_ns is not None and start_ns + round(length_s * 1e9) > until_ns:
                break
            for name, one in self._session.window(start_ns, length_s).items():
                self.sizes.setdefault(name, Size(sample_rate_Hz=one.sample_rate_Hz)).take(one.samples)
            self._taken_s += length_s
        return self.sizes


def measure(session: Session, place: StepPlace, start_ns: int, duration_s: float) -> dict[str, Size]:
    """Record a stretch."""
    end_ns = start_ns + round(duration_s * 1e9)
    session.stream.begin_step()
    session.stream.drop_before(start_ns)
    session.mark(place, StepState.MEASURING, start_ns, 0.0)
    session.recorder.open(start_ns, end_ns, session.stream.buffered)
    return Passing(session, start_ns, duration_s).take()


def finish(session: Session, sizes: Mapping[str, Size], driven: StepResult) -> None:
    """Keep a stretch as the one step of its sweep, with how long and how large it was, and end it."""
    duration_s = max((one.samples / one.sample_rate_Hz for one in sizes.values()), default=0.0)
    peak = {n: one.largest for n, one in sizes.items() if follows_excitation(session.channels[n].quantity)}
    session.finish_step(replace(driven, measure_s=duration_s, peak=peak), session.stream.latest_ns)
    session.end(StepState.DONE)


def rms(series: Series) -> float:
    """Of the samples that are there, without their mean."""
    known = series.samples[np.isfinite(series.samples)]
    return float(np.std(known)) if len(known) else math.nan
