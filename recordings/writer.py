"""Writing a run to MCAP while it happens, so that a killed program loses at most half a second."""

import atexit
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

from mcap.writer import CompressionType, Writer

from recordings.container.messages import encode_block, encode_event, encode_indicator, encode_step
from recordings.container.metadata import CHANNEL_PREFIX, RUN, channel_record, parse_channel, parse_run
from recordings.container.opening import Opening
from recordings.container.schema import EVENT, INDICATOR, SAMPLE_BLOCK, STEP, schema_data
from recordings.container.uninterrupted import UNINTERRUPTED
from recordings.errors import InputError, reason_of
from recordings.run import Channel, Event, Indicator, SampleBlock, Step

CHUNK_BYTES = 64 << 10
FLUSH_SECONDS = 0.15
"""Blocks of an acquisition are up to 0.3 s long: with the one that is under way, less than half a second is lost."""
_COMPRESSION = {"lz4": CompressionType.LZ4, "none": CompressionType.NONE}


class RunWriter:
    """Writes one run; use it in a ``with`` statement.

    The file gets its name when metadata and attachments are in it and flushed: what interrupts the constructor leaves
    nothing behind, and what ends the program in an orderly way after it leaves a finished file.  A chunk is closed at
    64 KiB, and at the latest after 150 ms by a thread of its own, whether or not anything more is written.  Leaving
    the ``with`` block by an exception still finishes the file: what was recorded stays readable.  A file that is
    overwritten stays as it was until the new one is finished.

    Parameters
    ----------
    path
        The file to be made.
    info
        The ``run`` metadata record: at least ``source`` (measured, simulated, replayed).  ``format``, ``started``
        (now), ``rig`` and ``procedure`` (empty) are filled in.
    channels
        Every channel that blocks will hold, in order.
    attachments
        Name to content, ``rig.toml`` and ``procedure.toml``.
    compression
        ``lz4`` or ``none``; noise hardly compresses, silence does.
    overwrite
        Replace an existing file instead of refusing.
    reproducible
        The same messages give the same bytes: chunks are closed by their size and with every step, not by time, and
        the run has started when its device's time begins.  For what is computed, and can be computed again.

    Raises
    ------
    InputError
        If the file exists, or cannot be made or written (read-only folder, full disk); the same from every method.
    ValueError
        If `info`, a channel or a message breaks the recording contract: the caller's mistake.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        info: Mapping[str, str],
        channels: Sequence[Channel],
        attachments: Mapping[str, bytes] | None = None,
        compression: Literal["lz4", "none"] = "lz4",
        overwrite: bool = False,
        reproducible: bool = False,
    ) -> None:
        self.path = Path(path)
        self._channels = {channel.name: channel for channel in channels}
        if len(self._channels) != len(channels):
            raise ValueError("two channels have the same name")
        now = datetime.fromtimestamp(0, UTC) if reproducible else datetime.now(UTC)
        started = now.isoformat(timespec="milliseconds").replace("+00:00", "Z")
        self._flush_s = threading.TIMEOUT_MAX if reproducible else FLUSH_SECONDS
        filled = {"format": "1", "rig": "", "procedure": "", "started": started, **info}
        parse_run(filled)
        records = {f"{CHANNEL_PREFIX}{channel.name}": channel_record(channel) for channel in channels}
        for name, record in records.items():
            parse_channel(name.removeprefix(CHANNEL_PREFIX), record)
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._failure: InputError | None = None
        self._topics: dict[str, int] = {}
        self._counts: dict[int, int] = {}
        self._placed = False
        self._opening = opening = Opening(self.path, overwrite=overwrite)
        try:
            self._in_place(opening.start)
            self._stream = opening.stream
            self._writer = Writer(
                self._stream, chunk_size=CHUNK_BYTES, compression=_COMPRESSION[compression], enable_data_crcs=True
            )
            self._guarded(lambda: self._begin(filled, records, attachments or {}))
            UNINTERRUPTED.install(self)
            self._in_place(opening.place)
            self._placed = not opening.replaces
            self._flushed_at = time.monotonic()
            self._flusher = threading.Thread(target=self._flush_regularly, name="run-writer-flush", daemon=True)
            self._flusher.start()
            atexit.register(self.close)  # an interrupt may come before the caller's `with` has begun
        except BaseException:
            self._closed.set()
            UNINTERRUPTED.remove(self)
            opening.abandon()
            raise

    def write_block(self, block: SampleBlock) -> None:
        """Record a block of samples; its channels must have been announced for its device."""
        for name in block.samples:
            channel = self._channels.get(name)
            if channel is None or channel.device != block.device:
                raise ValueError(f"channel {name!r} of device {block.device!r} was not announced to the writer")
        if len(block):
            self._write(f"/samples/{block.device}", SAMPLE_BLOCK, block.time_ns, encode_block(block))

    def write_step(self, step: Step) -> None:
        """Record the start of a state of a step."""
        self._write("/procedure", STEP, step.time_ns, encode_step(step))
        if self._flush_s > FLUSH_SECONDS:
            self.flush()

    def write_event(self, event: Event) -> None:
        """Record a thing that went wrong or changed."""
        self._write("/events", EVENT, event.time_ns, encode_event(event))

    def write_indicator(self, indicator: Indicator) -> None:
        """Record one value for viewers, on the topic of its name."""
        topic = f"/indicators/{indicator.name}"
        self._write(topic, INDICATOR, indicator.time_ns, encode_indicator(indicator))

    def flush(self) -> None:
        """Hand everything written so far to the operating system."""
        with UNINTERRUPTED, self._lock:
            self._guarded(self._flush)

    def close(self) -> None:
        """Write the summary and close; calling it again does nothing."""
        try:
            self._close()
        finally:
            UNINTERRUPTED.remove(self)

    def _close(self) -> None:
        with UNINTERRUPTED, self._lock:
            if self._closed.is_set():
                return
            self._closed.set()
            atexit.unregister(self.close)
            failed_before = self._failure is not None
            try:
                if not failed_before:
                    self._guarded(self._finish)
            finally:
                self._drop_stream()
                if self._failure is None:
                    self._guarded(self._opening.finish)
        self._flusher.join()
        if failed_before:
            assert self._failure is not None
            raise self._failure

    def abandon(self) -> None:
        """Give the recording up, as nothing was measured: what it was to replace stays, and nothing else is left."""
        with UNINTERRUPTED, self._lock:
            self._closed.set()
            atexit.unregister(self.close)
            self._opening.abandon()
        self._flusher.join()
        UNINTERRUPTED.remove(self)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        except InputError:
            if not isinstance(error, InputError):  # the first report of the same trouble is already on its way
                raise

    def _in_place(self, action: Callable[[], None]) -> None:
        """Do something to the file's name."""
        try:
            action()
        except FileExistsError as error:
            raise InputError(self.path, "", "exists already", "give another name, or --overwrite") from error
        except OSError as error:
            raise self._as_input_error(error) from error

    def _begin(
        self, info: Mapping[str, str], records: Mapping[str, Mapping[str, str]], attachments: Mapping[str, bytes]
    ) -> None:
        """Write what must survive anything that happens later."""
        self._writer.start(library="virtual-test-rig")
        self._writer.add_metadata(RUN, dict(info))
        for name, record in records.items():
            self._writer.add_metadata(name, dict(record))
        for name, content in attachments.items():
            kind = "application/toml" if name.endswith(".toml") else "application/octet-stream"
            self._writer.add_attachment(create_time=0, log_time=0, name=name, media_type=kind, data=content)
        self._schemas = {
            name: self._writer.register_schema(name, "protobuf", schema_data())
            for name in (SAMPLE_BLOCK, STEP, EVENT, INDICATOR)
        }
        for device in dict.fromkeys(channel.device for channel in self._channels.values()):
            self._topic(f"/samples/{device}", SAMPLE_BLOCK)
        self._topic("/procedure", STEP)
        self._topic("/events", EVENT)
        self._stream.flush()

    def _topic(self, topic: str, schema: str) -> int:
        """The MCAP channel of a topic, registered at its first use."""
        if topic not in self._topics:
            self._topics[topic] = self._writer.register_channel(topic, "protobuf", self._schemas[schema])
            self._counts[self._topics[topic]] = 0
        return self._topics[topic]

    def _write(self, topic: str, schema: str, time_ns: int, data: bytes) -> None:
        with UNINTERRUPTED, self._lock:
            if self._closed.is_set():
                raise ValueError("the writer is closed")
            self._guarded(lambda: self._add(topic, schema, time_ns, data))

    def _add(self, topic: str, schema: str, time_ns: int, data: bytes) -> None:
        channel = self._topic(topic, schema)
        sequence = self._counts[channel]
        self._writer.add_message(channel, log_time=time_ns, publish_time=time_ns, data=data, sequence=sequence)
        self._counts[channel] = (sequence + 1) & 0xFFFFFFFF
        if time.monotonic() - self._flushed_at >= self._flush_s:
            self._flush()

    def _flush(self) -> None:
        self._writer.flush()
        self._flushed_at = time.monotonic()

    def _flush_regularly(self) -> None:
        """In a thread: flush also when nothing comes any more."""
        while not self._closed.wait(self._flush_s):
            with self._lock:
                if self._failure is None and not self._closed.is_set():
                    try:
                        self._guarded(self._flush)
                    except InputError:
                        return  # kept in _failure; the next call of any method reports it

    def _finish(self) -> None:
        self._writer.finish()
        self._stream.flush()

    def _guarded(self, action: Callable[[], None]) -> None:
        """Run `action`; trouble with the file is remembered, so that no later call can pass over it."""
        if self._failure is not None:
            raise self._failure
        try:
            action()
        except OSError as error:
            self._failure = self._as_input_error(error)
            raise self._failure from error

    def _as_input_error(self, error: OSError) -> InputError:
        reason = reason_of(error)
        remedy = "what was written before can be had by 'twin check --recover'" if self._placed else ""
        return InputError(self.path, "", f"cannot be written: {reason}", remedy)

    def _drop_stream(self) -> None:
        """Close without a second error: after a full disk, closing tries to write the same bytes again."""
        try:
            self._stream.close()
        except OSError as error:
            if self._failure is None:
                self._failure = self._as_input_error(error)
                raise self._failure from error
