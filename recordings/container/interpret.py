"""A file's records read as the recording contract means them; every breach is reported, none is passed over.

The strict reader lets the first report raise; checking and recovering collect them and go on.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import BinaryIO, Literal

from mcap import records as mcap

from recordings.container.chunks import chunk_data, chunk_records
from recordings.container.messages import decode_block, decode_event, decode_indicator, decode_step
from recordings.container.metadata import CHANNEL_PREFIX, RUN, parse_channel, parse_run
from recordings.container.records import Located, summary_descriptions
from recordings.container.scan import Damage, scan
from recordings.container.schema import EVENT, INDICATOR, SAMPLE_BLOCK, STEP, schema_problem
from recordings.limits import Limits
from recordings.run import Channel, Event, Indicator, SampleBlock, Step


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Something wrong with a file.

    `kind` is ``damage`` (bytes were lost or changed), ``contract`` (its writer did not keep the contract) or
    ``warning`` (allowed, but somebody should know).
    """

    kind: Literal["damage", "contract", "warning"]
    place: str
    reason: str


@dataclass(frozen=True, kw_only=True)
class MetadataItem:
    """A metadata record; `content` is None where it is unknown to the contract or breaks it."""

    name: str
    record: dict[str, str]
    content: dict[str, str] | Channel | None


@dataclass(frozen=True, kw_only=True)
class AttachmentItem:
    """An attachment."""

    name: str
    media_type: str
    data: bytes


@dataclass(frozen=True, kw_only=True)
class MessageItem:
    """A message; `content` is None where its topic is unknown to the contract or it breaks the contract.

    `channel` and `schema` are None where the file no longer says what they were; `known` tells whether the contract
    defines the topic.  `at` is the offset of its chunk and its position in there, or its own offset and -1.
    """

    place: str
    at: tuple[int, int]
    topic: str
    known: bool
    raw: mcap.Message
    channel: mcap.Channel | None
    schema: mcap.Schema | None
    content: SampleBlock | Step | Event | Indicator | None


Item = MetadataItem | AttachmentItem | MessageItem


_BROKEN_BLOCK_FIELDS = 256
"""What a sample block that cannot be decoded counts for; it may have cost as much time as one with many fields."""


class _OverLimitError(Exception):
    """The file costs more than it may."""


class Interpreter:
    """Walks through one file once; iterate over it, then look at what it counted.

    Parameters
    ----------
    stream
        Seekable file.
    limits
        What the file may cost.
    report
        Called with each problem; it may raise to stop.
    """

    def __init__(self, stream: BinaryIO, limits: Limits, report: Callable[[Problem], None]) -> None:
        self._stream, self._limits, self._report = stream, limits, report
        self._schemas: dict[int, mcap.Schema] = {}
        self._channels: dict[int, mcap.Channel] = {}
        self._summary: tuple[dict[int, mcap.Schema], dict[int, mcap.Channel]] | None = None
        self._spent: Counter[str] = Counter()
        self._chunk_offsets: set[int] = set()
        self._indexed_offsets: set[int] = set()
        self._message_counts: Counter[int] = Counter()
        self._statistics: mcap.Statistics | None = None
        self._told: set[str] = set()
        self._damaged = False
        self.records = 0
        """Sound records found outside chunks; none in what is no MCAP file."""
        self.bytes_lost = 0
        """Bytes that are no record, or whose chunk could not be opened."""
        self.messages_lost: Counter[str] = Counter()
        """Messages that are known to be lost, by topic, from the indexes behind damaged chunks."""

    def __iter__(self) -> Iterator[Item]:
        after_lost_chunk = False
        try:
            for found in scan(self._stream, self._limits):
                self.records += isinstance(found, Located)
                if isinstance(found, Damage):
                    self._damage(f"byte {found.offset}", found.reason)
                    self.bytes_lost += found.length
                    if found.partial is not None:
                        yield from self._open_chunk(found.partial, found.offset, cut=True)
                elif isinstance(found.record, mcap.Chunk):
                    before = self.bytes_lost
                    self._chunk_offsets.add(found.offset)
                    yield from self._open_chunk(found.record, found.offset)
                    after_lost_chunk = self.bytes_lost > before
                elif found.indexed is not None:
                    if after_lost_chunk:
                        self._count_lost(*found.indexed)
                elif found.record is not None:
                    after_lost_chunk = False
                    yield from self._record(found.record, found)
        except _OverLimitError as stop:
            self._breach("whole file", f"{stop}, the limit of this program")
            return
        self._compare_with_summary()

    def _damage(self, place: str, reason: str) -> None:
        self._damaged = True
        self._report(Problem(kind="damage", place=place, reason=reason))

    def _breach(self, place: str, reason: str, *, once: str = "") -> None:
        """Report a breach; with `once`, only the first of those that would come with every message."""
        if once in self._told:
            return
        if once:
            self._told.add(once)
        self._report(Problem(kind="contract", place=place, reason=reason))

    def _spend(self, what: str, amount: int, allowed: int) -> None:
        self._spent[what] += amount
        if self._spent[what] > allowed:
            raise _OverLimitError(f"more than {allowed} {what}")

    def _record(self, record: mcap.McapRecord, found: Located) -> Iterator[Item]:
        """Whatever stands outside chunks."""
        place = f"byte {found.offset}"
        if isinstance(record, (mcap.Schema, mcap.Channel)):
            self._describe(record)
        elif isinstance(record, mcap.Metadata):
            self._spend("metadata records", 1, self._limits.records)
            yield self._metadata(record)
        elif isinstance(record, mcap.Attachment):
            self._spend("attachments", 1, self._limits.records)
            self._spend("bytes of attachments", len(record.data), self._limits.attachment_bytes)
            yield AttachmentItem(name=record.name, media_type=record.media_type, data=record.data)
        elif isinstance(record, mcap.Message):
            self._breach(place, "a message outside any chunk", once="outside")
            yield self._message(record, found.offset, -1)
        elif isinstance(record, mcap.Statistics):
            self._statistics = record
        elif isinstance(record, mcap.ChunkIndex):
            self._indexed_offsets.add(record.chunk_start_offset)

    def _describe(self, record: mcap.Schema | mcap.Channel) -> None:
        """Remember a schema or a topic; a second, different one under the same number is an error."""
        known: dict[int, mcap.Schema] | dict[int, mcap.Channel]
        known = self._schemas if isinstance(record, mcap.Schema) else self._channels
        before = known.get(record.id)
        if before is None:
            self._spend(f"{type(record).__name__} records", 1, self._limits.records)
            known[record.id] = record  # type: ignore[assignment]
        elif before != record:
            kind = type(record).__name__.lower()
            self._breach(f"{kind} {record.id}", "is given twice with different content")

    def _open_chunk(self, chunk: mcap.Chunk, offset: int, *, cut: bool = False) -> Iterator[Item]:
        try:
            data = chunk_data(chunk, self._limits, cut=cut)
        except ValueError as error:
            self._damage(f"chunk at byte {offset}", str(error))
            self.bytes_lost += 0 if cut else len(chunk.data)
            return
        try:
            for position, record in chunk_records(data):
                if isinstance(record, mcap.Message):
                    yield self._message(record, offset, position)
                else:
                    self._describe(record)
        except ValueError as error:
            if not cut:  # of a cut chunk the scan has told already
                self._damage(f"chunk at byte {offset}", str(error))

    def _metadata(self, record: mcap.Metadata) -> MetadataItem:
        content: dict[str, str] | Channel | None = None
        try:
            if record.name == RUN:
                content = parse_run(record.metadata)
            elif record.name.startswith(CHANNEL_PREFIX):
                content = parse_channel(record.name.removeprefix(CHANNEL_PREFIX), record.metadata)
        except ValueError as error:
            self._breach(f"metadata {record.name!r:.80}", str(error))
        return MetadataItem(name=record.name, record=record.metadata, content=content)

    def _message(self, raw: mcap.Message, offset: int, position: int) -> MessageItem:
        self._spend("messages", 1, self._limits.messages)
        self._message_counts[raw.channel_id] += 1
        channel = self._channel(raw.channel_id)
        if channel is None:
            place = f"message {self._spent['messages']} (chunk at byte {offset})"
            self._breach(place, f"its topic, number {raw.channel_id}, is not described", once=f"id {raw.channel_id}")
            return MessageItem(
                place=place, at=(offset, position), topic="", known=True, raw=raw, channel=None, schema=None,
                content=None,
            )  # fmt: skip
        number = self._message_counts[raw.channel_id]
        place = f"message {number} of {channel.topic!r:.80} (chunk at byte {offset})"
        schema = self._schema(channel.schema_id)
        wanted, known = _wanted_schema(channel.topic)
        content = self._content(raw, channel, schema, wanted, place) if known else None
        return MessageItem(
            place=place, at=(offset, position), topic=channel.topic, known=known, raw=raw, channel=channel,
            schema=schema, content=content,
        )  # fmt: skip

    def _content(
        self, raw: mcap.Message, channel: mcap.Channel, schema: mcap.Schema | None, wanted: str, place: str
    ) -> SampleBlock | Step | Event | Indicator | None:
        """The decoded message of a topic that the contract defines, or None with the reason reported."""
        once = f"schema {channel.id}"
        if channel.message_encoding != "protobuf" or schema is None or schema.encoding != "protobuf":
            self._breach(place, "is not encoded as protobuf with a schema", once=once)
            return None
        if schema.name != wanted:
            self._breach(place, f"has the schema {schema.name!r:.80}, not {wanted}", once=once)
            return None
        if problem := schema_problem(wanted, schema.data):
            self._breach(place, problem, once=once)
            return None
        name = channel.topic.split("/", 2)[-1]
        try:
            if wanted == SAMPLE_BLOCK:
                self._spend("fields of sample blocks", _BROKEN_BLOCK_FIELDS, self._limits.fields)
                block = decode_block(name, raw.data)
                self._spend("fields of sample blocks", len(block.samples) - _BROKEN_BLOCK_FIELDS, self._limits.fields)
                return block
            self._spend("bytes of steps, events and indicators", len(raw.data), self._limits.text_bytes)
            if wanted == STEP:
                return decode_step(raw.data)
            return decode_event(raw.data) if wanted == EVENT else decode_indicator(name, raw.data)
        except ValueError as error:
            self._breach(place, str(error))
            return None

    def _channel(self, number: int) -> mcap.Channel | None:
        """A topic by its number; where its description was lost with a chunk, the summary's copy."""
        if number not in self._channels and self._damaged:
            self._channels.update({n: c for n, c in self._summary_copies()[1].items() if n not in self._channels})
        return self._channels.get(number)

    def _schema(self, number: int) -> mcap.Schema | None:
        if number not in self._schemas and self._damaged:
            self._schemas.update({n: s for n, s in self._summary_copies()[0].items() if n not in self._schemas})
        return self._schemas.get(number)

    def _summary_copies(self) -> tuple[dict[int, mcap.Schema], dict[int, mcap.Channel]]:
        if self._summary is None:
            self._summary = summary_descriptions(self._stream, self._limits)
        return self._summary

    def _count_lost(self, number: int, count: int) -> None:
        channel = self._channel(number)
        self.messages_lost[channel.topic if channel else f"topic number {number}"] += count

    def _compare_with_summary(self) -> None:
        """Find what vanished without a trace, such as a chunk whose kind was changed to an unknown one."""
        statistics = self._statistics
        if self._damaged or statistics is None:
            return
        counted = self._spent["messages"]
        for what, stated, found in (
            ("messages", statistics.message_count, counted),
            ("chunks", statistics.chunk_count, len(self._chunk_offsets)),
            ("metadata records", statistics.metadata_count, self._spent["metadata records"]),
            ("attachments", statistics.attachment_count, self._spent["attachments"]),
        ):
            if stated != found:
                self._damage("summary", f"counts {stated} {what} where the file holds {found}")
        if strays := self._indexed_offsets - self._chunk_offsets:
            self._damage("summary", f"points to a chunk at byte {min(strays)}, where there is none")


def _wanted_schema(topic: str) -> tuple[str, bool]:
    """The schema the contract fixes for a topic, and whether it defines the topic at all."""
    if topic in ("/procedure", "/events"):
        return (STEP if topic == "/procedure" else EVENT), True
    for prefix, schema in (("/samples/", SAMPLE_BLOCK), ("/indicators/", INDICATOR)):
        if topic.startswith(prefix) and len(topic) > len(prefix):
            return schema, True
    return "", False
