"""MCAP records one after the other, within limits, going on after damage.

The library's reader trusts lengths and sizes, and stops at the first damage; a stranger's or a damaged file needs
more care.  Records themselves are parsed by the library.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import Any, BinaryIO

from mcap import records as mcap
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError

from recordings.limits import Limits

__all__ = ["MAGIC", "Damage", "Located", "scan", "summary_descriptions"]

MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")
_FOOTER, _CHUNK, _ATTACHMENT = 0x02, 0x06, 0x09
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
_CANDIDATE = re.compile(rb"[\x02\x06\x09\x0b\x0c\x0f](?=....\x00\x00\x00\x00)", re.DOTALL)
"""Records looked for after damage; schemas, channels and messages also stand inside chunks, and would mislead."""
_CANDIDATE_LIMIT, _CANDIDATE_BYTES = 500_000, 1 << 12
"""After damage, how many beginnings of records are tried, and how long one other than a chunk may be."""
_WINDOW = 1 << 20


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


@dataclass(frozen=True, kw_only=True)
class Damage:
    """Bytes that are no record; `partial` is a chunk of which only the beginning is there."""

    offset: int
    length: int
    reason: str
    partial: mcap.Chunk | None = None


def scan(stream: BinaryIO, limits: Limits) -> Iterator[Located | Damage]:
    """Every record of a file in order, and every stretch that is none.

    Parameters
    ----------
    stream
        Seekable file, read from its beginning.
    limits
        `record_bytes` bounds what is held in memory at a time.

    Yields
    ------
    Located or Damage
        Damage is also a wrong checksum of an attachment, of the data section or of the summary.
    """
    size = stream.seek(0, 2)
    stream.seek(0)
    position, whole = 0, True  # whole: nothing was skipped, so the data section's checksum means something
    checksum = 0
    start = stream.read(len(MAGIC))
    if start == MAGIC:
        position, checksum = len(MAGIC), zlib.crc32(start)
    else:
        yield Damage(offset=0, length=min(size, len(MAGIC)), reason="does not begin as an MCAP file does")
        whole = False
        position = _next_record(stream, 0, size, limits)
    while position < size:
        found = _record_at(stream, position, size, limits)
        if isinstance(found, str):
            rescued = _chunk_despite(stream, position, size, limits)
            whole = False
            if rescued is not None:
                yield Damage(offset=position, length=9, reason=found)
                yield rescued
                position += rescued.length
                continue
            after = _next_record(stream, position + 1, size, limits)
            partial = _partial_chunk(stream, position, size, limits) if after >= size else None
            yield Damage(offset=position, length=after - position, reason=found, partial=partial)
            position = after
            continue
        located, raw = found
        record = located.record
        if record is None and located.indexed is None:
            rescued = _chunk_despite(stream, position, size, limits)
            if rescued is not None and rescued.length == located.length:
                yield Damage(offset=position, length=1, reason=f"a chunk marked as a record of kind {located.opcode}")
                located, record = rescued, rescued.record
        if isinstance(record, mcap.DataEnd) and whole and record.data_section_crc not in (0, checksum):
            yield Damage(offset=8, length=position - 8, reason="checksum of the data section is wrong")
        checksum = zlib.crc32(raw, checksum)
        if isinstance(record, mcap.Attachment) and not _attachment_sound(raw):
            yield Damage(
                offset=position, length=located.length,
                reason=f"checksum of attachment {record.name!r:.80} is wrong",
            )  # fmt: skip
            position += located.length
            continue
        yield located
        position += located.length
        if isinstance(record, mcap.Footer):
            yield from _check_end(stream, located, record, position, size)
            return
    yield Damage(offset=size, length=0, reason="the file ends without a summary: it was cut short")


def _record_at(stream: BinaryIO, offset: int, size: int, limits: Limits) -> tuple[Located, bytes] | str:
    """The record at an offset with its bytes, or why there is none."""
    stream.seek(offset)
    head = stream.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return "the file is cut within the head of a record"
    opcode, length = _HEAD.unpack(head)
    if opcode == 0:
        return "a record of kind 0, which does not exist"
    if length > size - offset - _HEAD.size:
        return f"a record of {length} bytes where {size - offset - _HEAD.size} are left"
    small = opcode not in (_CHUNK, _MESSAGE, _ATTACHMENT, _MESSAGE_INDEX)
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
            record=None, opcode=opcode, offset=offset, length=_HEAD.size + length, indexed=(channel, entries // 16)
        )
        return located, head + body
    record: mcap.McapRecord | None = None
    if opcode in _KINDS or opcode == _MESSAGE:
        try:
            record = _parse(opcode, body)
        except ValueError as error:
            return str(error)
    located = Located(record=record, opcode=opcode, offset=offset, length=_HEAD.size + length)
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
    short = isinstance(record, mcap.Chunk) and 40 + len(record.compression) + len(record.data) != len(body)
    if data.count > len(body) or short:
        raise ValueError(f"a {name} record whose lengths contradict each other")
    return record


def _attachment_sound(raw: bytes) -> bool:
    """The checksum the library does not look at; zero means that none was taken."""
    (stored,) = struct.unpack("<I", raw[-4:])
    return stored == 0 or stored == zlib.crc32(raw[_HEAD.size : -4])


_CHUNK_HEAD = struct.Struct("<QQQII")


def _chunk_head(stream: BinaryIO, offset: int, limits: Limits) -> tuple[mcap.Chunk, int, int] | None:
    """What the fields inside a chunk say, whatever its opcode and length are: chunk without data, start, length."""
    stream.seek(offset + _HEAD.size)
    head = stream.read(_CHUNK_HEAD.size + 4 + 8)
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
    return chunk, offset + _HEAD.size + _CHUNK_HEAD.size + count + 8, length


def _chunk_despite(stream: BinaryIO, offset: int, size: int, limits: Limits) -> Located | None:
    """A chunk whose own opcode or length was hit, but whose inner fields lead to another record."""
    found = _chunk_head(stream, offset, limits)
    if found is None:
        return None
    chunk, start, length = found
    if length == 0 or start + length >= size or _plausible_head(stream, start + length, size) is None:
        return None
    stream.seek(start)
    chunk.data = stream.read(length)
    return Located(record=chunk, opcode=_CHUNK, offset=offset, length=start + length - offset)


def _partial_chunk(stream: BinaryIO, offset: int, size: int, limits: Limits) -> mcap.Chunk | None:
    """The beginning of a chunk that the end of the file cuts off."""
    stream.seek(offset)
    found = _chunk_head(stream, offset, limits) if stream.read(1) == bytes([_CHUNK]) else None
    if found is None:
        return None
    chunk, start, length = found
    if start + length <= size or start >= size:
        return None
    stream.seek(start)
    chunk.data = stream.read(min(length, size - start))
    return chunk


def _plausible_head(stream: BinaryIO, offset: int, size: int) -> tuple[int, int] | None:
    """Opcode and length at an offset if a record that fits into the file may begin there."""
    stream.seek(offset)
    head = stream.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    opcode, length = _HEAD.unpack(head)
    known = opcode in _KINDS or opcode in (_MESSAGE, _MESSAGE_INDEX)
    return (opcode, length) if known and offset + _HEAD.size + length <= size else None


def _next_record(stream: BinaryIO, offset: int, size: int, limits: Limits) -> int:
    """Where the next record begins that is sound and leads to another one; the file's size if there is none.

    A hostile file may hold a candidate in every byte, so their number is bounded.
    """
    candidates = 0
    while offset < size:
        stream.seek(offset)
        window = stream.read(_WINDOW + _HEAD.size)
        for match in _CANDIDATE.finditer(window):
            candidates += 1
            if candidates > _CANDIDATE_LIMIT:
                return size
            at = offset + match.start()
            if match.start() < _WINDOW and _begins_record(stream, at, size, limits):
                return at
        offset += _WINDOW
    return size


def _begins_record(stream: BinaryIO, offset: int, size: int, limits: Limits) -> bool:
    """Whether a candidate is a record, by tests that cost the same however long it claims to be."""
    head = _plausible_head(stream, offset, size)
    if head is None:
        return False
    opcode, length = head
    end = offset + _HEAD.size + length
    if opcode == _CHUNK:
        found = _chunk_head(stream, offset, limits)
        return found is not None and found[1] + found[2] == end
    if opcode == _FOOTER:
        stream.seek(end)
        return length == 20 and stream.read(len(MAGIC)) == MAGIC
    if length > _CANDIDATE_BYTES or _plausible_head(stream, end, size) is None:
        return False
    return not isinstance(_record_at(stream, offset, size, limits), str)


def _check_end(stream: BinaryIO, located: Located, footer: mcap.Footer, position: int, size: int) -> Iterator[Damage]:
    """What stands after the footer, and the summary's checksum."""
    stream.seek(position)
    if stream.read(len(MAGIC)) != MAGIC:
        yield Damage(offset=position, length=size - position, reason="does not end as an MCAP file does")
    elif size > position + len(MAGIC):
        extra = size - position - len(MAGIC)
        yield Damage(offset=size - extra, length=extra, reason=f"{extra} bytes after the end of the MCAP file")
    if footer.summary_start == 0:
        yield Damage(offset=located.offset, length=0, reason="there is no summary")
        return
    if footer.summary_start > located.offset:
        yield Damage(offset=located.offset, length=located.length, reason="the footer misplaces the summary")
        return
    if footer.summary_crc:
        checksum, at = 0, footer.summary_start
        end = located.offset + located.length - 4  # all of the footer but the checksum itself
        stream.seek(at)
        while at < end:
            piece = stream.read(min(_WINDOW, end - at))
            if not piece:
                break
            checksum, at = zlib.crc32(piece, checksum), at + len(piece)
        if checksum != footer.summary_crc:
            yield Damage(
                offset=footer.summary_start, length=end + 4 - footer.summary_start,
                reason="checksum of the summary is wrong",
            )  # fmt: skip


def summary_descriptions(stream: BinaryIO, limits: Limits) -> tuple[dict[int, mcap.Schema], dict[int, mcap.Channel]]:
    """The copies of schemas and topics in the summary, where it is there; the stream is left where it was."""
    before, size = stream.tell(), stream.seek(0, 2)
    schemas: dict[int, mcap.Schema] = {}
    channels: dict[int, mcap.Channel] = {}
    footer = _record_at(stream, max(0, size - len(MAGIC) - _HEAD.size - 20), size, limits)
    if not isinstance(footer, str) and isinstance(footer[0].record, mcap.Footer):
        position = footer[0].record.summary_start or size
        while position < footer[0].offset and len(schemas) + len(channels) < 2 * limits.records:
            found = _record_at(stream, position, size, limits)
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
