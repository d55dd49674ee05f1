"""What a run is made of: channels, sample blocks, steps, events (the recording contract, version 1)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

STAMP_ROUNDING_ns = 1.5
PIECE = 1 << 18
"""Samples of a slice: enough that numpy's part of the work is the larger one."""
CLOCK_ERROR = 2e-4
"""Farther off than this no sampling clock is; such time stamps jitter, or samples are missing."""


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One measured quantity; `range` is the converter's limit in the channel's unit."""

    name: str
    quantity: str
    unit: str
    position_m: float | None = None
    direction: str = "+y"
    range: float | None = None
    device: str = "daq"


@dataclass(frozen=True, kw_only=True)
class SampleBlock:
    """Equally spaced samples from one device; every series has the same length.

    `first_index` counts samples since the device started: a jump is a loss.
    """

    device: str
    time_ns: int
    first_index: int
    sample_rate_Hz: float
    samples: Mapping[str, NDArray[np.float32]]
    overload: Mapping[str, int] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.samples.values()), ()))

    @property
    def end_ns(self) -> int:
        """Time just after the last sample."""
        return self.time_at(len(self))

    def time_at(self, position: int) -> int:
        """Time of a sample by its position in the block, ns."""
        return self.time_ns + round(position * 1e9 / self.sample_rate_Hz)


class StepState(IntEnum):
    """What the procedure was doing."""

    SETTLING = 0
    MEASURING = 1
    DONE = 2
    ABORTED = 3


@dataclass(frozen=True, kw_only=True)
class Step:
    """The start of a state of one step of a sweep; `frequency_Hz` is 0 for broadband excitation."""

    time_ns: int
    sweep: str
    index: int
    frequency_Hz: float
    target_channel: str
    target_amplitude: float
    state: StepState


@dataclass(frozen=True, kw_only=True)
class Event:
    """A thing that went wrong or changed while recording."""

    time_ns: int
    source: str
    kind: str
    detail: str = ""


@dataclass(frozen=True, kw_only=True)
class Indicator:
    """One decimated value, for viewers that plot scalars."""

    name: str
    time_ns: int
    value: float
    unit: str = ""


@dataclass(frozen=True, kw_only=True)
class Gap:
    """Samples `first_index` .. `first_index + count - 1` of a device that were never received.

    Numbers count from the device's first start, also after a restart in mid-run.
    """

    device: str
    first_index: int
    count: int


class Samples(Protocol):
    """One channel's samples (n,): an array, or what reads a slice of them from the file when it is taken.

    ``numpy.asarray`` gives all of them, however many; a loop over slices does with little memory.
    """

    def __len__(self) -> int:
        """How many there are."""
        ...

    def __getitem__(self, key: slice, /) -> NDArray[Any]:
        """Those of a slice."""
        ...

    def __array__(self) -> NDArray[Any]:
        """All of them."""
        ...

    def __neg__(self) -> Samples:
        """All of them with the other sign."""
        ...


def pieces(samples: Samples, start: int = 0, stop: int | None = None) -> Iterator[NDArray[Any]]:
    """Samples at positions `start` to before `stop`, in slices that take little memory."""
    stop = len(samples) if stop is None else stop
    return (samples[at : min(at + PIECE, stop)] for at in range(start, stop, PIECE))


@dataclass(frozen=True, kw_only=True)
class DeviceSamples:
    """All samples of one device in order of time, in SI units; lost samples are NaN.

    `values[channel][i]` was taken at `time_ns[0] + i / sample_rate_Hz` when nothing was lost; blocks carry their
    own time stamps, so `block_start` (sample numbers: positions in the arrays of `values`) and `block_time_ns` give
    the exact mapping.  A very long loss is filled with fewer NaN than samples were lost; its `Gap` has their number.
    `first_index` is the device's number of the sample at position 0.
    """

    device: str
    sample_rate_Hz: float
    values: Mapping[str, Samples]
    block_start: NDArray[np.int64]
    block_time_ns: NDArray[np.int64]
    overload: Mapping[str, int]
    gaps: tuple[Gap, ...] = ()
    first_index: int = 0

    def __len__(self) -> int:
        return len(next(iter(self.values.values()), ()))

    @property
    def end_ns(self) -> int:
        """Time just after the last sample; the first block's time stamp if there is none."""
        lasting = len(self) - int(self.block_start[-1])
        return int(self.block_time_ns[-1]) + round(lasting * 1e9 / self.sample_rate_Hz)

    def position_at(self, time_ns: int) -> int:
        """Position in `values` of the first sample taken at `time_ns` or later, from the blocks' time stamps.

        Time stamps are rounded to nanoseconds, so a sample up to a hundredth of a sampling interval before counts as
        taken at that time.
        """
        block = int(np.searchsorted(self.block_time_ns, time_ns, side="right")) - 1
        if block < 0:
            return 0
        last = block == len(self.block_start) - 1
        end = len(self) if last else int(self.block_start[block + 1])
        since = (time_ns - int(self.block_time_ns[block])) * 1e-9 * self.sample_rate_Hz
        return min(int(self.block_start[block]) + int(np.ceil(since - 0.01)), end)

    def times_ns(self, start: int = 0, stop: int | None = None) -> NDArray[np.int64]:
        """When the samples at positions `start` to `stop` (not included) were taken, in nanoseconds.

        From one block's time stamp to the next one's: a device that samples by a clock of its own is a little faster
        or slower than the rate it states, and between blocks of a third of a second that is microseconds.
        """
        positions = np.arange(start, len(self) if stop is None else stop)
        block = np.searchsorted(self.block_start, positions, side="right") - 1
        since = (positions - self.block_start[block]) * self._spacing_ns(block)
        return np.asarray(self.block_time_ns[block] + np.rint(since).astype(np.int64))

    def _spacing_ns(self, block: NDArray[np.int64]) -> NDArray[np.float64]:
        """Time between the samples of blocks, from their stamps where those differ from the rate as clocks do."""
        nominal_ns = 1e9 / self.sample_rate_Hz
        if len(self.block_start) < 2:
            return np.full(len(block), nominal_ns)
        before = np.minimum(block, len(self.block_start) - 2)
        steps = self.block_start[before + 1] - self.block_start[before]
        measured_ns = (self.block_time_ns[before + 1] - self.block_time_ns[before]) / steps
        off_ns = np.abs(measured_ns - nominal_ns)
        is_clock = (off_ns * steps > STAMP_ROUNDING_ns) & (off_ns < CLOCK_ERROR * nominal_ns)
        return np.asarray(np.where(is_clock, measured_ns, nominal_ns))


def channel_blocks(
    device: DeviceSamples, start: int = 0, stop: int | None = None
) -> Iterator[tuple[str, NDArray[Any]]]:
    """The :func:`pieces` of every channel of a device, each with its name, the first of all before the second of any.

    A block has the samples of all channels: so it is read once, not once for each channel.
    """
    stop = len(device) if stop is None else stop
    for at in range(start, stop, PIECE):
        for name, samples in device.values.items():
            yield name, samples[at : min(at + PIECE, stop)]


@dataclass(frozen=True, kw_only=True)
class Run:
    """A recorded run; one that was read from MCAP leaves its samples in the file until they are asked for.

    `info` is the ``run`` metadata record (format, source, stored, rig, procedure, started, preload_N, ...);
    `attachments` holds ``rig.toml`` and ``procedure.toml`` where the run has them.
    """

    path: str
    info: Mapping[str, str]
    channels: Mapping[str, Channel]
    devices: Mapping[str, DeviceSamples]
    steps: tuple[Step, ...]
    events: tuple[Event, ...]
    indicators: tuple[Indicator, ...] = ()
    attachments: Mapping[str, bytes] = field(default_factory=dict)

    def device_of(self, channel: str) -> DeviceSamples:
        """The samples of the device that has `channel`.

        Raises
        ------
        KeyError
            If no samples of that channel were recorded.
        """
        for device in self.devices.values():
            if channel in device.values:
                return device
        raise KeyError(f"the run has no samples of channel {channel!r}")

    def between(self, channel: str, start_ns: int, stop_ns: int) -> NDArray[np.float32]:
        """Samples of one channel taken from `start_ns` to before `stop_ns`, lost ones as NaN.

        Channels of different devices have clocks of their own: the first samples of two channels may lie up to one
        sampling interval apart, see `DeviceSamples.times_ns`.
        """
        device = self.device_of(channel)
        return device.values[channel][device.position_at(start_ns) : device.position_at(stop_ns)]
