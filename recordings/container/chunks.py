"""What a chunk holds: decompressed within limits, its checksum, and the records in it."""

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO

import lz4.frame  # type: ignore[import-untyped]
import zstandard
from mcap import records as mcap
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError

from recordings.limits import Limits

_HEAD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_PIECE_BYTES = 1 << 20
_SCHEMA, _CHANNEL, _MESSAGE = 0x03, 0x04, 0x05


def chunk_data(chunk: mcap.Chunk, limits: Limits, *, cut: bool = False) -> bytes:
    """The records of a chunk as bytes.

    Parameters
    ----------
    chunk
        As found in the file.
    limits
        `record_bytes` bounds the result, whatever the chunk says of itself.
    cut
        Take what the beginning of a cut chunk gives, without checksum.

    Raises
    ------
    ValueError
        With the reason, if the chunk is damaged, has no checksum or is too large.
    """
    try:
        data = _decompress(chunk, min(limits.record_bytes, chunk.uncompressed_size) + 1)
    except (RuntimeError, zstandard.ZstdError, MemoryError) as error:
        raise ValueError(f"its {chunk.compression} data are damaged") from error
    if len(data) > limits.record_bytes:
        raise ValueError(f"a chunk of more than {limits.record_bytes} bytes")
    if cut:
        return data
    if chunk.uncompressed_crc == 0 and data:
        raise ValueError("a chunk without checksum")
    if len(data) > chunk.uncompressed_size:
        raise ValueError(f"a chunk that is larger than the {chunk.uncompressed_size} bytes it claims")
    if zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("checksum of the chunk is wrong")
    if len(data) != chunk.uncompressed_size:
        raise ValueError(f"a chunk of {len(data)} bytes that claims {chunk.uncompressed_size}")
    return data


def _decompress(chunk: mcap.Chunk, most: int) -> bytes:
    """At most `most` bytes; a damaged or cut stream gives what comes before the damage, or raises."""
    if chunk.compression == "":
        return bytes(chunk.data[:most])
    if chunk.compression == "lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=most))
    if chunk.compression == "zstd":
        # A window larger than the whole result would only serve to eat memory.
        decompressor = zstandard.ZstdDecompressor(max_window_size=1 << 27)
        whole = bytearray()
        with decompressor.stream_reader(chunk.data) as reader:
            while piece := reader.read(min(_PIECE_BYTES, most - len(whole))):
                whole += piece
        return bytes(whole)
    raise ValueError(f"compression {chunk.compression!r:.40}, which is none of lz4, zstd and none")


def chunk_records(data: bytes) -> Iterator[tuple[int, mcap.Schema | mcap.Channel | mcap.Message]]:
    """The records of a decompressed chunk, one by one, each with the position at which it begins.

    Raises
    ------
    ValueError
        With the reason, where the records do not fill the chunk; those before are sound.
    """
    position, view = 0, memoryview(data)
    while position < len(data):
        if position + _HEAD.size > len(data):
            raise ValueError("the chunk ends within a record")
        opcode, length = _HEAD.unpack_from(data, position)
        start, position = position, position + _HEAD.size
        if length > len(data) - position:
            raise ValueError("the chunk ends within a record")
        body = view[position : position + length]
        position += length
        if opcode == _MESSAGE:
            if length < _MESSAGE_HEAD.size:
                raise ValueError("a message shorter than its own head")
            channel, sequence, log_time, publish_time = _MESSAGE_HEAD.unpack_from(body)
            message = mcap.Message(
                channel_id=channel, sequence=sequence, log_time=log_time, publish_time=publish_time,
                data=bytes(body[_MESSAGE_HEAD.size :]),
            )  # fmt: skip
            yield start, message
        elif opcode in (_SCHEMA, _CHANNEL):
            kind = mcap.Schema if opcode == _SCHEMA else mcap.Channel
            try:
                yield start, kind.read(ReadDataStream(BytesIO(body)))
            except (McapError, struct.error, UnicodeDecodeError, OverflowError) as error:
                raise ValueError(f"a {kind.__name__} record that is not complete") from error


def message_at(data: bytes, position: int) -> bytes:
    """The content of a message that `chunk_records` found at a position.

    Raises
    ------
    ValueError
        If there is none.
    """
    opcode, length = _HEAD.unpack_from(data, position) if position + _HEAD.size <= len(data) else (0, 0)
    start = position + _HEAD.size
    if opcode != _MESSAGE or not _MESSAGE_HEAD.size <= length <= len(data) - start:
        raise ValueError("there is no message")
    return data[start + _MESSAGE_HEAD.size : start + length]
