"""How the node's messages look on the bus: whole in frames of CAN FD, in pieces of 8 bytes on classic CAN.

Classic frames have the identifiers of their FD counterparts plus 8.  They carry the same messages; what does not fit
is cut: a time sync comes in two frames that a check ties together, a channel's description on seven pages, the status
channel by channel.  Samples come three in a frame, behind a uint16 count, and decimated as far as the bus needs it.

A second node on the same bus has all its identifiers 16 higher.
"""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.can_protocol import (
    CHANNELS_LIMIT,
    NO_PULSE,
    SAMPLE_FRAME,
    SAMPLES_PER_FRAME,
    CanCommand,
    ChannelInfo,
    Heartbeat,
    MessageId,
    Reply,
    Status,
    TimeSync,
    frame_sizes,
)

Message = TimeSync | Heartbeat | Status | ChannelInfo | Reply | CanCommand
Frame = tuple[int, bytes]
"""Identifier and payload."""

CLASSIC = 8
"""From an FD identifier to its classic counterpart."""
NODE_STRIDE = 16
"""From a node's identifiers to the next one's."""
_SYNC_TIME = MessageId.TIME_SYNC + CLASSIC + 1
_PULSES = 0xFFFF
"""Pulse numbers of classic frames are modulo this, which itself stands for none."""
_PAGE_BYTES, _PAGES = 7, 7


class Dialect(Protocol):
    """Messages to frames and back; one instance a stream, as what comes in pieces is put together here."""

    is_fd: ClassVar[bool]
    samples_per_frame: ClassVar[int]
    counters: ClassVar[int]
    """How many different counts a sample frame can have."""

    def encode(self, message: Message) -> list[Frame]:
        """Frames of a message, to be sent in this order."""
        ...

    def decode(self, identifier: int, data: bytes) -> Message | None:
        """The message that a frame completes, if any; raises struct.error or ValueError if it makes no sense."""
        ...

    def encode_samples(self, channel: int, first: int, samples: NDArray[np.int16]) -> Frame:
        """At most `samples_per_frame` samples of a channel, from number `first` on."""
        ...

    def channel_of(self, identifier: int) -> int | None:
        """The channel whose samples a frame carries; None if it is another one."""
        ...

    def decode_samples(self, frames: Sequence[bytes]) -> Iterator[tuple[int, NDArray[np.int16]]]:
        """Counts and samples; frames that follow each other may come in one piece."""
        ...

    def frame_sizes(self, count: int) -> list[int]:
        """Samples in each of the frames that carry `count` of them."""
        ...


def make_dialect(frames: str, node: int = 0) -> Dialect:
    """The dialect of ``fd`` or ``classic`` frames, as a node of the bus speaks it."""
    return FdDialect(node) if frames == "fd" else ClassicDialect(node)


def unwrap(value: int, modulus: int, near: int) -> int:
    """The number nearest to `near` of which only the remainder was sent."""
    return near + (value - near + modulus // 2) % modulus - modulus // 2


class FdDialect:
    """Every message in one frame, as :mod:`drivers.can_protocol` lays them out."""

    is_fd: ClassVar[bool] = True
    samples_per_frame: ClassVar[int] = SAMPLES_PER_FRAME
    counters: ClassVar[int] = 1 << 32
    _identifiers: ClassVar[dict[type[Message], MessageId]] = {
        TimeSync: MessageId.TIME_SYNC, Heartbeat: MessageId.HEARTBEAT, Status: MessageId.STATUS,
        ChannelInfo: MessageId.CHANNEL_INFO, CanCommand: MessageId.COMMAND, Reply: MessageId.REPLY,
    }  # fmt: skip
    _types: ClassVar[dict[int, type[Message]]] = {identifier: kind for kind, identifier in _identifiers.items()}

    def __init__(self, node: int = 0) -> None:
        self._shift = NODE_STRIDE * node

    def encode(self, message: Message) -> list[Frame]:
        """One frame."""
        return [(self._identifiers[type(message)] + self._shift, message.pack())]

    def decode(self, identifier: int, data: bytes) -> Message | None:
        """Every known frame is a message."""
        kind = self._types.get(identifier - self._shift)
        return None if kind is None else kind.unpack(data)

    def encode_samples(self, channel: int, first: int, samples: NDArray[np.int16]) -> Frame:
        """A uint32 count and up to 30 samples."""
        data = struct.pack("<I", first & 0xFFFFFFFF) + samples.astype("<i2").tobytes()
        return MessageId.SAMPLES + self._shift + channel, data

    def channel_of(self, identifier: int) -> int | None:
        """The last digit of the identifier."""
        channel = identifier - self._shift - MessageId.SAMPLES
        return channel if 0 <= channel < CHANNELS_LIMIT else None

    def decode_samples(self, frames: Sequence[bytes]) -> Iterator[tuple[int, NDArray[np.int16]]]:
        """Full frames that follow each other in one piece, then the shorter ones."""
        whole = [frame for frame in frames if len(frame) == SAMPLE_FRAME.itemsize]
        if whole:
            table = np.frombuffer(b"".join(whole), SAMPLE_FRAME)
            breaks = np.flatnonzero(np.diff(table["counter"]) != SAMPLES_PER_FRAME) + 1
            for run in np.split(table, breaks):
                yield int(run["counter"][0]), run["samples"].reshape(-1)
        for frame in frames:
            if 4 < len(frame) < SAMPLE_FRAME.itemsize:
                count = (len(frame) - 4) // 2
                yield int.from_bytes(frame[:4], "little"), np.frombuffer(frame, "<i2", offset=4, count=count)

    def frame_sizes(self, count: int) -> list[int]:
        """CAN FD has few lengths."""
        return frame_sizes(count)


class ClassicDialect:
    """Frames of at most 8 bytes."""

    is_fd: ClassVar[bool] = False
    samples_per_frame: ClassVar[int] = 3
    counters: ClassVar[int] = 1 << 16
    _sync = struct.Struct("<IHH")
    _status = struct.Struct("<II")
    _command = struct.Struct("<B3xf")
    _reply = struct.Struct("<BBHf")

    def __init__(self, node: int = 0) -> None:
        self._shift = NODE_STRIDE * node
        self._rate_Hz = 0.0
        self._half_sync: tuple[int, int, int] | None = None
        self._pulse = 0
        self._pages: list[bytes] = []
        self._overload = [0] * CHANNELS_LIMIT

    def encode(self, message: Message) -> list[Frame]:
        """As many frames as it takes."""
        return [(identifier + self._shift, data) for identifier, data in self._cut(message)]

    def _cut(self, message: Message) -> list[Frame]:
        if isinstance(message, TimeSync):
            return self._encode_sync(message)
        if isinstance(message, ChannelInfo):
            record = message.pack().ljust(_PAGE_BYTES * _PAGES, b"\0")
            head = message.index << 4
            return [
                (MessageId.CHANNEL_INFO + CLASSIC, bytes([head | page]) + record[start : start + _PAGE_BYTES])
                for page, start in enumerate(range(0, len(record), _PAGE_BYTES))
            ]
        if isinstance(message, Status):
            overrun = min(message.overrun, 0xFFFFFF) << 8
            return [
                (MessageId.STATUS + CLASSIC, self._status.pack(overrun | channel, count & 0xFFFFFFFF))
                for channel, count in enumerate(message.overload)
            ]
        if isinstance(message, CanCommand):
            return [(MessageId.COMMAND + CLASSIC, self._command.pack(message.opcode, message.value))]
        if isinstance(message, Reply):
            data = self._reply.pack(message.opcode, message.result, message.decimation, message.sample_rate_Hz)
            return [(MessageId.REPLY + CLASSIC, data)]
        return [(MessageId.HEARTBEAT + CLASSIC, message.pack())]

    def _encode_sync(self, sync: TimeSync) -> list[Frame]:
        pulse = _PULSES if sync.pulse == NO_PULSE else sync.pulse % _PULSES
        half = self._sync.pack(sync.counter & 0xFFFFFFFF, pulse, sync.time_ns & 0xFFFF)
        return [
            (MessageId.TIME_SYNC + CLASSIC, half),
            (_SYNC_TIME, sync.time_ns.to_bytes(8, "little", signed=True)),
        ]

    def decode(self, identifier: int, data: bytes) -> Message | None:
        """The last frame of a message gives it."""
        match identifier - self._shift - CLASSIC:
            case MessageId.TIME_SYNC:
                self._half_sync = self._sync.unpack_from(data)
            case identifier if identifier == _SYNC_TIME - CLASSIC:
                return self._join_sync(data)
            case MessageId.CHANNEL_INFO:
                return self._join_info(data)
            case MessageId.STATUS:
                first, count = self._status.unpack_from(data)
                self._overload[(first & 0xFF) % CHANNELS_LIMIT] = count
                return Status(first >> 8, tuple(self._overload))
            case MessageId.COMMAND:
                return CanCommand(*self._command.unpack_from(data))
            case MessageId.REPLY:
                opcode, result, decimation, rate_Hz = self._reply.unpack_from(data)
                if decimation == 0:
                    raise ValueError("a decimation of 0")
                self._rate_Hz = rate_Hz
                return Reply(opcode, result, rate_Hz, decimation)
            case MessageId.HEARTBEAT:
                return Heartbeat.unpack(data)
        return None

    def _join_sync(self, data: bytes) -> TimeSync | None:
        """A time, if it belongs to the count that came before it."""
        half, self._half_sync = self._half_sync, None
        time_ns = int.from_bytes(data[:8], "little", signed=True)
        if half is None or len(data) < 8 or half[2] != time_ns & 0xFFFF:
            return None  # a frame in between was lost
        counter, pulse, _ = half
        if pulse == _PULSES:
            return TimeSync(counter, time_ns, NO_PULSE, self._rate_Hz)
        self._pulse = max(0, unwrap(pulse, _PULSES, self._pulse))
        return TimeSync(counter, time_ns, self._pulse, self._rate_Hz)

    def _join_info(self, data: bytes) -> ChannelInfo | None:
        """A description, if all its pages came in order."""
        if len(data) != 1 + _PAGE_BYTES:
            raise ValueError(f"a page of {len(data)} bytes")
        page = data[0] & 0xF
        if page == 0:
            self._pages.clear()
        if page != len(self._pages) or (self._pages and self._pages[0][0] >> 4 != data[0] >> 4):
            self._pages.clear()
            return None
        self._pages.append(data)
        if len(self._pages) < _PAGES:
            return None
        info = ChannelInfo.unpack(b"".join(each[1:] for each in self._pages))
        self._pages.clear()
        return replace(info, index=data[0] >> 4)

    def encode_samples(self, channel: int, first: int, samples: NDArray[np.int16]) -> Frame:
        """A uint16 count and up to 3 samples."""
        data = struct.pack("<H", first & 0xFFFF) + samples.astype("<i2").tobytes()
        return MessageId.SAMPLES + CLASSIC + self._shift + channel, data

    def channel_of(self, identifier: int) -> int | None:
        """The last digit of the identifier."""
        channel = identifier - self._shift - MessageId.SAMPLES - CLASSIC
        return channel if 0 <= channel < CHANNELS_LIMIT else None

    def decode_samples(self, frames: Sequence[bytes]) -> Iterator[tuple[int, NDArray[np.int16]]]:
        """Frame by frame."""
        for frame in frames:
            if len(frame) >= 4:
                yield int.from_bytes(frame[:2], "little"), np.frombuffer(frame[: len(frame) // 2 * 2], "<i2", offset=2)

    def frame_sizes(self, count: int) -> list[int]:
        """Full frames and a rest."""
        return [3] * (count // 3) + ([count % 3] if count % 3 else [])
