"""Reading a run: strict about the contract, checksums on, within limits."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

from recordings.assemble import Assembler
from recordings.errors import InputError
from recordings.interpret import AttachmentItem, Interpreter, MessageItem, MetadataItem, Problem
from recordings.limits import Limits
from recordings.metadata import RUN
from recordings.run import Channel, Event, Indicator, Run, SampleBlock, Step

__all__ = ["open_input", "read_run"]


def read_run(path: str | Path, *, limits: Limits | None = None) -> Run:
    """Read a run that keeps the recording contract.

    What is noticed about the order and the times of blocks is added to the run's events with the kinds ``order``,
    ``duplicate``, ``restart`` and ``time``.

    Parameters
    ----------
    path
        An MCAP file.
    limits
        What the file may cost; the defaults of `Limits` if None.

    Raises
    ------
    InputError
        With the record and the reason, if the file cannot be read, is damaged, or breaks the contract.
    """
    path = Path(path)
    with open_input(path) as stream:
        return _Collector(path, stream, limits or Limits()).run()


def open_input(path: Path) -> BinaryIO:
    """Open a file for reading; whatever hinders it is an InputError."""
    try:
        if not path.exists():
            raise InputError(path, "", "there is no such file")
        if not path.is_file():
            raise InputError(path, "", "is not a file")
        return path.open("rb")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(path, "", f"cannot read: {reason.lower()}") from error


class _Collector:
    """Gathers the items of one file into a `Run`."""

    def __init__(self, path: Path, stream: BinaryIO, limits: Limits) -> None:
        self._path, self._stream, self._limits = path, stream, limits
        self._info: dict[str, str] | None = None
        self._channels: dict[str, Channel] = {}
        self._metadata: dict[str, dict[str, str]] = {}
        self._attachments: dict[str, bytes] = {}
        self._assemblers: dict[str, Assembler] = {}
        self._device_of: dict[str, str] = {}
        self._steps: list[Step] = []
        self._events: list[Event] = []
        self._indicators: list[Indicator] = []

    def run(self) -> Run:
        """Read all of it."""
        try:
            for item in Interpreter(self._stream, self._limits, self._refuse):
                if isinstance(item, MessageItem):
                    self._message(item)
                elif isinstance(item, MetadataItem):
                    self._take_metadata(item)
                else:
                    self._attachment(item)
        except OSError as error:
            raise InputError(self._path, "", f"cannot read: {(error.strerror or str(error)).lower()}") from error
        if self._info is None:
            self._breach("metadata 'run'", "is missing")
        devices = {}
        for name, device in self._device_of.items():
            if name not in self._channels:
                self._breach(f"metadata 'channel/{name:.80}'", f"is missing, though /samples/{device:.80} holds it")
            if self._channels[name].device != device:
                stated = self._channels[name].device
                self._breach(
                    f"metadata 'channel/{name}'", f"says device {stated!r:.80}, its samples are of {device!r:.80}"
                )
        for name, assembler in self._assemblers.items():
            try:
                devices[name] = assembler.finish()
            except ValueError as error:
                self._breach(f"/samples/{name}", str(error))
            self._events += assembler.notices
        assert self._info is not None
        return Run(
            path=str(self._path), info=self._info, channels=self._channels, devices=devices,
            steps=tuple(sorted(self._steps, key=lambda step: step.time_ns)),
            events=tuple(sorted(self._events, key=lambda event: event.time_ns)),
            indicators=tuple(self._indicators), attachments=self._attachments,
        )  # fmt: skip

    def _refuse(self, problem: Problem) -> None:
        if problem.kind == "damage":
            remedy = "'twin check --recover' gets out what is still in it"
            raise InputError(self._path, problem.place, problem.reason, remedy)
        if problem.kind == "contract":
            self._breach(problem.place, problem.reason)

    def _breach(self, place: str, reason: str) -> None:
        raise InputError(self._path, place, reason)

    def _take_metadata(self, item: MetadataItem) -> None:
        if self._metadata.setdefault(item.name, item.record) != item.record:
            self._breach(f"metadata {item.name!r:.80}", "is given twice with different content")
        if isinstance(item.content, Channel):
            self._channels[item.content.name] = item.content
        elif item.name == RUN:
            self._info = item.content

    def _attachment(self, item: AttachmentItem) -> None:
        if self._attachments.setdefault(item.name, item.data) != item.data:
            self._breach(f"attachment {item.name!r:.80}", "is given twice with different content")

    def _message(self, item: MessageItem) -> None:
        content = item.content
        if isinstance(content, SampleBlock):
            self._block(content, item.place)
        elif isinstance(content, Step):
            self._steps.append(content)
        elif isinstance(content, Event):
            self._events.append(content)
        elif isinstance(content, Indicator):
            self._indicators.append(content)

    def _block(self, block: SampleBlock, place: str) -> None:
        for name in block.samples:
            if self._device_of.setdefault(name, block.device) != block.device:
                self._breach(place, f"channel {name!r:.80} is also one of device {self._device_of[name]!r:.80}")
        if len(self._device_of) > self._limits.records:
            self._breach(place, f"more than {self._limits.records} channels, the limit of this program")
        assembler = self._assemblers.setdefault(block.device, Assembler(block.device, self._limits))
        try:
            assembler.add(block)
        except ValueError as error:
            self._breach(place, str(error))
        if sum(each.values_held for each in self._assemblers.values()) > self._limits.values:
            self._breach(place, f"more than {self._limits.values} samples, the limit of this program")
