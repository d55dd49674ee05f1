"""Blocks of one device put together: order, duplicates, losses and restarts made explicit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recordings.limits import Limits
from recordings.run import DeviceSamples, Event, Gap, SampleBlock

__all__ = ["Assembler"]

RATE_TOLERANCE = 1e-6
CLOCK_TOLERANCE = 1e-3
"""How far a device's clock may stray from its stated rate between two blocks (relative)."""


@dataclass(kw_only=True)
class _Placed:
    """A block with the number of its first sample since the device's *first* start."""

    number: int
    block: SampleBlock


class Assembler:
    """Collects the blocks of one device in the order of the file, then gives its samples.

    Sample numbers decide where a block belongs.  A block that comes late fills its gap; one that repeats what is
    there is dropped; one that contradicts it is refused.  Numbers that begin again at a later time are a restart
    of the device, and what it missed is told by the time stamps.

    Parameters
    ----------
    device
        Its name.
    limits
        `values` bounds what is held, `gap_fill` how much of a loss is filled with NaN.
    """

    def __init__(self, device: str, limits: Limits) -> None:
        self._device, self._limits = device, limits
        self._placed: list[_Placed] = []
        self._last: _Placed | None = None
        self._offset = 0  # of numbers since the latest restart
        self._overload: Counter[str] = Counter()
        self.notices: list[Event] = []
        """What somebody should know of the order and the times of the blocks."""
        self.values_held = 0

    @property
    def rate_Hz(self) -> float:
        """Sample rate of the first block."""
        return self._placed[0].block.sample_rate_Hz

    def add(self, block: SampleBlock) -> None:
        """Take the next block.

        Raises
        ------
        ValueError
            With the reason, if it contradicts the ones before in rate or time.
        """
        if not len(block):
            return
        number = block.first_index + self._offset
        if self._last is not None:
            if abs(block.sample_rate_Hz - self.rate_Hz) > RATE_TOLERANCE * self.rate_Hz:
                raise ValueError(f"the sample rate changes from {self.rate_Hz} to {block.sample_rate_Hz} Hz")
            number = self._number(block, self._last)
        placed = _Placed(number=number, block=block)
        self._placed.append(placed)
        self._overload.update(block.overload)
        self.values_held += len(block) * len(block.samples)
        if self._last is None or number > self._last.number:
            self._last = placed

    def _number(self, block: SampleBlock, last: _Placed) -> int:
        """The sample number of a block after the first; checks its time against the block before."""
        number = block.first_index + self._offset
        length_s = len(last.block) / self.rate_Hz
        passed_s = (block.time_ns - last.block.time_ns) * 1e-9
        expected_s = (number - last.number) / self.rate_Hz
        slack_s = max(2 / self.rate_Hz, 0.25 * length_s) + CLOCK_TOLERANCE * abs(passed_s)
        if number >= last.number + len(last.block):
            if passed_s < length_s - slack_s:
                raise ValueError(
                    f"its time is {passed_s:.6g} s after a block that lasts {length_s:.6g} s: the time stamps overlap"
                )
            if abs(passed_s - expected_s) > slack_s:
                self._notice(block, "time", f"{expected_s:.6g} s of samples are numbered, {passed_s:.6g} s passed")
            return number
        if abs(passed_s - expected_s) <= slack_s:
            return number  # late, or a duplicate
        if passed_s < length_s - slack_s:
            raise ValueError(f"its time and first_index {block.first_index} contradict the block before")
        missed = max(0, round((passed_s - length_s) * self.rate_Hz))
        number = last.number + len(last.block) + missed
        self._offset = number - block.first_index
        self._notice(block, "restart", f"sample numbers begin again at {block.first_index}; {missed} samples missed")
        return number

    def _notice(self, block: SampleBlock, kind: str, detail: str) -> None:
        self.notices.append(Event(time_ns=block.time_ns, source=self._device, kind=kind, detail=detail))

    def finish(self) -> DeviceSamples:
        """All samples in order of their numbers, lost ones as NaN.

        Raises
        ------
        ValueError
            With the reason, if two blocks give different values for one sample, or the limit is exceeded.
        """
        in_order = sorted(self._placed, key=lambda placed: placed.number)
        if any(a.number > b.number for a, b in zip(self._placed, self._placed[1:], strict=False)):
            self._notice(in_order[0].block, "order", "blocks stood out of order in the file and were put in order")
        self._placed = []
        channels = list(dict.fromkeys(name for placed in in_order for name in placed.block.samples))
        starts, kept, gaps, repeated, total = self._positions(in_order)
        if total * len(channels) > self._limits.values:
            raise ValueError(f"more than {self._limits.values} samples, the limit of this program")
        values = {name: np.full(total, np.nan, dtype=np.float32) for name in channels}
        for (placed, skip), start in zip(kept, starts, strict=True):
            for name, series in placed.block.samples.items():
                values[name][start : start + len(series) - skip] = series[skip:]
        first = in_order[0].block
        for name in channels:
            if without := sum(name not in placed.block.samples for placed, _ in kept):
                self._notice(first, "lost-samples", f"{without} blocks do not have channel {name!r:.80}")
        if repeated:
            self._notice(first, "duplicate", f"{repeated} samples stood twice in the file and were taken once")
        return DeviceSamples(
            device=self._device, sample_rate_Hz=in_order[0].block.sample_rate_Hz, values=values,
            block_start=np.array(starts, dtype=np.int64),
            block_time_ns=np.array([_time_of(placed.block, skip) for placed, skip in kept], dtype=np.int64),
            overload={name: self._overload[name] for name in channels}, gaps=tuple(gaps),
        )  # fmt: skip

    def _positions(self, in_order: list[_Placed]) -> tuple[list[int], list[tuple[_Placed, int]], list[Gap], int, int]:
        """Where each block goes: starts, blocks with the samples to skip, gaps, samples repeated, length."""
        starts: list[int] = []
        kept: list[tuple[_Placed, int]] = []
        gaps: list[Gap] = []
        position = repeated = 0
        furthest = in_order[0]
        end = furthest.number
        for placed in in_order:
            skip = 0
            if placed.number > end:
                lost = placed.number - end
                gaps.append(Gap(device=self._device, first_index=end, count=lost))
                position += min(lost, self._limits.gap_fill)
            elif placed.number < end:
                skip = min(end - placed.number, len(placed.block))
                self._compare(furthest, placed, skip)
                repeated += skip
                if skip == len(placed.block):
                    continue
            starts.append(position)
            kept.append((placed, skip))
            position += len(placed.block) - skip
            end, furthest = placed.number + len(placed.block), placed
        return starts, kept, gaps, repeated, position

    def _compare(self, earlier: _Placed, later: _Placed, count: int) -> None:
        """Refuse a block whose first `count` samples differ from those of the block that has them already."""
        at = later.number - earlier.number
        same = _part(earlier.block.samples, at, count), _part(later.block.samples, 0, count)
        if same[0] != same[1]:
            raise ValueError(
                f"samples {later.block.first_index} to {later.block.first_index + count - 1} are given twice with "
                "different values"
            )


def _part(samples: Mapping[str, NDArray[np.float32]], start: int, count: int) -> dict[str, bytes]:
    return {name: series[start : start + count].tobytes() for name, series in samples.items()}


def _time_of(block: SampleBlock, skip: int) -> int:
    return block.time_ns + round(skip * 1e9 / block.sample_rate_Hz)
