"""A BLF file of the node's frames to a run: what a bus logger recorded while a node streamed.

Sample frames are taken apart with the layouts of :mod:`drivers.can_protocol`, which a test holds equal to the shipped
database: cantools, its oracle, is an order of magnitude slower.
"""

import io
import struct
from collections import Counter
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

import can
import numpy as np
from can.io.blf import BLFParseError
from numpy.typing import NDArray

from drivers.blf.containers import sound_length
from drivers.can_protocol import (
    CHANNELS_LIMIT,
    FULL_SCALE,
    SAMPLE_FRAME,
    ChannelInfo,
    MessageId,
    Status,
    TimeSync,
)
from recordings.container.assemble import Assembler
from recordings.convert.blocks import add_rows
from recordings.errors import InputError, blamed_on
from recordings.limits import Limits
from recordings.reader import open_input
from recordings.run import Channel, DeviceSamples, Event, Run

SIZE_LIMIT_BYTES = 2 << 30
SYNCS_LIMIT, STREAMS_LIMIT, BUSES_LIMIT = 1 << 20, 4096, 64
_CONTROL = {MessageId.HEARTBEAT, MessageId.COMMAND, MessageId.REPLY}


def read_blf(path: Path) -> Run:
    """Read the samples that nodes sent; each bus becomes a device.

    What is not understood is counted in events of the kind ``not-converted``.

    Raises
    ------
    InputError
        If it is no BLF file, damaged or too large, or lacks the frames that say what was measured and when.
    """
    with open_input(path) as stream:
        data = stream.read(SIZE_LIMIT_BYTES + 1)
    if len(data) > SIZE_LIMIT_BYTES:
        raise InputError(path, "", f"larger than {SIZE_LIMIT_BYTES} bytes, the limit for BLF files")
    sound = sound_length(path, data)
    log = _Log(path)
    if sound < len(data):
        log.left_out[f"of {len(data)} bytes at the end, where the file was cut short"] = len(data) - sound
    try:
        for message in can.BLFReader(io.BytesIO(data[:sound])):
            log.take(message)
    except (BLFParseError, struct.error, ValueError, OverflowError, ArithmeticError) as error:
        raise InputError(path, f"frame {log.count + 1}", f"cannot be read as BLF ({str(error)[:80]})") from error
    return log.run()


@dataclass
class _Stream:
    """What a node sent between a start and a stop: samples by channel, and when some of them were taken."""

    syncs: list[tuple[int, int]] = field(default_factory=list)
    rate_Hz: float = 0.0
    whole: list[bytearray] = field(default_factory=lambda: [bytearray() for _ in range(CHANNELS_LIMIT)])
    short: list[list[bytes]] = field(default_factory=lambda: [[] for _ in range(CHANNELS_LIMIT)])
    overload: tuple[int, ...] = ()


class _Node:
    """One bus: the channels of its node, and its streams."""

    def __init__(self) -> None:
        self.infos: dict[int, ChannelInfo] = {}
        self.streams = [_Stream()]

    def sync(self, sync: TimeSync) -> None:
        """A time stamp; a counter that falls is a new stream.  Raises ValueError if it makes no sense."""
        if not 1e-3 <= sync.sample_rate_Hz <= 1e9 or not 0 <= sync.time_ns < 1 << 62:
            raise ValueError("a time sync out of range")
        stream, number = self.streams[-1], sync.counter
        if stream.syncs:
            last, last_ns = stream.syncs[-1]
            number = _near(sync.counter, last)
            again = number < last or (number == last and sync.time_ns != last_ns)
            if again or sync.sample_rate_Hz != stream.rate_Hz:
                stream, number = _Stream(), sync.counter
                self.streams.append(stream)
        stream.rate_Hz = sync.sample_rate_Hz
        stream.syncs.append((number, sync.time_ns))


class _Log:
    """Sorts the frames of a file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._nodes: dict[int, _Node] = {}
        self.left_out: Counter[str] = Counter()
        self.count = 0
        self._syncs = 0

    def take(self, message: can.Message) -> None:
        """The next frame.

        Raises
        ------
        InputError
            If there is more of it than the limits allow, or it contradicts another one.
        """
        self.count += 1
        identifier = message.arbitration_id
        if message.is_error_frame:
            self.left_out["error frames"] += 1
            return
        channel = identifier - MessageId.SAMPLES
        is_sample = 0 <= channel < CHANNELS_LIMIT
        known = is_sample or identifier in (MessageId.TIME_SYNC, MessageId.STATUS, MessageId.CHANNEL_INFO)
        if message.is_extended_id or message.is_remote_frame or not known:
            if message.is_extended_id or identifier not in _CONTROL:
                self.left_out["frames that are not in the node's database"] += 1
            return
        bus = message.channel if isinstance(message.channel, int) else 0
        node = self._nodes.setdefault(bus, _Node())
        data = bytes(message.data)
        try:
            if is_sample:
                self._take_samples(node.streams[-1], channel, data)
            elif identifier == MessageId.TIME_SYNC:
                node.sync(TimeSync.unpack(data))
                self._syncs += 1
            elif identifier == MessageId.STATUS:
                node.streams[-1].overload = Status.unpack(data).overload
            else:
                self._describe(bus, node, ChannelInfo.unpack(data))
        except (struct.error, ValueError):
            self.left_out["frames that break the node's layout"] += 1
        if len(self._nodes) > BUSES_LIMIT or self._syncs > SYNCS_LIMIT or len(node.streams) > STREAMS_LIMIT:
            raise InputError(self._path, f"frame {self.count}", "more buses, streams or time syncs than a log may have")

    def _take_samples(self, stream: _Stream, channel: int, data: bytes) -> None:
        if len(data) == SAMPLE_FRAME.itemsize:
            stream.whole[channel] += data
        elif len(data) > 4 and len(data) % 2 == 0:
            stream.short[channel].append(data)
        else:
            raise ValueError("no samples")

    def _describe(self, bus: int, node: _Node, info: ChannelInfo) -> None:
        before = node.infos.setdefault(info.index, info)
        if before != info:
            place = f"frame {self.count}"
            raise InputError(self._path, place, f"bus {bus + 1}: channel {info.index} is described in two ways")

    def run(self) -> Run:
        """The run of all buses.

        Raises
        ------
        InputError
            If there are no samples, or nothing says what and when they were.
        """
        channels: dict[str, Channel] = {}
        devices: dict[str, DeviceSamples] = {}
        limits = Limits()
        for bus, node in sorted(self._nodes.items()):
            name = f"can{bus + 1}"
            found = self._channels(name, node)
            for channel in found.values():
                if channel.name in channels:
                    raise InputError(self._path, f"bus {bus + 1}", f"a second channel {channel.name!r:.40}")
                channels[channel.name] = channel
            with blamed_on(self._path, f"bus {bus + 1}"):
                device = _assemble(name, node, found, limits)
            if device is not None:
                devices[name] = device
        if not devices:
            raise InputError(self._path, "", "holds no samples of the node", "was it logged while the node streamed?")
        start_ns = min(int(device.block_time_ns[0]) for device in devices.values())
        started = datetime.fromtimestamp(start_ns // 1_000_000_000, UTC).isoformat().replace("+00:00", "Z")
        info = {
            "format": "1", "source": "measured", "stored": "all", "rig": "",
            "procedure": f"log of frames {self._path.name}", "started": started,
        }  # fmt: skip
        events = tuple(
            Event(time_ns=start_ns, source="convert", kind="not-converted", detail=f"{number} {what}: left out")
            for what, number in self.left_out.items()
        )
        return Run(path=str(self._path), info=info, channels=channels, devices=devices, steps=(), events=events)

    def _channels(self, device: str, node: _Node) -> dict[int, Channel]:
        """The channels that have samples, as the node describes them."""
        found = {}
        for k in range(CHANNELS_LIMIT):
            if not any(stream.whole[k] or stream.short[k] for stream in node.streams):
                continue
            if k not in node.infos:
                raise InputError(
                    self._path, f"{device}, channel {k}", "no frame says what it measures and in which range",
                    "ask the node with DESCRIBE while logging",
                )  # fmt: skip
            found[k] = replace(node.infos[k].channel, device=device)
        return found


def _near(counter: int, number: int) -> int:
    """The full number of a sample of which the lowest 32 bits are known: the one nearest to `number`."""
    return number + ((counter - number + 0x80000000) & 0xFFFFFFFF) - 0x80000000


def _assemble(name: str, node: _Node, channels: dict[int, Channel], limits: Limits) -> DeviceSamples | None:
    """All streams of a node put together; raises ValueError with the reason if they contradict each other."""
    assembler = Assembler(name, limits)
    for stream in node.streams:
        parts = {k: _samples(stream, k) for k in channels}
        numbers = np.unique(np.concatenate([each for each, _ in parts.values()])) if parts else np.empty(0, np.int64)
        if not len(numbers):
            continue
        if not stream.syncs:
            raise ValueError("no time sync says when its samples were taken")
        if len(numbers) * len(parts) > limits.values:
            raise ValueError(f"more than {limits.values} samples, the limit")
        values = {}
        for k, (its, raw) in parts.items():
            row = np.full(len(numbers), np.nan, np.float32)
            at = np.searchsorted(numbers, its)
            scaled = raw.astype(np.float32) * np.float32(float(channels[k].range or 1.0) / FULL_SCALE)
            row[at] = scaled
            if np.any(row[at] != scaled):
                raise ValueError(f"channel {channels[k].name!r:.40} has two values for one sample")
            values[channels[k].name] = row
        overload = {c.name: stream.overload[k] if stream.overload else 0 for k, c in channels.items()}
        add_rows(assembler, name, stream.rate_Hz, numbers, _times(stream, numbers), values, overload)
    return assembler.finish()


def _samples(stream: _Stream, channel: int) -> tuple[NDArray[np.int64], NDArray[np.int16]]:
    """Numbers and raw values of one channel, as they came."""
    table = np.frombuffer(bytes(stream.whole[channel]), SAMPLE_FRAME)
    counters = [(table["counter"].astype(np.int64)[:, None] + np.arange(table["samples"].shape[1])).ravel()]
    raw = [table["samples"].ravel()]
    for frame in stream.short[channel]:
        raw.append(np.frombuffer(frame, "<i2", offset=4))
        counters.append(int.from_bytes(frame[:4], "little") + np.arange(len(raw[-1]), dtype=np.int64))
    counter, near = np.concatenate(counters), stream.syncs[0][0] if stream.syncs else 0
    number = near + ((counter - near + 0x80000000) & 0xFFFFFFFF) - 0x80000000
    return number, np.concatenate(raw)


def _times(stream: _Stream, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """When the samples were taken, counted from the time sync before each, or the first one."""
    at, time_ns = (np.array(column, np.int64) for column in zip(*stream.syncs, strict=True))
    sync = np.maximum(np.searchsorted(at, numbers, side="right") - 1, 0)
    since = (numbers - at[sync]) * (1e9 / stream.rate_Hz)
    if np.abs(since).max() >= 1 << 61:
        raise ValueError("samples centuries away from a time sync")
    return np.asarray(time_ns[sync] + np.rint(since).astype(np.int64))
