"""Messages of the acquisition node on CAN FD: identifiers and layouts, the same as in ``rig.dbc``.

How they go over classic CAN says :mod:`drivers.can_dialect`.

Samples travel as int16 with the scale range / 32767, 30 in a frame behind a uint32 count of the first one; a time-sync
frame every 100 ms of the node's time says when a sample was taken.  A frame at the end of a stream may be shorter.
All fields are little-endian.  The database shipped as ``drivers/rig.dbc`` is what other programs read; a test holds the
two equal.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from importlib import resources

import numpy as np

from recordings.directions import axis_number, direction_name, unit_vector
from recordings.quantities import NO_CODE, known_quantities, quantity_of_code
from recordings.run import Channel

CHANNELS_LIMIT = 4
FULL_SCALE = 32767
NO_PULSE = 0xFFFFFFFF
"""Pulse number of a time sync that no pulse caused."""
SAMPLES_PER_FRAME = 30
LOAD_UNKNOWN = 255
PULSE_INTERVAL_NS = 100_000_000
_AXIS_CODES = (2, 1, 3)
"""Of x, y and z in a channel's description."""
_COMPONENT = 1 / 30000
"""Of a direction that lies along no axis."""
SAMPLE_FRAME = np.dtype([("counter", "<u4"), ("samples", "<i2", SAMPLES_PER_FRAME)])


class MessageId(IntEnum):
    """Arbitration identifiers, the smaller the more urgent; channel k's samples have SAMPLES + k."""

    TIME_SYNC = 0x080
    SAMPLES = 0x100
    HEARTBEAT = 0x180
    STATUS = 0x181
    CHANNEL_INFO = 0x182
    COMMAND = 0x200
    REPLY = 0x201


class NodeState(IntEnum):
    """What the node is doing; armed waits for the trigger line, failed has nothing to measure any more."""

    IDLE = 0
    ARMED = 1
    STREAMING = 2
    FAILED = 3


class Opcode(IntEnum):
    """What a command frame asks for; the value is a rate for SET_RATE, a channel for DESCRIBE."""

    START = 1
    ARM = 2
    STOP = 3
    SET_RATE = 4
    DESCRIBE = 5
    HALT = 6
    """Emergency stop: the generator's output to zero, and every stream ended."""


@dataclass(frozen=True, slots=True)
class TimeSync:
    """Sample `counter` was taken at `time_ns` of the node's clock, when pulse number `pulse` came."""

    counter: int
    time_ns: int
    pulse: int
    sample_rate_Hz: float
    _layout = struct.Struct("<IqId")

    def pack(self) -> bytes:
        """Payload."""
        return self._layout.pack(self.counter & 0xFFFFFFFF, self.time_ns, self.pulse, self.sample_rate_Hz)

    @classmethod
    def unpack(cls, data: bytes) -> TimeSync:
        """From a payload; raises struct.error if it is too short."""
        return cls(*cls._layout.unpack_from(data))


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Sent every second of real time: the worst error state and the load of the bus (%, 255 unknown) since the last."""

    state: int
    channels: int
    uptime_ms: int
    error_state: int = 0
    bus_load_percent: int = LOAD_UNKNOWN
    _layout = struct.Struct("<BBBBI")

    def pack(self) -> bytes:
        """Payload."""
        return self._layout.pack(
            self.state, self.channels, self.error_state, self.bus_load_percent, self.uptime_ms & 0xFFFFFFFF
        )

    @classmethod
    def unpack(cls, data: bytes) -> Heartbeat:
        """From a payload; raises struct.error if it is too short."""
        state, channels, error_state, load, uptime_ms = cls._layout.unpack_from(data)
        return cls(state, channels, uptime_ms, error_state, load)


@dataclass(frozen=True, slots=True)
class Status:
    """Counts since the start of the stream: samples the bus did not carry, samples on each converter's limit."""

    overrun: int
    overload: tuple[int, ...]
    _layout = struct.Struct(f"<I{CHANNELS_LIMIT}I")

    def pack(self) -> bytes:
        """Payload."""
        counts = (*self.overload, *(0,) * CHANNELS_LIMIT)[:CHANNELS_LIMIT]
        return self._layout.pack(self.overrun & 0xFFFFFFFF, *(count & 0xFFFFFFFF for count in counts))

    @classmethod
    def unpack(cls, data: bytes) -> Status:
        """From a payload; raises struct.error if it is too short."""
        overrun, *overload = cls._layout.unpack_from(data)
        return cls(overrun, tuple(overload))


def _direction_code(direction: str) -> tuple[int, list[int]]:
    """What the frame says of a direction: its nearest axis by `_AXIS_CODES`, and its components along the others."""
    vector = unit_vector(direction)
    axis = abs(number := axis_number(vector)) - 1
    code = _AXIS_CODES[axis]
    return -code if number < 0 else code, [round(v / _COMPONENT) for n, v in enumerate(vector) if n != axis]


def _direction_of(code: int, others: Sequence[int]) -> str:
    """The direction that a frame says; a code that is none counts as y, as for the first nodes, which knew no other."""
    axis = _AXIS_CODES.index(abs(code)) if abs(code) in _AXIS_CODES else 1
    vector = [value * _COMPONENT for value in others]
    vector.insert(axis, math.copysign(math.sqrt(max(0.0, 1.0 - sum(v * v for v in vector))), code))
    return direction_name([round(value, 4) for value in vector])


@dataclass(frozen=True, slots=True)
class ChannelInfo:
    """What one channel measures."""

    index: int
    channels: int
    channel: Channel
    _layout = struct.Struct("<BBBbff24s8s2h")

    def pack(self) -> bytes:
        """Payload, 48 bytes."""
        channel = self.channel
        known = known_quantities()
        quantity = known[channel.quantity].code if channel.quantity in known else NO_CODE
        position = float("nan") if channel.position_m is None else channel.position_m
        code, others = _direction_code(channel.direction)
        return self._layout.pack(
            self.index, self.channels, quantity, code,
            channel.range or 0.0, position, channel.name.encode(), channel.unit.encode(), *others,
        )  # fmt: skip

    @classmethod
    def unpack(cls, data: bytes) -> ChannelInfo:
        """From a payload; raises struct.error if it is too short, ValueError if it makes no sense."""
        index, channels, quantity, direction, limit, position, name, unit, *others = cls._layout.unpack_from(data)
        if not 0 < channels <= CHANNELS_LIMIT or index >= channels:
            raise ValueError(f"channel {index} of {channels}")
        if not (np.isfinite(limit) and limit > 0):
            raise ValueError(f"a range of {limit}")
        return cls(
            index,
            channels,
            Channel(
                name=name.rstrip(b"\0").decode(),
                quantity=quantity_of_code(quantity),
                unit=unit.rstrip(b"\0").decode(),
                position_m=None if np.isnan(position) else round(position, 6),
                direction=_direction_of(direction, others),
                range=float(limit),
            ),
        )


@dataclass(frozen=True, slots=True)
class CanCommand:
    """From the host to the node."""

    opcode: int
    value: float = 0.0
    _layout = struct.Struct("<B3xd")

    def pack(self) -> bytes:
        """Payload."""
        return self._layout.pack(self.opcode, self.value)

    @classmethod
    def unpack(cls, data: bytes) -> CanCommand:
        """From a payload; raises struct.error if it is too short."""
        return cls(*cls._layout.unpack_from(data))


@dataclass(frozen=True, slots=True)
class Reply:
    """The node's answer to a command: result 0 is done, 1 refused; the rate is the converter's, in force now.

    Of `decimation` samples of the converter the bus gets one.
    """

    opcode: int
    result: int
    sample_rate_Hz: float
    decimation: int = 1
    _layout = struct.Struct("<BBHd")

    def pack(self) -> bytes:
        """Payload."""
        return self._layout.pack(self.opcode, self.result, self.decimation, self.sample_rate_Hz)

    @classmethod
    def unpack(cls, data: bytes) -> Reply:
        """From a payload; raises struct.error if it is too short, ValueError if it makes no sense."""
        opcode, result, decimation, sample_rate_Hz = cls._layout.unpack_from(data)
        if decimation == 0:
            raise ValueError("a decimation of 0")
        return cls(opcode, result, sample_rate_Hz, decimation)


def frame_sizes(count: int) -> list[int]:
    """Samples in each of the frames that carry the last `count` of a stream: CAN FD has few lengths."""
    sizes = []
    for size in (30, 22, 14, 10, 8, 6, 4, 2, 1):
        sizes += [size] * (count // size)
        count %= size
    return sizes


def read_dbc() -> str:
    """Text of the CAN database shipped with the package."""
    return resources.files("drivers").joinpath("rig.dbc").read_text(encoding="ascii")
