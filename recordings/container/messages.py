"""Messages of the contract to and from bytes.

Samples are packed by numpy, which writes the same bytes as protobuf several times faster (a test holds them equal).
"""

import math
from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import islice
from typing import Any

import numpy as np
from google.protobuf.message import DecodeError
from numpy.typing import NDArray

from recordings.container.schema import EVENT, INDICATOR, SAMPLE_BLOCK, STEP, message_class
from recordings.run import Event, Indicator, SampleBlock, Step, StepState

SECOND_NS = 1_000_000_000
TIME_LIMIT_NS = 1 << 63
"""MCAP counts nanoseconds in 64 bits without sign; numpy with sign."""
FIELD_LIMIT = 4096
"""Fields of one sample block: each costs memory of its own when decoded, however few bytes it has."""

_LENGTH_DELIMITED, _VARINT = 2, 0
_SERIES = 4
_LAYOUTS = 64
"""Remembered, of blocks whose lengths differ by a few digits of time and overload."""
_PACKED = np.dtype("<f4")


def encode_block(block: SampleBlock) -> bytes:
    """A ``rig.SampleBlock``; its series are tagged by hand, samples packed from whatever array they came in.

    Raises
    ------
    ValueError
        If the series differ in length, or a number is out of its range.
    """
    if not math.isfinite(block.sample_rate_Hz) or block.sample_rate_Hz <= 0:
        raise ValueError(f"a sample rate of {block.sample_rate_Hz!r} Hz cannot be recorded")
    head = message_class(SAMPLE_BLOCK)(first_index=block.first_index, sample_rate=block.sample_rate_Hz)
    _set_time(head, block.time_ns)
    count = len(block)
    parts: list[bytes | memoryview] = [head.SerializeToString()]
    for channel, values in block.samples.items():
        packed = np.ascontiguousarray(values, dtype=_PACKED)
        if packed.shape != (count,):
            raise ValueError(f"series {channel!r} has shape {packed.shape}, the block {count} samples")
        overload = int(block.overload.get(channel, 0))
        if not 0 <= overload <= count:
            raise ValueError(f"an overload of {overload} in {count} samples of {channel!r} cannot be recorded")
        before = _channel_field(channel) + (b"\x12" + _varint(packed.nbytes) if count else b"")
        after = b"\x18" + _varint(overload) if overload else b""
        parts.append(b"\x22" + _varint(len(before) + packed.nbytes + len(after)) + before)
        parts += [packed.data.cast("B"), after] if count else [after]
    return b"".join(parts)


def encode_step(step: Step) -> bytes:
    """A ``rig.Step``; raises ValueError for what `decode_step` would refuse."""
    for name, value in (("frequency", step.frequency_Hz), ("target amplitude", step.target_amplitude)):
        if not math.isfinite(value) or value < 0:
            raise ValueError(f"a {name} of {value!r} cannot be recorded")
    message = message_class(STEP)(
        sweep=step.sweep, index=step.index, frequency=step.frequency_Hz, target_channel=step.target_channel,
        target_amplitude=step.target_amplitude, state=int(step.state),
    )  # fmt: skip
    return _finish(message, step.time_ns)


def encode_event(event: Event) -> bytes:
    """A ``rig.Event``."""
    return _finish(message_class(EVENT)(source=event.source, kind=event.kind, detail=event.detail), event.time_ns)


def encode_indicator(indicator: Indicator) -> bytes:
    """A ``rig.Indicator``; its name is the topic's."""
    return _finish(message_class(INDICATOR)(value=indicator.value, unit=indicator.unit), indicator.time_ns)


def decode_block(device: str, data: bytes) -> SampleBlock:
    """A block of samples as arrays of float32.

    Raises
    ------
    ValueError
        With the reason, if the bytes break the contract.
    """
    if _more_fields_than(data, FIELD_LIMIT):
        raise ValueError(f"a sample block of more than {FIELD_LIMIT} fields")
    message = _parse(SAMPLE_BLOCK, data)
    if not math.isfinite(message.sample_rate) or message.sample_rate <= 0:
        raise ValueError(f"sample_rate is {message.sample_rate!r} Hz")
    samples: dict[str, NDArray[np.float32]] = {}
    overload: dict[str, int] = {}
    for series in message.series:
        if series.channel in samples:
            raise ValueError(f"channel {series.channel!r:.80} stands twice in one block")
        samples[series.channel] = np.array(series.samples, dtype=np.float32)
        if series.overload > len(series.samples):
            raise ValueError(f"overload of {series.channel!r:.80} counts more samples than the block has")
        overload[series.channel] = series.overload
    if not samples:
        raise ValueError("a sample block without series")
    lengths = {len(values) for values in samples.values()}
    if len(lengths) > 1:
        raise ValueError(f"series of different lengths in one block: {sorted(lengths)[:4]}")
    return SampleBlock(
        device=device, time_ns=_time(message), first_index=message.first_index,
        sample_rate_Hz=message.sample_rate, samples=samples, overload=overload,
    )  # fmt: skip


Layout = list[tuple[str, bytes, int, int]]
"""Of each series: its channel, the bytes before its samples, where these begin, and how many there are."""


def decode_series(data: bytes, layouts: dict[int, Layout]) -> Mapping[str, NDArray[np.float32]]:
    """The samples of a block that `decode_block` has found sound: views of its bytes, where they are packed as usual.

    Parameters
    ----------
    layouts
        Of messages before, by their length.  One that also has the bytes before each series' samples at the same places
        is laid out alike, and need not be walked through again.

    Raises
    ------
    ValueError
        If it is not sound any more.
    """
    layout = layouts.get(len(data), [])
    if not layout or any(data[start - len(before) : start] != before for _, before, start, _ in layout):
        layout = []
        for number, start, stop in _parts(data, 0, len(data)):
            parts = list(_parts(data, start, stop)) if number == _SERIES else []
            named = {part: slice(first, last) for part, first, last in parts}
            if number == _SERIES and (not {1, 2} <= named.keys() or len(named) < len(parts)):
                return decode_block("", data).samples
            if parts:
                packed = named[2]
                count = (packed.stop - packed.start) // _PACKED.itemsize
                layout.append((data[named[1]].decode(), data[start : packed.start], packed.start, count))
        if len(layouts) >= _LAYOUTS:
            layouts.clear()
        layouts[len(data)] = layout
    return {name: np.frombuffer(data, _PACKED, count, start) for name, _, start, count in layout}


def decode_step(data: bytes) -> Step:
    """A step; raises ValueError with the reason."""
    message = _parse(STEP, data)
    for name in ("frequency", "target_amplitude"):
        value = getattr(message, name)
        if not math.isfinite(value) or value < 0:
            raise ValueError(f"{name} is {value!r}")
    try:
        state = StepState(message.state)
    except ValueError:
        raise ValueError(f"state {message.state} is none of the contract's") from None
    return Step(
        time_ns=_time(message), sweep=message.sweep, index=message.index, frequency_Hz=message.frequency,
        target_channel=message.target_channel, target_amplitude=message.target_amplitude, state=state,
    )  # fmt: skip


def decode_event(data: bytes) -> Event:
    """An event; raises ValueError with the reason."""
    message = _parse(EVENT, data)
    return Event(time_ns=_time(message), source=message.source, kind=message.kind, detail=message.detail)


def decode_indicator(name: str, data: bytes) -> Indicator:
    """An indicator of topic ``/indicators/<name>``; raises ValueError with the reason."""
    message = _parse(INDICATOR, data)
    return Indicator(name=name, time_ns=_time(message), value=message.value, unit=message.unit)


def _parse(name: str, data: bytes) -> Any:
    try:
        return message_class(name).FromString(data)
    except DecodeError as error:
        raise ValueError(f"bytes that are no {name} message") from error


def _time(message: Any) -> int:
    """The time stamp in nanoseconds; a missing one is an error, not the year 1970."""
    if not message.HasField("timestamp"):
        raise ValueError("no timestamp")
    seconds, nanos = message.timestamp.seconds, message.timestamp.nanos
    time_ns = seconds * SECOND_NS + nanos
    if not (0 <= nanos < SECOND_NS and 0 <= time_ns < TIME_LIMIT_NS):
        raise ValueError(f"timestamp of {seconds} s and {nanos} ns")
    return int(time_ns)


def _set_time(message: Any, time_ns: int) -> None:
    if not 0 <= time_ns < TIME_LIMIT_NS:
        raise ValueError(f"a time of {time_ns} ns cannot be recorded")
    message.timestamp.seconds, message.timestamp.nanos = divmod(int(time_ns), SECOND_NS)


def _finish(message: Any, time_ns: int) -> bytes:
    _set_time(message, time_ns)
    return bytes(message.SerializeToString())


@lru_cache(maxsize=1024)
def _channel_field(name: str) -> bytes:
    encoded = name.encode()
    return b"\x0a" + _varint(len(encoded)) + encoded


@lru_cache(maxsize=1024)  # lengths repeat from block to block
def _varint(value: int) -> bytes:
    """Base-128 number, low bits first."""
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)


def _more_fields_than(data: bytes, limit: int) -> bool:
    """Whether the message has more top-level fields than `limit`; whatever cannot be walked is left to protobuf."""
    return next(islice(_parts(data, 0, len(data)), limit, None), None) is not None


def _parts(data: bytes, position: int, stop: int) -> Iterator[tuple[int, int, int]]:
    """Fields of a message between two positions: number, and where the content begins and ends.

    Nothing follows one of a kind that does not exist.
    """
    while position < stop:
        tag, position = _read_varint(data, position)
        kind, start = tag & 7, position
        if kind == _VARINT:
            _, position = _read_varint(data, position)
        elif kind == _LENGTH_DELIMITED:
            length, start = _read_varint(data, position)
            position = start + length
        elif kind in (1, 5):
            position += 8 if kind == 1 else 4
        elif kind not in (3, 4):  # group ends have no body of their own
            yield tag >> 3, start, stop
            return
        yield tag >> 3, start, position


def _read_varint(data: bytes, position: int) -> tuple[int, int]:
    if position < len(data) and (value := data[position]) < 0x80:  # most are of one byte
        return value, position + 1
    value = shift = 0
    while position < len(data) and shift < 70:
        byte = data[position]
        position += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            break
        shift += 7
    return value, position
