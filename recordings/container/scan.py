"""Every record of an MCAP file, going on after damage.

The library's reader trusts lengths and stops at the first damage; a stranger's or a damaged file needs more care.
"""

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

from mcap import records as mcap
from mcap.data_stream import RecordBuilder

from recordings.container.records import CHUNK, FOOTER, HEAD, MAGIC, Located, chunk_head, plausible_head, record_at
from recordings.limits import Limits

_CANDIDATE = re.compile(rb"[\x02\x06\x09\x0b\x0c\x0f](?=....\x00\x00\x00\x00)", re.DOTALL)
"""Records looked for after damage; schemas, channels and messages also stand inside chunks, and would mislead."""
_CANDIDATE_LIMIT, _CANDIDATE_BYTES = 500_000, 64 << 20
"""After damage, how many beginnings of records are tried in one file, and how many bytes are parsed for it."""
_WINDOW = 1 << 20


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
    return _Scanner(stream, limits).walk()


class _Scanner:
    """One walk through one file."""

    def __init__(self, stream: BinaryIO, limits: Limits) -> None:
        self._stream, self._limits = stream, limits
        self._size = stream.seek(0, 2)
        self._candidates_left, self._bytes_left = _CANDIDATE_LIMIT, _CANDIDATE_BYTES

    def walk(self) -> Iterator[Located | Damage]:
        """All records and damage."""
        self._stream.seek(0)
        start = self._stream.read(len(MAGIC))
        position, checksum = len(MAGIC), zlib.crc32(start)
        whole = start == MAGIC  # nothing was skipped, so the data section's checksum means something
        if not whole:
            yield Damage(
                offset=0, length=min(self._size, len(MAGIC)), reason="does not begin as an MCAP file does"
            )  # fmt: skip
            position = self._next_record(0)
        while position < self._size:
            found = record_at(self._stream, position, self._size, self._limits)
            if isinstance(found, str):
                whole = False
                for step in self._over_damage(position, found):
                    yield step
                    position = step.offset + step.length
                continue
            located, raw = found
            unknown = located.record is None and located.indexed is None
            chunk = self._chunk_despite(position) if unknown else None
            if chunk and chunk.length == located.length:
                reason = f"a chunk marked as a record of kind {located.opcode}"
                yield Damage(offset=position, length=1, reason=reason)
                located = chunk
            record = located.record
            if isinstance(record, mcap.DataEnd) and whole and record.data_section_crc not in (0, checksum):
                yield Damage(offset=0, length=0, reason="checksum of the data section is wrong")
            checksum = zlib.crc32(raw, checksum)
            position += located.length
            if isinstance(record, mcap.Attachment) and not _attachment_sound(raw):
                reason = f"checksum of attachment {record.name!r:.80} is wrong"
                yield Damage(offset=located.offset, length=located.length, reason=reason)
                continue
            yield located
            if isinstance(record, mcap.Footer):
                yield from self._end(located, record)
                return
        yield Damage(offset=self._size, length=0, reason="the file ends without a summary: it was cut short")

    def _over_damage(self, position: int, reason: str) -> Iterator[Located | Damage]:
        """What follows where no record is: the same place read as a chunk, or the next record after a stretch."""
        if chunk := self._chunk_despite(position):
            yield Damage(offset=position, length=HEAD.size, reason=reason)
            yield chunk
            return
        after = self._next_record(position + 1)
        partial = self._partial_chunk(position) if after >= self._size else None
        if self._candidates_left <= 0 or self._bytes_left <= 0:
            reason += ", and too much damage follows to look for more"
        yield Damage(offset=position, length=after - position, reason=reason, partial=partial)

    def _chunk_despite(self, offset: int) -> Located | None:
        """A chunk whose own opcode or length was hit, but whose inner fields lead to another record."""
        found = chunk_head(self._stream, offset, self._limits)
        if found is None:
            return None
        chunk, start, length = found
        if length == 0 or plausible_head(self._stream, start + length, self._size) is None:
            return None
        self._stream.seek(start)
        chunk.data = self._stream.read(length)
        return Located(record=chunk, opcode=CHUNK, offset=offset, length=start + length - offset)

    def _partial_chunk(self, offset: int) -> mcap.Chunk | None:
        """The beginning of a chunk that the end of the file cuts off."""
        self._stream.seek(offset)
        is_chunk = self._stream.read(1) == bytes([CHUNK])
        found = chunk_head(self._stream, offset, self._limits) if is_chunk else None
        if found is None:
            return None
        chunk, start, length = found
        if not start < self._size < start + length:
            return None
        self._stream.seek(start)
        chunk.data = self._stream.read(self._size - start)
        return chunk

    def _next_record(self, offset: int) -> int:
        """Where the next record begins that is sound and leads to another one; the file's size if there is none.

        A hostile file may hold a candidate in every byte, so the effort is bounded.
        """
        while offset < self._size:
            self._stream.seek(offset)
            window = self._stream.read(_WINDOW + HEAD.size)
            for match in _CANDIDATE.finditer(window):
                self._candidates_left -= 1
                if self._candidates_left <= 0 or self._bytes_left <= 0:
                    return self._size
                if match.start() < _WINDOW and self._begins_record(offset + match.start()):
                    return offset + match.start()
            offset += _WINDOW
        return self._size

    def _begins_record(self, offset: int) -> bool:
        """Whether a candidate is a record."""
        head = plausible_head(self._stream, offset, self._size)
        if head is None:
            return False
        opcode, length = head
        end = offset + HEAD.size + length
        if opcode == CHUNK:
            found = chunk_head(self._stream, offset, self._limits)
            return found is not None and found[1] + found[2] == end
        if opcode == FOOTER:
            self._stream.seek(end)
            return length == 20 and self._stream.read(len(MAGIC)) == MAGIC
        if plausible_head(self._stream, end, self._size) is None:
            return False
        self._bytes_left -= length
        found_record = record_at(self._stream, offset, self._size, self._limits)
        if isinstance(found_record, str) or found_record[0].record is None:
            return False
        again = RecordBuilder()
        found_record[0].record.write(again)
        return again.end() == found_record[1]  # zeros and ones may look like a record, but not to the last byte

    def _end(self, located: Located, footer: mcap.Footer) -> Iterator[Damage]:
        """What stands after the footer, and the summary's checksum."""
        end = located.offset + located.length
        self._stream.seek(end)
        extra = self._size - end - len(MAGIC)
        if self._stream.read(len(MAGIC)) != MAGIC:
            yield Damage(offset=end, length=self._size - end, reason="does not end as an MCAP file does")
        elif extra > 0:
            yield Damage(
                offset=self._size - extra, length=extra, reason=f"{extra} bytes after the end of the MCAP file"
            )
        start = footer.summary_start
        if start == 0:
            yield Damage(offset=located.offset, length=0, reason="there is no summary")
        elif start > located.offset:
            yield Damage(offset=located.offset, length=0, reason="the footer misplaces the summary")
        elif footer.summary_crc and self._checksum(start, end - 4) != footer.summary_crc:
            yield Damage(offset=start, length=0, reason="checksum of the summary is wrong")

    def _checksum(self, start: int, end: int) -> int:
        """CRC-32 of a stretch of the file."""
        checksum = 0
        self._stream.seek(start)
        while start < end and (piece := self._stream.read(min(_WINDOW, end - start))):
            checksum, start = zlib.crc32(piece, checksum), start + len(piece)
        return checksum


def _attachment_sound(raw: bytes) -> bool:
    """The checksum the library does not look at; zero means that none was taken."""
    (stored,) = struct.unpack("<I", raw[-4:])
    return stored == 0 or stored == zlib.crc32(raw[HEAD.size : -4])
