"""Blocks of one device put together: order, duplicates, losses and restarts made explicit."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from recordings.limits import Limits
from recordings.run import DeviceSamples, Event, Gap, SampleBlock

__all__ = ["Assembler"]

RATE_TOLERANCE = 1e-6
STAMP_JITTER_s = 0.1
"""How far the time stamp of a block may stray at all; from a quarter of a block on, it is told."""
LATE_LIMIT = 10_000
CLOCK_TOLERANCE = 1e-3
"""How far a device's clock may stray from its stated rate between two blocks (relative)."""


@dataclass(frozen=True, kw_only=True)
class _Placed:
    """A block with the number of its first sample, counted from the device's first start."""

    number: int
    block: SampleBlock

    @property
    def end(self) -> int:
        return self.number + len(self.block)


class Assembler:
    """Collects the blocks of one device in the order of the file, then gives its samples.

    Sample numbers decide where a block belongs.  A block that comes late fills its gap; what repeats samples that
    are there already is dropped; what contradicts them is refused.  Numbers that begin again at a later time are a
    restart of the device, and what it missed is told by the time stamps.

    Parameters
    ----------
    device
        Its name.
    limits
        `values` bounds what is held, `gap_fill` how much of a loss is filled with NaN.
    """

    def __init__(self, device: str, limits: Limits) -> None:
        self._device, self._limits = device, limits
        self._placed: list[_Placed] = []  # in order of numbers, none overlapping
        self._offset = 0  # of numbers since the latest restart
        self._late = self._repeated = 0
        self._overload: Counter[str] = Counter()
        self._channels: dict[str, None] = {}
        self._restarts_and_times: list[Event] = []

    def add(self, block: SampleBlock) -> int:
        """Take the next block.

        Returns
        -------
        int
            How many values of all channels were kept of it.

        Raises
        ------
        ValueError
            With the reason, if it contradicts the ones before in rate, time or values; it is then not taken.
        """
        if not len(block):
            return 0
        number = block.first_index
        if self._placed:
            rate_Hz = self._placed[0].block.sample_rate_Hz
            if abs(block.sample_rate_Hz - rate_Hz) > RATE_TOLERANCE * rate_Hz:
                raise ValueError(f"the sample rate changes from {rate_Hz} to {block.sample_rate_Hz} Hz")
            number = self._number(block, self._placed[-1], rate_Hz)
        placed: _Placed | None = _Placed(number=number, block=block)
        at = max(0, bisect_right(self._placed, number, key=_number_of) - 1)
        while placed and at < len(self._placed) and self._placed[at].number < placed.end:
            placed = _without_repeats(placed, self._placed[at])
            at += 1
        self._repeated += len(block) - (len(placed.block) if placed else 0)
        if not placed:
            return 0
        at = bisect_right(self._placed, placed.number, key=_number_of)
        self._late += at < len(self._placed)
        if self._late > LATE_LIMIT:
            raise ValueError(f"more than {LATE_LIMIT} blocks out of order, the limit of this program")
        self._placed.insert(at, placed)
        self._overload.update(block.overload)
        self._channels.update(dict.fromkeys(block.samples))
        return len(placed.block) * len(block.samples)

    def _number(self, block: SampleBlock, last: _Placed, rate_Hz: float) -> int:
        """The sample number of a block after the first; checks its time against the furthest block so far."""
        number = block.first_index + self._offset
        length_s = len(last.block) / rate_Hz
        passed_s = (block.time_ns - last.block.time_ns) * 1e-9
        expected_s = (number - last.number) / rate_Hz
        slack_s = max(2 / rate_Hz, 0.25 * length_s) + CLOCK_TOLERANCE * abs(passed_s)
        off_s, wide_s = abs(passed_s - expected_s), slack_s + STAMP_JITTER_s
        if number < last.end and off_s <= wide_s:
            return number  # late, or a duplicate
        if passed_s < length_s - wide_s or (number >= last.end and passed_s <= 0):
            raise ValueError(
                f"its first_index {block.first_index} and its time, {passed_s:.6g} s after that of a block of "
                f"{length_s:.6g} s, contradict each other"
            )
        if number >= last.end:
            if off_s > slack_s:
                self._notice(block, "time", f"{expected_s:.6g} s of samples are numbered, {passed_s:.6g} s passed")
            return number
        missed = max(0, round((passed_s - length_s) * rate_Hz))
        self._offset = last.end + missed - block.first_index
        self._notice(block, "restart", f"sample numbers begin again at {block.first_index}; {missed} samples missed")
        return last.end + missed

    def _notice(self, block: SampleBlock, kind: str, detail: str) -> None:
        self._restarts_and_times.append(
            Event(time_ns=block.time_ns, source=self._device, kind=kind, detail=detail)
        )  # fmt: skip

    def notices(self) -> list[Event]:
        """What somebody should know of the order and the times of the blocks, as events."""
        found = list(self._restarts_and_times)
        time_ns = self._placed[0].block.time_ns if self._placed else 0
        for kind, count, detail in (
            ("order", self._late, "blocks stood out of order in the file and were put in order"),
            ("duplicate", self._repeated, "samples stood twice in the file and were taken once"),
        ):
            if count:
                found.append(Event(time_ns=time_ns, source=self._device, kind=kind, detail=f"{count} {detail}"))
        for name in self._channels:
            if without := sum(name not in placed.block.samples for placed in self._placed):
                detail = f"{without} blocks of device {self._device!r} do not have this channel"
                found.append(Event(time_ns=time_ns, source=name, kind="lost-samples", detail=detail))
        return found

    def counts(self) -> dict[str, int]:
        """Samples received of each channel."""
        received: Counter[str] = Counter()
        for placed in self._placed:
            received.update(dict.fromkeys(placed.block.samples, len(placed.block)))
        return dict(received)

    def overload(self) -> dict[str, int]:
        """Samples on the converter's limit, of each channel."""
        return {name: self._overload[name] for name in self._channels}

    def gaps(self) -> tuple[Gap, ...]:
        """Stretches of samples that were never received."""
        return tuple(
            Gap(device=self._device, first_index=before.end, count=after.number - before.end)
            for before, after in pairwise(self._placed)
            if after.number > before.end
        )

    def span_ns(self) -> tuple[int, int] | None:
        """Time of the first sample and just after the last one; None if there are none."""
        if not self._placed:
            return None
        last = self._placed[-1].block
        return self._placed[0].block.time_ns, last.time_ns + round(len(last) * 1e9 / last.sample_rate_Hz)

    def layout(self) -> tuple[list[int], int, NDArray[np.int64]]:
        """Where blocks go: the position each begins at, the number of positions, and the blocks' times.

        Raises
        ------
        ValueError
            With the reason, if samples and lost ones exceed the limit, or the times contradict the numbers.
        """
        time_ns = np.array([placed.block.time_ns for placed in self._placed], dtype=np.int64)
        if np.any(np.diff(time_ns) <= 0):
            raise ValueError("the time stamps do not rise with the sample numbers")
        starts: list[int] = []
        position, end = 0, self._placed[0].number if self._placed else 0
        for placed in self._placed:
            position += min(placed.number - end, self._limits.gap_fill)
            starts.append(position)
            position, end = position + len(placed.block), placed.end
        if position * len(self._channels) > self._limits.values:
            raise ValueError(f"more than {self._limits.values} samples with the lost ones, the limit of this program")
        return starts, position, time_ns

    def finish(self) -> DeviceSamples | None:
        """All samples in order of their numbers, lost ones as NaN; None if there are none.

        Raises
        ------
        ValueError
            As `layout` does.
        """
        starts, total, time_ns = self.layout()
        if not self._placed:
            return None
        values = {name: np.full(total, np.nan, dtype=np.float32) for name in self._channels}
        for placed, start in zip(self._placed, starts, strict=True):
            for name, series in placed.block.samples.items():
                values[name][start : start + len(series)] = series
        return DeviceSamples(
            device=self._device, sample_rate_Hz=self._placed[0].block.sample_rate_Hz, values=values,
            block_start=np.array(starts, dtype=np.int64), block_time_ns=time_ns, overload=self.overload(),
            gaps=self.gaps(), first_index=self._placed[0].number,
        )  # fmt: skip


def _number_of(placed: _Placed) -> int:
    return placed.number


def _without_repeats(placed: _Placed, neighbour: _Placed) -> _Placed | None:
    """A block less the samples that its neighbour has already; None if nothing is left.

    Raises
    ------
    ValueError
        If they differ in a sample that both have.
    """
    start, stop = max(placed.number, neighbour.number), min(placed.end, neighbour.end)
    if start >= stop:
        return placed
    if _bytes(_part(placed, start, stop)) != _bytes(_part(neighbour, start, stop)):
        raise ValueError(f"{stop - start} samples from number {start} on are given twice with different values")
    if placed.number < start and stop < placed.end:
        raise ValueError(f"the block overlaps another one of {stop - start} samples at both of its ends")
    if stop < placed.end:
        return _part(placed, stop, placed.end)
    return _part(placed, placed.number, start) if placed.number < start else None


def _part(placed: _Placed, start: int, stop: int) -> _Placed:
    """Samples with the numbers `start` to `stop` (not included)."""
    first, last = start - placed.number, stop - placed.number
    block = replace(
        placed.block,
        time_ns=placed.block.time_ns + round(first * 1e9 / placed.block.sample_rate_Hz),
        first_index=placed.block.first_index + first,
        samples={name: series[first:last] for name, series in placed.block.samples.items()},
    )
    return _Placed(number=start, block=block)


def _bytes(placed: _Placed) -> dict[str, bytes]:
    """Samples for comparison: NaN equals NaN."""
    return {name: series.tobytes() for name, series in placed.block.samples.items()}
