"""A run as the frames that nodes would have sent, in a BLF file that other programs read with the shipped database.

Each device becomes a node on a bus of its own, or several where it has more channels than a node.
"""

import heapq
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

import can
import numpy as np
from numpy.typing import NDArray

from drivers.can_protocol import (
    CHANNELS_LIMIT,
    FULL_SCALE,
    NO_PULSE,
    PULSE_INTERVAL_NS,
    SAMPLES_PER_FRAME,
    ChannelInfo,
    MessageId,
    Status,
    TimeSync,
    frame_sizes,
)
from recordings.convert.blocks import TIME_STEP_NS, blocks_of
from recordings.errors import InputError
from recordings.run import Channel, DeviceSamples, Run, SampleBlock, pieces

NAME_BYTES = 24


def write_blf(run: Run, path: Path) -> list[str]:
    """Write the samples of a run as frames.

    Returns
    -------
    list of str
        What frames cannot carry: the resolution, and what is not a sample.

    Raises
    ------
    InputError
        If a channel's name does not fit a frame.
    """
    notes: list[str] = []
    buses = []
    numbers = count()
    for device in run.devices.values():
        if device.first_index >> 32:
            notes.append(f"sample numbers of {device.device} are cut to 32 bits")
        channels = [run.channels[name] for name in device.values]
        for start in range(0, len(channels), CHANNELS_LIMIT):
            some = [_with_range(path, each, device, notes) for each in channels[start : start + CHANNELS_LIMIT]]
            buses.append(_Bus(next(numbers), device, some).frames())
    with path.open("xb") as stream, can.BLFWriter(stream) as writer:
        for message in heapq.merge(*buses, key=lambda message: message.timestamp):
            writer.on_message_received(message)
    return [*notes, *_losses(run)]


def _with_range(path: Path, channel: Channel, device: DeviceSamples, notes: list[str]) -> Channel:
    """The channel with the range that scales its 16-bit samples, as a frame can tell it."""
    if len(channel.name.encode()) > NAME_BYTES or not channel.name.isascii() or "\0" in channel.name:
        raise InputError(path, f"channel {channel.name!r:.80}", f"a name of at most {NAME_BYTES} ASCII characters fits")
    values = device.values[channel.name]
    finite, peak = 0, 0.0
    for piece in pieces(values):
        known = np.abs(piece[np.isfinite(piece)])
        finite, peak = finite + len(known), float(np.max(known, initial=peak))
    limit = channel.range or 0.0
    if peak > limit * (1 + 1e-6):
        why = "has no range" if not channel.range else f"goes beyond its range of {limit:g} {channel.unit}"
        notes.append(f"channel {channel.name} {why}: its largest value, {peak:g}, takes its place")
        limit = peak
    single = np.float32(limit or 1.0)
    notes.append(
        f"samples of {channel.name} are rounded to {float(single) / FULL_SCALE:.3g} {channel.unit}, "
        f"16 bits of {float(single):g}"
    )
    left_out = len(values) - finite - sum(gap.count for gap in device.gaps)
    if left_out > 0:
        notes.append(f"{left_out} samples of {channel.name} are no numbers, and are left out")
    return replace(channel, range=float(single))


def _losses(run: Run) -> list[str]:
    counts = {
        "steps": len(run.steps), "events": len(run.events), "indicators": len(run.indicators),
        "attachments": len(run.attachments),
    }  # fmt: skip
    lost = [f"{number} {what} have no place in a log of frames" for what, number in counts.items() if number]
    if run.info["source"] != "measured":
        lost.append(
            f"a log of frames does not say that a run was {run.info['source']}: read back it counts as measured"
        )
    return [*lost, "the names of devices and of the rig have no place in a log of frames"]


@dataclass(frozen=True)
class _Sync:
    number: int
    time_ns: int
    pulse: int


class _Bus:
    """The frames of at most four channels of one device, in order of time."""

    def __init__(self, number: int, device: DeviceSamples, channels: Sequence[Channel]) -> None:
        self._number, self._device, self._channels = number, device, channels
        self._scale = np.array([[FULL_SCALE / float(channel.range or 1.0)] for channel in channels])
        self._overload = [0] * len(channels)
        self._pulses = 0
        self._last: _Sync | None = None
        self._due: list[_Sync] = []

    def frames(self) -> Iterator[can.Message]:
        """All of them; those of samples have the time of their last one."""
        for index, channel in enumerate(self._channels):
            info = ChannelInfo(index, len(self._channels), channel)
            yield self._message(MessageId.CHANNEL_INFO, info.pack(), int(self._device.block_time_ns[0]))
        rest = np.empty((len(self._channels), 0), np.float32)
        number = 0
        for block in blocks_of(self._device):
            if number + rest.shape[1] != block.first_index:
                yield from self._sample_frames(number, rest, frame_sizes(rest.shape[1]))
                rest, number = rest[:, :0], block.first_index
            self._schedule(block)
            yield from self._status(block)
            rows = np.stack([block.samples[channel.name] for channel in self._channels])
            values = np.concatenate((rest, rows), axis=1)
            whole = values.shape[1] // SAMPLES_PER_FRAME
            yield from self._sample_frames(number, values, [SAMPLES_PER_FRAME] * whole)
            rest = values[:, whole * SAMPLES_PER_FRAME :]
            number += whole * SAMPLES_PER_FRAME
        yield from self._sample_frames(number, rest, frame_sizes(rest.shape[1]))

    def _schedule(self, block: SampleBlock) -> None:
        """Time syncs of a block: where its clock does not follow from the last one, and every 100 ms."""
        rate_Hz, last = block.sample_rate_Hz, self._last
        end = block.first_index + len(block)
        if last is not None:
            follows_ns = last.time_ns + round((block.first_index - last.number) * 1e9 / rate_Hz)
        if last is None or abs(block.time_ns - follows_ns) > TIME_STEP_NS:
            last = _Sync(block.first_index, block.time_ns, NO_PULSE)
            self._due.append(last)
        interval = max(1, round(rate_Hz * PULSE_INTERVAL_NS * 1e-9))
        while last.number + interval < end:
            number = max(last.number + interval, block.first_index)
            time_ns = block.time_at(number - block.first_index)
            last = _Sync(number, time_ns, self._pulses)
            self._pulses += 1
            self._due.append(last)
        self._last = last

    def _time_ns(self, number: int, sync: _Sync) -> int:
        return sync.time_ns + round((number - sync.number) * 1e9 / self._device.sample_rate_Hz)

    def _sample_frames(self, number: int, values: NDArray[np.float32], sizes: Sequence[int]) -> Iterator[can.Message]:
        """Frames of the given numbers of samples, each after the time syncs that fall into it."""
        raw = np.rint(np.clip(np.nan_to_num(values * self._scale), -FULL_SCALE, FULL_SCALE)).astype("<i2")
        finite = np.isfinite(values)
        all_finite = bool(finite.all())
        start = 0
        for size in sizes:
            stop = start + size
            while self._due and self._due[0].number < number + stop:
                self._current = self._due.pop(0)
                sync = TimeSync(
                    self._current.number, self._current.time_ns, self._current.pulse, self._device.sample_rate_Hz
                )
                yield self._message(MessageId.TIME_SYNC, sync.pack(), self._current.time_ns)
            time_ns = self._time_ns(number + stop - 1, self._current)
            for k in range(len(raw)):
                for a, b in [(start, stop)] if all_finite else _stretches(finite[k], start, stop):
                    counter = struct.pack("<I", (number + a) & 0xFFFFFFFF)
                    yield self._message(MessageId.SAMPLES + k, counter + raw[k, a:b].tobytes(), time_ns)
            start = stop

    def _status(self, block: SampleBlock) -> Iterator[can.Message]:
        """Counts of samples on the converter's limit, where a block adds to them."""
        new = [block.overload.get(channel.name, 0) for channel in self._channels]
        if any(new):
            self._overload = [before + more for before, more in zip(self._overload, new, strict=True)]
            yield self._message(MessageId.STATUS, Status(0, tuple(self._overload)).pack(), block.time_ns)

    def _message(self, identifier: int, data: bytes, time_ns: int) -> can.Message:
        return can.Message(
            arbitration_id=identifier, data=data, is_extended_id=False, is_fd=True, bitrate_switch=True,
            timestamp=time_ns * 1e-9, channel=self._number,
        )  # fmt: skip


def _stretches(finite: NDArray[np.bool_], start: int, stop: int) -> list[tuple[int, int]]:
    """Unbroken runs of numbers, in lengths that a frame can have."""
    found = []
    at = start
    for stretch in np.split(finite[start:stop], 1 + np.flatnonzero(np.diff(finite[start:stop]))):
        if stretch[0]:
            position = at
            for size in frame_sizes(len(stretch)):
                found.append((position, position + size))
                position += size
        at += len(stretch)
    return found
