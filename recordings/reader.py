"""Reading a run: strict about the contract, checksums on, within limits."""

from pathlib import Path
from typing import BinaryIO

from recordings.container.collect import Collector
from recordings.container.interpret import Interpreter, MessageItem, Problem
from recordings.container.stored import BlockStore
from recordings.errors import InputError, reason_of
from recordings.limits import Limits
from recordings.run import Run, SampleBlock


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
    path, limits = Path(path), limits or Limits()

    def refuse(problem: Problem) -> None:
        remedy = "'twin check --recover' gets out what is still in it" if problem.kind == "damage" else ""
        if problem.kind != "warning":
            raise InputError(path, problem.place, problem.reason, remedy)

    stream = open_input(path)
    store = BlockStore.owning(path, stream, limits)
    collector = Collector(limits, refuse, store)
    try:
        for item in Interpreter(stream, limits, refuse):
            collector.take(item)
            if isinstance(item, MessageItem) and isinstance(item.content, SampleBlock):
                store.keep(*item.at, item.content.samples)
    except OSError as error:
        raise InputError(path, "", f"cannot read: {reason_of(error)}") from error
    collector.finish()
    found = {name: assembler.finish() for name, assembler in collector.assemblers.items()}
    devices = {name: samples for name, samples in found.items() if samples is not None}
    notices = [event for assembler in collector.assemblers.values() for event in assembler.notices()]
    return Run(
        path=str(path), info=collector.info, channels=collector.channels, devices=devices,
        steps=tuple(sorted(collector.steps, key=lambda step: step.time_ns)),
        events=tuple(sorted([*collector.events, *notices], key=lambda event: event.time_ns)),
        indicators=tuple(collector.indicators), attachments=collector.attachments,
    )  # fmt: skip


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
