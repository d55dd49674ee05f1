"""What of a run goes to the file: everything, or the measured stretches alone, time running on without the waits."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal, Protocol

from recordings.run import Event, Indicator, SampleBlock, Step


class RunSink(Protocol):
    """Where a run is written to: :class:`recordings.RunWriter`, or a list in a test."""

    def write_block(self, block: SampleBlock) -> None:
        """Record a block of samples."""

    def write_step(self, step: Step) -> None:
        """Record the start of a state of a step."""

    def write_event(self, event: Event) -> None:
        """Record an event."""

    def write_indicator(self, indicator: Indicator) -> None:
        """Record one value for viewers."""


@dataclass
class _Stretch:
    """A stretch of device time being stored."""

    start_ns: int
    end_ns: int
    origin: dict[str, int]
    """Per device, the device's own index of the first sample of the stretch."""


def sample_at(block: SampleBlock, time_ns: int) -> int:
    """Index, counted from the block's first sample, of the first sample at or after a time; may lie outside the block.

    A thousandth of a sample early still counts as on time: time stamps are rounded to nanoseconds.
    """
    return math.ceil((time_ns - block.time_ns) * block.sample_rate_Hz * 1e-9 - 1e-3)


def cut(block: SampleBlock, start_ns: int, end_ns: int, ranges: dict[str, float]) -> SampleBlock | None:
    """The part of a block in start_ns <= t < end_ns, with overloads counted again; None if that is nothing."""
    first, last = max(0, sample_at(block, start_ns)), min(len(block), sample_at(block, end_ns))
    if first >= last:
        return None
    if first == 0 and last == len(block):
        return block
    samples = {name: values[first:last] for name, values in block.samples.items()}
    overload = {}
    for name, count in block.overload.items():
        limit = ranges.get(name, math.inf) * (1 - 1e-6)
        overload[name] = min(count, int((abs(samples[name]) >= limit).sum())) if count else 0
    return replace(
        block,
        time_ns=block.time_at(first),
        first_index=block.first_index + first,
        samples=samples,
        overload=overload,
    )


class Recorder:
    """Writes a run as it happens.

    With ``settled``, blocks between :meth:`open` and its end are stored, renumbered so that indices and times run on
    from one measured stretch to the next; a loss within a stretch stays a jump.  No two steps get one time stamp: where
    the second begins with the first, it is a nanosecond later.
    """

    def __init__(self, sink: RunSink, store: Literal["all", "settled"], ranges: dict[str, float]) -> None:
        self._sink, self._store, self._ranges = sink, store, ranges
        self._stretch: _Stretch | None = None
        self._cursor_ns: int | None = None
        self._next_index: dict[str, int] = {}
        self._last_step_ns = -1

    def open(self, start_ns: int, end_ns: int, buffered: Iterable[SampleBlock]) -> None:
        """Store what was taken in start_ns <= t < end_ns: what is already `buffered` of it, and what will come."""
        if self._store == "all":
            return
        if self._cursor_ns is None:
            self._cursor_ns = start_ns
        self._stretch = _Stretch(start_ns, end_ns, {})
        for block in buffered:
            self.block(block)

    def close(self, end_ns: int | None = None) -> None:
        """End the stretch at its own end, or earlier at `end_ns` if the run broke off."""
        if self._stretch is None:
            return
        assert self._cursor_ns is not None
        end_ns = self._stretch.end_ns if end_ns is None else min(end_ns, self._stretch.end_ns)
        self._cursor_ns += max(0, end_ns - self._stretch.start_ns)
        self._stretch = None

    def block(self, block: SampleBlock) -> None:
        """Take a block as it arrives."""
        if self._store == "all":
            self._sink.write_block(block)
            return
        if self._stretch is None:
            return
        stretch = self._stretch
        part = cut(block, stretch.start_ns, stretch.end_ns, self._ranges)
        if part is None:
            return
        assert self._cursor_ns is not None
        device = block.device
        if device not in stretch.origin:
            # the written index of this stretch's first sample follows the last one written, whatever was left out
            begin = block.first_index + sample_at(block, stretch.start_ns)
            stretch.origin[device] = begin - self._next_index.get(device, 0)
        index = part.first_index - stretch.origin[device]
        self._next_index[device] = index + len(part)
        time_ns = part.time_ns - stretch.start_ns + self._cursor_ns
        self._sink.write_block(replace(part, first_index=index, time_ns=time_ns))

    def step(self, step: Step) -> None:
        """Write a step; its device time becomes the file's time."""
        self._last_step_ns = max(self._file_time(step.time_ns), self._last_step_ns + 1)
        self._sink.write_step(replace(step, time_ns=self._last_step_ns))

    def event(self, event: Event) -> None:
        """Write an event; its device time becomes the file's time."""
        self._sink.write_event(replace(event, time_ns=self._file_time(event.time_ns)))

    def indicator(self, indicator: Indicator) -> None:
        """Write an indicator; its device time becomes the file's time."""
        self._sink.write_indicator(replace(indicator, time_ns=self._file_time(indicator.time_ns)))

    def _file_time(self, time_ns: int) -> int:
        if self._store == "all":
            return time_ns
        if self._cursor_ns is None:
            self._cursor_ns = time_ns
        if self._stretch is None:
            return self._cursor_ns
        return (
            self._cursor_ns + min(max(time_ns, self._stretch.start_ns), self._stretch.end_ns) - self._stretch.start_ns
        )
