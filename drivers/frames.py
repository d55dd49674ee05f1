"""The framed binary stream of the acquisition instrument: what a serial line carries while samples flow.

While streaming, everything the instrument sends is a frame, so that samples, replies and counters share one line and
each byte of it is covered by a checksum.  All fields are little-endian.

====== ==== ============ =============================================================================
offset size field        meaning
====== ==== ============ =============================================================================
0      4    sync         ``D7 52 49 47``
4      1    kind         1 samples, 2 text, 3 sync pulse, 4 counters, 5 end of stream
5      1    channels     number of channels in the payload (samples only, else 0)
6      2    sequence     modulo 65536, a jump is a loss; text and counters may overtake and are not counted
8      4    length       bytes of payload, at most 65536
12     8    first index  sample the frame starts at, counted from the start of the stream
20     8    time         nanoseconds of the instrument's clock at that sample
28     8    sample rate  Hz, IEEE 754 double
36     4    header check CRC-32 (zlib) of bytes 4 to 35
40     n    payload      see below
40+n   4    check        CRC-32 (zlib) of the payload
====== ==== ============ =============================================================================

Payloads: *samples*: for every channel a uint32 count of samples on the converter's limit, then for every channel its
float32 samples; *text*: one reply of the instrument as it would travel on the idle line; *sync pulse*: uint32 pulse
number, and the time field says when the instrument saw that pulse; *counters*: uint64 samples lost because the line
did not keep up; *end*: empty, plain text follows.
"""

import struct
import zlib
from collections import deque
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

SYNC = b"\xd7RIG"
MAX_PAYLOAD = 65536
_HEADER = struct.Struct("<BBHIQqd")
_REMEMBERED = 64
"""Missing frames of which one would know that they come late."""
_CHECK = struct.Struct("<I")
HEADER_BYTES = len(SYNC) + _HEADER.size + _CHECK.size
OVERHEAD_BYTES = HEADER_BYTES + _CHECK.size


class FrameKind(IntEnum):
    """What a frame carries."""

    SAMPLES = 1
    TEXT = 2
    PULSE = 3
    COUNTERS = 4
    END = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """One frame whose checksums were right."""

    kind: int
    sequence: int
    channels: int = 0
    first_index: int = 0
    time_ns: int = 0
    sample_rate_Hz: float = 0.0
    payload: bytes = b""


def encode(frame: Frame) -> bytes:
    """Bytes of a frame.

    Raises
    ------
    ValueError
        If the payload is larger than `MAX_PAYLOAD`.
    """
    return _assemble(frame, frame.payload)


def _assemble(frame: Frame, *payload: bytes | memoryview) -> bytes:
    """A frame with a payload in pieces, each of which is copied only once."""
    length = check = 0
    for piece in payload:
        length += len(piece)
        check = zlib.crc32(piece, check)
    if length > MAX_PAYLOAD:
        raise ValueError(f"payload of {length} bytes, the limit is {MAX_PAYLOAD}")
    header = _HEADER.pack(
        frame.kind,
        frame.channels,
        frame.sequence & 0xFFFF,
        length,
        frame.first_index,
        frame.time_ns,
        frame.sample_rate_Hz,
    )
    return b"".join((SYNC, header, _CHECK.pack(zlib.crc32(header)), *payload, _CHECK.pack(check)))


def encode_samples(
    samples: NDArray[np.float32],
    *,
    overload: NDArray[np.uint32],
    first_index: int,
    time_ns: int,
    sample_rate_Hz: float,
    sequence: int,
) -> bytes:
    """Bytes of a sample frame; `samples` has the shape (channels, n), `overload` (channels,)."""
    head = Frame(
        kind=FrameKind.SAMPLES,
        sequence=sequence,
        channels=len(samples),
        first_index=first_index,
        time_ns=time_ns,
        sample_rate_Hz=sample_rate_Hz,
    )
    values: NDArray[np.uint8] = np.ascontiguousarray(samples, dtype="<f4").reshape(-1).view(np.uint8)
    return _assemble(head, overload.astype("<u4").tobytes(), values.data)


def unpack_samples(frame: Frame) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Samples (channels, n) and overload counts (channels,) of a sample frame.

    Raises
    ------
    ValueError
        If the payload does not divide into the channels.
    """
    size, channels = len(frame.payload) - 4 * frame.channels, frame.channels
    if channels == 0 or size < 0 or size % (4 * channels):
        raise ValueError(f"{len(frame.payload)} bytes of payload do not hold {channels} channel(s)")
    overload = np.frombuffer(frame.payload, "<u4", channels)
    return np.frombuffer(frame.payload, "<f4", offset=4 * channels).reshape(channels, -1), overload


class Decoder:
    """Finds the frames in a stream of bytes cut anywhere, damaged anyhow.

    Memory is bounded by one frame beyond what is fed.  After damage it looks for the next sync word inside the bad
    frame, so that a flipped length costs one frame and no more.

    Attributes
    ----------
    bad_headers, bad_payloads
        Frames refused for their checksum or for a length beyond the limit.
    skipped_bytes
        Bytes that belonged to no good frame.
    lost_frames
        Frames missing by their sequence numbers, refused ones included.
    late_frames
        Frames that came after later ones; they are not missing any more.
    """

    def __init__(self) -> None:
        self._missing: deque[int] = deque(maxlen=_REMEMBERED)
        self._buffer = bytearray()
        self._due = 0  # bytes that the frame at the beginning of the buffer needs, where its header is known
        self._expected: int | None = None
        self.bad_headers = 0
        self.bad_payloads = 0
        self.skipped_bytes = 0
        self.lost_frames = 0
        self.late_frames = 0

    def feed(self, data: bytes) -> list[Frame]:
        """Take bytes in, and give the frames they complete; stops after an end-of-stream frame."""
        buffer = self._buffer
        buffer += data
        frames: list[Frame] = []
        if len(buffer) < self._due:  # a line gives a frame in several pieces: look at its header once
            return frames
        self._due = 0
        position = 0
        while not (frames and frames[-1].kind == FrameKind.END):
            start = buffer.find(SYNC, position)
            if start < 0:
                # The last bytes may be the beginning of a sync word.
                keep = max(position, len(buffer) - len(SYNC) + 1)
                self.skipped_bytes += keep - position
                position = keep
                break
            self.skipped_bytes += start - position
            position = start
            if len(buffer) - start < HEADER_BYTES:
                break
            body = start + len(SYNC)
            header = bytes(buffer[body : body + _HEADER.size])
            (header_check,) = _CHECK.unpack_from(buffer, body + _HEADER.size)
            kind, channels, sequence, length, index, time_ns, rate = _HEADER.unpack(header)
            if zlib.crc32(header) != header_check or length > MAX_PAYLOAD:
                self.bad_headers += 1
                self.skipped_bytes += 1
                position = start + 1
                continue
            end = start + OVERHEAD_BYTES + length
            if len(buffer) < end:
                self._due = end - start
                break
            with memoryview(buffer) as view:
                payload = bytes(view[start + HEADER_BYTES : end - _CHECK.size])
            (check,) = _CHECK.unpack_from(buffer, end - _CHECK.size)
            if zlib.crc32(payload) != check:
                self.bad_payloads += 1
                self.skipped_bytes += 1
                position = start + 1
                continue
            position = end
            if kind not in (FrameKind.TEXT, FrameKind.COUNTERS):
                self._count(sequence)
            frames.append(
                Frame(
                    kind=kind,
                    sequence=sequence,
                    channels=channels,
                    first_index=index,
                    time_ns=time_ns,
                    sample_rate_Hz=rate,
                    payload=payload,
                )
            )
        del buffer[:position]
        return frames

    def _count(self, sequence: int) -> None:
        """Compare a frame's number with the one that was due."""
        missing = 0 if self._expected is None else (sequence - self._expected) & 0xFFFF
        if missing < 0x8000:
            self.lost_frames += missing
            self._missing.extend((sequence - k) & 0xFFFF for k in range(min(missing, _REMEMBERED), 0, -1))
            self._expected = (sequence + 1) & 0xFFFF
        elif sequence in self._missing:
            self._missing.remove(sequence)
            self.lost_frames -= 1
            self.late_frames += 1
        # Else it is a repeated frame: nothing is missing because of it.
