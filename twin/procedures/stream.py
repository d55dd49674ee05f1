"""Samples of all devices as windows of device time, with guards on every sample that passes."""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from recordings.run import Event, SampleBlock
from recordings.streams import Acquisition
from twin.arrays import Array
from twin.procedures.limits import LIMITS
from twin.procedures.recorder import Recorder, sample_at


class GuardTrip(Exception):  # noqa: N818  (not an error of the program: the guard did its work)
    """A sample passed a limit of the procedure."""

    def __init__(self, channel: str, value: float, limit: float, time_ns: int) -> None:
        self.channel, self.value, self.limit, self.time_ns = channel, value, limit, time_ns
        super().__init__(f"{channel} reached {value:.4g}, its limit is {limit:.4g}")


@dataclass(frozen=True, kw_only=True)
class Series:
    """Samples of one channel in a window; `offset_s` is the first sample's time after the window's start."""

    samples: Array
    sample_rate_Hz: float
    offset_s: float


class Stream:
    """Reads an acquisition, hands every block to the recorder and keeps the latest for windows.

    Parameters
    ----------
    acquisition
        Started.
    recorder
        Gets every block and event.
    limits
        Largest allowed magnitude per channel.
    primary
        The channel whose device's samples define the time grid.
    """

    def __init__(
        self, acquisition: Acquisition, recorder: Recorder, *, limits: Mapping[str, float], primary: str
    ) -> None:
        self._acquisition, self._recorder, self._limits = acquisition, recorder, dict(limits)
        self._device_of = {channel.name: channel.device for channel in acquisition.channels}
        self.primary, self._primary = primary, self._device_of[primary]
        self._blocks: dict[str, deque[SampleBlock]] = {device: deque() for device in self._device_of.values()}
        self._end_ns: dict[str, int] = dict.fromkeys(self._blocks, 0)
        self._noted: set[tuple[str, str]] = set()
        self.events: list[Event] = []
        """All events of the run."""

    @property
    def latest_ns(self) -> int:
        """The end of the newest sample of any device."""
        return max(self._end_ns.values())

    @property
    def block_s(self) -> float:
        """Length of the primary device's latest block, s: what is done at its end is timed in such pieces."""
        blocks = self._blocks[self._primary]
        return len(blocks[-1]) / blocks[-1].sample_rate_Hz if blocks else 0.1

    @property
    def buffered(self) -> Sequence[SampleBlock]:
        """The blocks kept."""
        return [block for blocks in self._blocks.values() for block in blocks]

    def begin_step(self) -> None:
        """Each step may report each overload once."""
        self._noted.clear()

    def note(self, event: Event) -> None:
        """Record an event of the procedure's own."""
        self.events.append(event)
        self._recorder.event(event)

    def drop_before(self, time_ns: int) -> None:
        """Forget samples that no window will ask for."""
        for blocks in self._blocks.values():
            while blocks and blocks[0].end_ns <= time_ns:
                blocks.popleft()

    def align(self, time_ns: int) -> int:
        """The time of the primary device's first sample at or after a time."""
        blocks = self._blocks[self._primary]
        if not blocks:
            return time_ns
        return blocks[-1].time_at(sample_at(blocks[-1], time_ns))

    def wait(self, until_ns: int) -> None:
        """Read until every device has passed a time.

        TimeoutError if nothing comes, or one device stays behind the others; GuardTrip if a sample passes its limit.
        """
        while min(self._end_ns.values()) < until_ns:
            for block in self._acquisition.read():
                self._take(block)
            for event in self._acquisition.take_events():
                self._noted.add((event.kind, event.source))
                self.note(event)
            behind = [d for d, end in self._end_ns.items() if self.latest_ns - end > LIMITS.silent_device_s * 1e9]
            if behind and self.latest_ns >= until_ns:
                raise TimeoutError(f"device {behind[0]!r} gave no samples for {LIMITS.silent_device_s:g} s")

    def window(self, start_ns: int, duration_s: float) -> dict[str, Series]:
        """All channels from `start_ns` on for `duration_s`; waits for them.  Lost samples are NaN."""
        self.wait(start_ns + round(duration_s * 1e9))
        found = {}
        for device, blocks in self._blocks.items():
            names = [name for name, its in self._device_of.items() if its == device]
            found.update(_gather(blocks, names, start_ns, duration_s))
        return found

    def _take(self, block: SampleBlock) -> None:
        if block.device not in self._blocks or len(block) == 0:
            return
        self._blocks[block.device].append(block)
        self._end_ns[block.device] = block.end_ns
        self._recorder.block(block)
        for name, count in block.overload.items():
            if count and ("overload", name) not in self._noted:
                self._noted.add(("overload", name))
                detail = f"{count} of {len(block)} samples on the converter's limit"
                self.note(Event(time_ns=block.time_ns, source=name, kind="overload", detail=detail))
        for name, limit in self._limits.items():
            values = block.samples.get(name)
            if values is None:
                continue
            # not numpy's nanmax: it warns of blocks that were lost whole
            magnitude = np.abs(values)
            beyond = np.flatnonzero(magnitude > limit)
            if len(beyond):
                raise GuardTrip(name, float(magnitude[beyond].max()), limit, block.time_at(int(beyond[0])))


def _gather(blocks: Sequence[SampleBlock], names: Sequence[str], start_ns: int, duration_s: float) -> dict[str, Series]:
    """The samples of one device in a window, placed by their indices."""
    end_ns = start_ns + round(duration_s * 1e9)
    parts = [block for block in blocks if block.end_ns > start_ns and block.time_ns < end_ns]
    if not parts:
        return {}
    rate = parts[0].sample_rate_Hz
    origin = parts[0].first_index + sample_at(parts[0], start_ns)
    offset_s = (parts[0].time_ns - start_ns) * 1e-9 + sample_at(parts[0], start_ns) / rate
    count = round(duration_s * rate)
    values = {name: np.full(count, np.nan, dtype=np.float32) for name in names}
    for block in parts:
        at = block.first_index - origin
        first, last = max(0, -at), min(len(block), count - at)
        if last > first:
            for name in names:
                if name in block.samples:
                    values[name][at + first : at + last] = block.samples[name][first:last]
    series = Series(samples=np.empty(0, dtype=np.float32), sample_rate_Hz=rate, offset_s=offset_s)
    return {name: replace(series, samples=samples) for name, samples in values.items()}
