"""One MCAP record at a place in a file, within limits; its fields are parsed by the library."""

import struct
from dataclasses import dataclass
from io import BytesIO
from typing import Any, BinaryIO

from mcap import records as mcap
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError

from recordings.limits import Limits

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQII")
CHUNK_HEAD_BYTES = HEAD.size + _CHUNK_HEAD.size + 4 + 8
"""Of a chunk, in which all stands that comes before its data."""
FOOTER, CHUNK, _ATTACHMENT = 0x02, 0x06, 0x09
_KINDS: dict[int, type[mcap.McapRecord]] = {
    0x01: mcap.Header, 0x02: mcap.Footer, 0x03: mcap.Schema, 0x04: mcap.Channel, 0x06: mcap.Chunk,
    0x08: mcap.ChunkIndex, 0x09: mcap.Attachment, 0x0A: mcap.AttachmentIndex,
    0x0B: mcap.Statistics, 0x0C: mcap.Metadata, 0x0D: mcap.MetadataIndex, 0x0E: mcap.SummaryOffset,
    0x0F: mcap.DataEnd,
}  # fmt: skip
_MESSAGE = 0x05
_MESSAGE_INDEX = 0x07
_SMALL_BYTES = 1 << 20
"""Limit for every record but chunks, attachments and messages."""


@dataclass(frozen=True, kw_only=True)
class Located:
    """A sound record; `length` counts its head too.

    `record` is None for kinds that MCAP does not define (yet) and for message indexes, of which only `indexed` is
    kept: the channel's number and how many messages of it the chunk before holds.
    """

    record: mcap.McapRecord | None
    opcode: int
    offset: int
    length: int
    indexed: tuple[int, int] | None = None


def record_at(stream: BinaryIO, offset: int, size: int, limits: Limits) -> tuple[Located, bytes] | str:
    """The record at an offset with its bytes, or why there is none."""
    stream.seek(offset)
    head = stream.read(HEAD.size)
    if len(head) < HEAD.size:
        return "the file is cut within the head of a record"
    opcode, length = HEAD.unpack(head)
    if opcode == 0:
        return "a record of kind 0, which does not exist"
    if length > size - offset - HEAD.size:
        return f"a record of {length} bytes where {size - offset - HEAD.size} are left"
    small = opcode not in (CHUNK, _MESSAGE, _ATTACHMENT, _MESSAGE_INDEX)
    allowed = min(limits.record_bytes, _SMALL_BYTES) if small else limits.record_bytes
    if length > allowed:
        return f"a record of {length} bytes, more than the {allowed} allowed"
    body = stream.read(length)
    if len(body) < length:
        return "the file became shorter while it was read"
    if opcode == _MESSAGE_INDEX:
        if length < 6:
            return "a MessageIndex record that is not complete"
        channel, entries = struct.unpack_from("<HI", body)
        located = Located(
            record=None, opcode=opcode, offset=offset, length=HEAD.size + length, indexed=(channel, entries // 16)
        )
        return located, head + body
    record: mcap.McapRecord | None = None
    if opcode in _KINDS or opcode == _MESSAGE:
        try:
            record = _parse(opcode, body)
        except ValueError as error:
            return str(error)
    located = Located(record=record, opcode=opcode, offset=offset, length=HEAD.size + length)
    return located, head + body


def _parse(opcode: int, body: bytes) -> mcap.McapRecord:
    """A record's body by the library; ValueError if it does not fill its length."""
    name = "Message" if opcode == _MESSAGE else _KINDS[opcode].__name__
    data = ReadDataStream(BytesIO(body))
    try:
        read: Any = mcap.Message if opcode == _MESSAGE else _KINDS[opcode]
        record: mcap.McapRecord = read.read(data, len(body)) if opcode == _MESSAGE else read.read(data)
    except (McapError, struct.error, UnicodeDecodeError, OverflowError) as error:
        raise ValueError(f"a {name} record that is not complete") from error
    if isinstance(record, mcap.Chunk):
        start = _CHUNK_HEAD.size + len(record.compression.encode()) + 8
        (length,) = struct.unpack_from("<Q", body, start - 8)
        if start + length != len(body):
            raise ValueError("a chunk whose lengths contradict each other")
    return record


def chunk_head(stream: BinaryIO, offset: int, limits: Limits) -> tuple[mcap.Chunk, int, int] | None:
    """What the fields inside a chunk say, whatever its opcode and length are: chunk without data, start, length."""
    stream.seek(offset + HEAD.size)
    head = stream.read(CHUNK_HEAD_BYTES - HEAD.size)
    if len(head) < _CHUNK_HEAD.size + 8:
        return None
    start, end, full, crc, count = _CHUNK_HEAD.unpack_from(head)
    name = head[_CHUNK_HEAD.size : _CHUNK_HEAD.size + count]
    if count > 4 or name not in (b"", b"lz4", b"zstd") or len(head) < _CHUNK_HEAD.size + count + 8:
        return None
    (length,) = struct.unpack_from("<Q", head, _CHUNK_HEAD.size + count)
    if length > limits.record_bytes:
        return None
    chunk = mcap.Chunk(
        compression=name.decode(), data=b"", message_start_time=start, message_end_time=end,
        uncompressed_crc=crc, uncompressed_size=full,
    )  # fmt: skip
    return chunk, offset + HEAD.size + _CHUNK_HEAD.size + count + 8, length


def plausible_head(stream: BinaryIO, offset: int, size: int) -> tuple[int, int] | None:
    """Opcode and length at an offset if a record that fits into the file may begin there."""
    stream.seek(offset)
    head = stream.read(HEAD.size)
    if len(head) < HEAD.size:
        return None
    opcode, length = HEAD.unpack(head)
    known = opcode in _KINDS or opcode in (_MESSAGE, _MESSAGE_INDEX)
    return (opcode, length) if known and offset + HEAD.size + length <= size else None


def summary_descriptions(stream: BinaryIO, limits: Limits) -> tuple[dict[int, mcap.Schema], dict[int, mcap.Channel]]:
    """The copies of schemas and topics in the summary, where it is there; the stream is left where it was."""
    before, size = stream.tell(), stream.seek(0, 2)
    schemas: dict[int, mcap.Schema] = {}
    channels: dict[int, mcap.Channel] = {}
    footer = record_at(stream, max(0, size - len(MAGIC) - HEAD.size - 20), size, limits)
    if not isinstance(footer, str) and isinstance(footer[0].record, mcap.Footer):
        position = footer[0].record.summary_start or size
        while position < footer[0].offset and len(schemas) + len(channels) < 2 * limits.records:
            found = record_at(stream, position, size, limits)
            if isinstance(found, str):
                break
            record = found[0].record
            if isinstance(record, mcap.Schema):
                schemas[record.id] = record
            elif isinstance(record, mcap.Channel):
                channels[record.id] = record
            position += found[0].length
    stream.seek(before)
    return schemas, channels
