"""Blocks of one device put together: order, duplicates, losses and restarts made explicit."""

from array import array
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from recordings.container.stored import Blocks, Loader, Series, StoredSamples
from recordings.limits import Limits
from recordings.run import DeviceSamples, Event, Gap, SampleBlock

RATE_TOLERANCE = 1e-6
STAMP_JITTER_s = 0.1
"""How far the time stamp of a block may stray at all; from a quarter of a block on, it is told."""
LATE_LIMIT = 10_000
CLOCK_TOLERANCE = 1e-3
"""How far a device's clock may stray from its stated rate between two blocks (relative)."""


class _Placed(NamedTuple):
    """A block without its samples: the number of its first one, counted from the device's first start, and where it is.

    `begin` tells how many of the block as it was found come before; `kind` numbers the channels that it has.
    """

    number: int
    length: int
    time_ns: int
    chunk: int
    position: int
    begin: int
    kind: int

    @property
    def end(self) -> int:
        return self.number + self.length


class _Rows:
    """Blocks in order of numbers, none overlapping; an hour has a hundred thousand, so they are kept as columns."""

    def __init__(self) -> None:
        self.numbers: list[int] = []  # of 64 bits without sign, which no array of numpy could subtract
        self._columns = {name: array("q") for name in _Placed._fields[1:]}

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, at: int) -> _Placed:
        return _Placed(self.numbers[at], *(column[at] for column in self._columns.values()))

    def insert(self, at: int, placed: _Placed) -> None:
        self.numbers.insert(at, placed.number)
        for column, value in zip(self._columns.values(), placed[1:], strict=True):
            column.insert(at, value)

    def column(self, name: str) -> NDArray[np.int64]:
        return np.array(self._columns[name], dtype=np.int64)


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
        `values` bounds how many there may be, `gap_fill` how much of a loss is filled with NaN.
    load
        Gives the samples of a block of a file again.  Without it all blocks are held, and arrays made of them.
    """

    def __init__(self, device: str, limits: Limits, load: Loader | None = None) -> None:
        self._device, self._limits = device, limits
        self._held: list[Series] | None = None if load else []
        self._load: Loader = load or self._of_held
        self._placed = _Rows()
        self._rate_Hz = 0.0
        self._kinds: dict[tuple[str, ...], int] = {}
        self._offset = 0  # of numbers since the latest restart
        self._late = self._repeated = 0
        self._overload: Counter[str] = Counter()
        self._channels: dict[str, None] = {}
        self._restarts_and_times: list[Event] = []

    def add(self, block: SampleBlock, *, at: tuple[int, int] = (0, 0)) -> int:
        """Take the next block.

        Parameters
        ----------
        at
            Chunk and position, by which it is loaded again.

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
        number, rows = block.first_index, self._placed
        if len(rows):
            if abs(block.sample_rate_Hz - self._rate_Hz) > RATE_TOLERANCE * self._rate_Hz:
                raise ValueError(f"the sample rate changes from {self._rate_Hz} to {block.sample_rate_Hz} Hz")
            number = self._number(block, rows[-1])
        if self._held is not None:
            at = len(self._held), 0
        kind = self._kinds.setdefault(tuple(block.samples), len(self._kinds))
        placed: _Placed | None = _Placed(number, len(block), block.time_ns, *at, 0, kind)
        neighbour = max(0, bisect_right(rows.numbers, number) - 1)
        while placed and neighbour < len(rows) and rows.numbers[neighbour] < placed.end:
            placed = self._without_repeats(placed, block, rows[neighbour])
            neighbour += 1
        self._repeated += len(block) - (placed.length if placed else 0)
        if not placed:
            return 0
        row = bisect_right(rows.numbers, placed.number)
        self._late += row < len(rows)
        if self._late > LATE_LIMIT:
            raise ValueError(f"more than {LATE_LIMIT} blocks out of order, the limit of this program")
        if self._held is not None:
            self._held.append(block.samples)
        self._rate_Hz = self._rate_Hz or block.sample_rate_Hz
        rows.insert(row, placed)
        self._overload.update(block.overload)
        self._channels.update(dict.fromkeys(block.samples))
        return placed.length * len(block.samples)

    def _of_held(self, chunk: int, position: int, /) -> Series:
        assert self._held is not None
        return self._held[chunk]

    def _without_repeats(self, placed: _Placed, block: SampleBlock, neighbour: _Placed) -> _Placed | None:
        """A block less the samples that its neighbour has already; None if nothing is left.

        Raises
        ------
        ValueError
            If they differ in a sample that both have.
        """
        start, stop = max(placed.number, neighbour.number), min(placed.end, neighbour.end)
        if start >= stop:
            return placed
        other = self._load(neighbour.chunk, neighbour.position)
        if _bytes(block.samples, placed, start, stop) != _bytes(other, neighbour, start, stop):
            raise ValueError(f"{stop - start} samples from number {start} on are given twice with different values")
        if placed.number < start and stop < placed.end:
            raise ValueError(f"the block overlaps another one of {stop - start} samples at both of its ends")
        if stop < placed.end:
            return _part(placed, stop, placed.end, block.sample_rate_Hz)
        return _part(placed, placed.number, start, block.sample_rate_Hz) if placed.number < start else None

    def _number(self, block: SampleBlock, last: _Placed) -> int:
        """The sample number of a block after the first; checks its time against the furthest block so far."""
        number, rate_Hz = block.first_index + self._offset, self._rate_Hz
        length_s = last.length / rate_Hz
        passed_s = (block.time_ns - last.time_ns) * 1e-9
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
        time_ns = self._placed[0].time_ns if self._placed else 0
        for kind, count, detail in (
            ("order", self._late, "blocks stood out of order in the file and were put in order"),
            ("duplicate", self._repeated, "samples stood twice in the file and were taken once"),
        ):
            if count:
                found.append(Event(time_ns=time_ns, source=self._device, kind=kind, detail=f"{count} {detail}"))
        blocks = self._per_kind(np.ones(len(self._placed)))
        for name in self._channels:
            if without := sum(blocks[kind] for names, kind in self._kinds.items() if name not in names):
                detail = f"{without} blocks of device {self._device!r} do not have this channel"
                found.append(Event(time_ns=time_ns, source=name, kind="lost-samples", detail=detail))
        return found

    def counts(self) -> dict[str, int]:
        """Samples received of each channel."""
        received: Counter[str] = Counter()
        samples = self._per_kind(self._placed.column("length"))
        for names, kind in self._kinds.items():
            received.update(dict.fromkeys(names if samples[kind] else (), samples[kind]))
        return dict(received)

    def _per_kind(self, weights: NDArray[np.float64] | NDArray[np.int64]) -> list[int]:
        """Sum of the blocks' weights (b,) over those that have the same channels."""
        kinds = self._placed.column("kind")
        return [round(each) for each in np.bincount(kinds, weights, minlength=len(self._kinds)).tolist()]

    def overload(self) -> dict[str, int]:
        """Samples on the converter's limit, of each channel."""
        return {name: self._overload[name] for name in self._channels}

    def gaps(self) -> tuple[Gap, ...]:
        """Stretches of samples that were never received."""
        return tuple(
            Gap(device=self._device, first_index=end, count=after - end) for end, after in self._joints() if after > end
        )

    def _joints(self) -> Iterator[tuple[int, int]]:
        """The number after each block but the last, and that of the block which follows."""
        numbers, counts = self._placed.numbers, self._placed.column("length").tolist()
        return ((a + count, b) for (a, b), count in zip(pairwise(numbers), counts, strict=False))

    def span_ns(self) -> tuple[int, int] | None:
        """Time of the first sample and just after the last one; None if there are none."""
        if not self._placed:
            return None
        last = self._placed[-1]
        return self._placed[0].time_ns, last.time_ns + round(last.length * 1e9 / self._rate_Hz)

    def layout(self) -> tuple[NDArray[np.int64], int, NDArray[np.int64]]:
        """Where blocks go: the position each begins at, the number of positions, and the blocks' times.

        Raises
        ------
        ValueError
            With the reason, if samples and lost ones exceed the limit, or the times contradict the numbers.
        """
        time_ns = self._placed.column("time_ns")
        if np.any(np.diff(time_ns) <= 0):
            raise ValueError("the time stamps do not rise with the sample numbers")
        counts = self._placed.column("length")
        lost = [after - end for end, after in self._joints()]
        filled = np.array([0, *(min(each, self._limits.gap_fill) for each in lost)][: len(counts)], dtype=np.int64)
        starts = np.cumsum(filled + counts) - counts
        total = int(starts[-1] + counts[-1]) if len(starts) else 0
        if total * len(self._channels) > self._limits.values:
            raise ValueError(f"more than {self._limits.values} samples with the lost ones, the limit of this program")
        return starts, total, time_ns

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
        columns = {name: self._placed.column(name) for name in ("length", "chunk", "position", "begin")}
        blocks = Blocks(start=starts, total=total, load=self._load, **columns)
        stored = {name: StoredSamples(name, blocks) for name in self._channels}
        return DeviceSamples(
            device=self._device, sample_rate_Hz=self._rate_Hz,
            values=stored if self._held is None else {name: np.asarray(samples) for name, samples in stored.items()},
            block_start=starts, block_time_ns=time_ns, overload=self.overload(), gaps=self.gaps(),
            first_index=self._placed.numbers[0],
        )  # fmt: skip


def _part(placed: _Placed, start: int, stop: int, rate_Hz: float) -> _Placed:
    """Of a block, the samples with the numbers `start` to `stop` (not included)."""
    first = start - placed.number
    time_ns = placed.time_ns + round(first * 1e9 / rate_Hz)
    return placed._replace(number=start, length=stop - start, time_ns=time_ns, begin=placed.begin + first)


def _bytes(series: Series, placed: _Placed, start: int, stop: int) -> dict[str, bytes]:
    """Samples with the numbers `start` to `stop` for comparison: NaN equals NaN."""
    first = placed.begin - placed.number
    return {name: values[first + start : first + stop].tobytes() for name, values in series.items()}
