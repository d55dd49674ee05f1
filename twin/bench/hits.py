"""A rig that is hit at one place after the other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from recordings.run import Channel, SampleBlock
from recordings.streams import Excitation
from twin.bench.bench import Bench
from twin.bench.limits import LIMITS


@dataclass(frozen=True, kw_only=True)
class Hit:
    """One hit: its peak, and whether the hammer rebounds."""

    peak_N: float
    rebound: bool = False


class HammeredBench:
    """A rig that somebody hits at one place after the other; it is a :class:`recordings.streams.SampleSource`.

    The first hit comes a while after the sample rate was chosen, the others at equal intervals, whatever anybody does:
    as on a real rig, who records must see them coming.  At each place the rig begins at rest.

    Parameters
    ----------
    open_at
        Gives the bench, at rest and driven by a force, that is hit at the place of a number.
    hits
        Of each place, in order.
    width_s
        Of each half sine.
    every_s
        From one hit to the next.
    """

    def __init__(
        self, open_at: Callable[[int], Bench], hits: Sequence[Sequence[Hit]], *, width_s: float, every_s: float
    ) -> None:
        self._open_at, self._hits, self._width_s, self._every_s = open_at, hits, width_s, every_s
        self._place, self._done, self._local, self._index = 0, 0, 0, 0
        self._time_ns = 0
        self._bench = open_at(0)

    @property
    def channels(self) -> Sequence[Channel]:
        """Of the rig, the force cell being the hammer's."""
        return self._bench.channels

    @property
    def sample_rate_Hz(self) -> float:
        """Nominal rate of the samples."""
        return self._bench.sample_rate_Hz

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        """Choose the nearest rate the converter has; the test begins anew, at rest."""
        if self._local or self._place:
            self._open(0)
        return self._bench.set_sample_rate(sample_rate_Hz)

    def set_output(self, excitation: Excitation) -> None:
        """Nothing: the shaker is taken off."""

    def read(self, count: int) -> SampleBlock:
        """Advance by `count` samples and return them."""
        blocks: list[SampleBlock] = []
        left = count
        while left > 0 or not blocks:
            if self._local == self._due(self._done):
                self._strike()
            blocks.append(self._bench.read(min(left, max(1, self._due(self._done) - self._local))))
            left -= len(blocks[-1])
            self._local += len(blocks[-1])
        names = blocks[0].samples
        block = replace(
            blocks[0], time_ns=self._time_ns, first_index=self._index,
            samples={name: np.concatenate([each.samples[name] for each in blocks]) for name in names},
            overload={name: sum(each.overload[name] for each in blocks) for name in names},
        )  # fmt: skip
        self._index += count
        self._time_ns += round(count / self.sample_rate_Hz * 1e9)
        return block

    def _due(self, hit: int) -> int:
        """Sample, since the rig was at rest, at which a hit comes; the one after the last is the next place's turn."""
        return round((LIMITS.takes_aim_s + hit * self._every_s) * self.sample_rate_Hz)

    def _strike(self) -> None:
        hits = self._hits[self._place]
        if self._done < len(hits):
            hit = hits[self._done]
            self._bench.hit(peak_N=hit.peak_N, width_s=self._width_s, rebound=hit.rebound)
        elif self._place + 1 < len(self._hits):
            self._open(self._place + 1)
            return
        self._done += 1

    def _open(self, place: int) -> None:
        rate_Hz = self.sample_rate_Hz
        self._bench = self._open_at(place)
        self._bench.set_sample_rate(rate_Hz)
        self._place, self._done, self._local = place, 0, 0
