"""Everything that a cut or damaged recording still holds, as a sound file."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from google.protobuf.unknown_fields import UnknownFieldSet
from mcap.writer import CompressionType, Writer

from recordings.check import CheckReport, check_run
from recordings.container.collect import Collector
from recordings.container.interpret import AttachmentItem, Interpreter, MessageItem, MetadataItem
from recordings.container.messages import decode_block, decode_event, decode_step, encode_event
from recordings.container.metadata import RUN, run_record
from recordings.container.schema import EVENT, SAMPLE_BLOCK, STEP, message_class, schema_data
from recordings.container.stored import BlockStore
from recordings.errors import InputError
from recordings.limits import Limits
from recordings.reader import open_input
from recordings.run import Event, SampleBlock, Step
from recordings.whole import refuse_existing, whole_file

UNSOUND = "/unsound"
"""Topics of messages that break the contract begin with this in the recovered file: kept, but not read."""
CHUNK_BYTES = 1 << 20


@dataclass(frozen=True, kw_only=True)
class RecoverReport:
    """What became of a damaged file: messages kept by topic, what is known to be lost, and how the new file is."""

    path: str
    kept: dict[str, int]
    set_aside: dict[str, int]
    messages_lost: dict[str, int]
    bytes_lost: int
    notes: tuple[str, ...]
    sound: bool


def recover(
    path: str | Path, out: str | Path, *, limits: Limits | None = None, overwrite: bool = False
) -> RecoverReport:
    """Write what is complete in a file to a new one, with an event that says what was recovered and what was lost.

    Messages keep their bytes, times and topics, unknown topics too; those that break the contract are set aside
    under ``/unsound``.  A chunk whose checksum is wrong is left out: nobody can tell which of its numbers changed.

    Parameters
    ----------
    path
        The damaged file; it is not changed.
    out
        The file to be made, another than `path`.
    overwrite
        Whether it may replace a file that is there.

    Raises
    ------
    InputError
        If `path` cannot be read or is no MCAP file, `out` exists already, is `path` or cannot be written.
    """
    path, out, limits = Path(path), Path(out), limits or Limits()
    report = check_run(path, limits=limits)
    if out.exists() and out.samefile(path):
        raise InputError(out, "", "is the damaged file itself", "give another name")
    refuse_existing(out, overwrite=overwrite)
    with whole_file(out) as part:
        with part.open("xb") as target, open_input(path) as source:
            salvage = _Salvage(source, target, report, limits)
            salvage.run()
        sound = check_run(part, limits=limits).sound
    return RecoverReport(
        path=str(out), kept=dict(salvage.kept), set_aside=dict(salvage.set_aside), bytes_lost=report.bytes_lost,
        messages_lost=report.messages_lost, notes=tuple(salvage.notes), sound=sound,
    )  # fmt: skip


class _Salvage:
    """One pass over a damaged file, copying what is sound."""

    def __init__(self, source: BinaryIO, target: BinaryIO, report: CheckReport, limits: Limits) -> None:
        self._source, self._report, self._limits = source, report, limits
        self._known = {channel.name: channel.device for channel in report.channels}
        self._writer = Writer(
            target, chunk_size=CHUNK_BYTES, compression=CompressionType.LZ4, enable_data_crcs=True
        )  # fmt: skip
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._topics: dict[tuple[str, str, int], int] = {}
        self._metadata: set[str] = set()
        self._attachments: set[str] = set()
        self._first_ns, self._last_ns = 1 << 63, 0
        self.kept: Counter[str] = Counter()
        self.set_aside: Counter[str] = Counter()
        self.notes: list[str] = []

    def run(self) -> None:
        """Copy all of it."""
        self._writer.start(library="virtual-test-rig")
        load = BlockStore(Path(self._report.path), self._source, self._limits)
        checker = Collector(self._limits, lambda problem: None, load)
        for item in Interpreter(self._source, self._limits, lambda problem: None):
            fits = checker.take(item)
            if isinstance(item, MetadataItem):
                self._copy_metadata(item)
            elif isinstance(item, AttachmentItem):
                self._copy_attachment(item)
            else:
                self._copy_message(item, fits)
        if not self._report.info:
            self._invent_run_record()
        self._tell()
        self._writer.finish()

    def _copy_metadata(self, item: MetadataItem) -> None:
        """The first record of a name; a broken ``run`` or channel record is kept under another name."""
        broken = item.content is None and (item.name == RUN or item.name.startswith("channel/"))
        name = f"unsound/{item.name}" if broken or item.name in self._metadata else item.name
        if broken:
            self.notes.append(f"metadata {item.name!r:.80} breaks the contract and was set aside")
        if name not in self._metadata:
            self._metadata.add(name)
            self._writer.add_metadata(name, item.record)

    def _copy_attachment(self, item: AttachmentItem) -> None:
        if item.name not in self._attachments:
            self._attachments.add(item.name)
            self._writer.add_attachment(0, 0, item.name, item.media_type, item.data)

    def _copy_message(self, item: MessageItem, fits: bool) -> None:
        topic, encoding = item.topic, item.channel.message_encoding if item.channel else ""
        schema = (item.schema.name, item.schema.encoding, item.schema.data) if item.schema else None
        content = item.content
        if item.channel is None and (guess := self._guess(item.raw.data)) is not None:
            topic, name, content = guess
            encoding, schema = "protobuf", (name, "protobuf", schema_data())
        described = not isinstance(content, SampleBlock) or all(
            self._known.get(channel) == content.device for channel in content.samples
        )
        if item.known and (content is None or not fits or not described):
            topic = f"{UNSOUND}{topic or f'/{item.raw.channel_id}'}"
            self.set_aside[topic] += 1
        else:
            self.kept[topic] += 1
            self._first_ns = min(self._first_ns, item.raw.log_time)
            self._last_ns = max(self._last_ns, item.raw.log_time)
        self._writer.add_message(
            self._topic(topic, encoding, schema), log_time=item.raw.log_time, data=item.raw.data,
            publish_time=item.raw.publish_time, sequence=item.raw.sequence,
        )  # fmt: skip

    def _topic(self, topic: str, encoding: str, schema: tuple[str, str, bytes] | None) -> int:
        number = 0
        if schema is not None:
            if schema not in self._schemas:
                self._schemas[schema] = self._writer.register_schema(*schema)
            number = self._schemas[schema]
        if (topic, encoding, number) not in self._topics:
            self._topics[topic, encoding, number] = self._writer.register_channel(topic, encoding, number)
        return self._topics[topic, encoding, number]

    def _guess(self, data: bytes) -> tuple[str, str, SampleBlock | Step | Event] | None:
        """Topic, schema and content of a message whose topic was lost, where its bytes leave no doubt."""
        try:
            block = decode_block("", data)
            devices = {self._known.get(channel) for channel in block.samples}
            device = devices.pop()
            if not devices and device is not None:
                topic = f"/samples/{device}"
                return topic, SAMPLE_BLOCK, decode_block(device, data)
        except ValueError:
            pass
        readers: tuple[tuple[str, str, Callable[[bytes], Step | Event]], ...] = (
            ("/procedure", STEP, decode_step),
            ("/events", EVENT, decode_event),
        )
        for topic, name, decode in readers:
            try:
                content = decode(data)
            except ValueError:
                continue
            if not len(UnknownFieldSet(message_class(name).FromString(data))):
                return topic, name, content
        return None

    def _invent_run_record(self) -> None:
        """What the contract asks for where the file's own record is gone; marked as invented."""
        note = "the run record was lost: source, rig and procedure are not known"
        self._writer.add_metadata(RUN, run_record(self._first_ns if self.kept else 0, recovered=note))
        self.notes.append(note)

    def _tell(self) -> None:
        """The event that says what happened to the file."""
        damage = [f"{each.place}: {each.reason}" for each in self._report.problems if each.kind == "damage"]
        lost = ", ".join(f"{count} of {topic}" for topic, count in self._report.messages_lost.items())
        aside = ", ".join(f"{count} in {topic}" for topic, count in self.set_aside.items())
        parts = [f"{sum(self.kept.values())} messages recovered"]
        parts.append(f"{self._report.bytes_lost} bytes could not be read" + (f", with messages {lost}" if lost else ""))
        parts += [f"set aside: {aside}"] if aside else []
        parts += self.notes + damage[:20]
        parts += [f"and {len(damage) - 20} more places"] if len(damage) > 20 else []
        event = Event(time_ns=self._last_ns, source="recovery", kind="recovered", detail="; ".join(parts))
        self._writer.add_message(
            self._topic("/events", "protobuf", (EVENT, "protobuf", schema_data())), log_time=self._last_ns,
            data=encode_event(event), publish_time=self._last_ns,
        )  # fmt: skip
