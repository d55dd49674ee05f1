"""What is wrong with a recording, all of it, and what is in it."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recordings.container.collect import Collector
from recordings.container.interpret import Interpreter, MessageItem, Problem
from recordings.container.records import MAGIC
from recordings.container.stored import BlockStore
from recordings.errors import InputError, reason_of
from recordings.limits import Limits
from recordings.reader import open_input
from recordings.run import SampleBlock

PROBLEM_LIMIT = 1000
"""Problems told one by one; the rest are counted."""


@dataclass(frozen=True, kw_only=True)
class ChannelReport:
    """What a file holds of one channel: samples received, lost, on the converter's limit, not finite."""

    name: str
    device: str
    quantity: str
    unit: str
    samples: int
    lost: int
    gaps: int
    overload: int
    not_finite: int


@dataclass(frozen=True, kw_only=True)
class CheckReport:
    """The result of checking one file.

    A file is `sound` if nothing in it is damaged or breaks the contract; warnings do not count.  `messages_lost`
    has the topics of messages that are known to be lost; more may be, `bytes_lost` tells how much could not be read.
    """

    path: str
    sound: bool
    problems: tuple[Problem, ...]
    problems_not_listed: int
    info: dict[str, str]
    channels: tuple[ChannelReport, ...]
    messages: dict[str, int]
    steps: int
    events: dict[str, int]
    duration_s: float
    bytes_lost: int
    messages_lost: dict[str, int]


def check_run(path: str | Path, *, limits: Limits | None = None) -> CheckReport:
    """Check a file against the recording contract; damage in it is reported, not raised.

    Raises
    ------
    InputError
        If the file cannot be read, or is no MCAP file at all.
    """
    path, limits = Path(path), limits or Limits()
    problems: list[Problem] = []
    counted = 0

    def report(problem: Problem) -> None:
        nonlocal counted
        counted += 1
        if len(problems) < PROBLEM_LIMIT:
            problems.append(problem)

    messages: Counter[str] = Counter()
    not_finite: Counter[str] = Counter()
    with open_input(path) as stream:
        collector = Collector(limits, report, BlockStore(path, stream, limits))
        interpreter = Interpreter(stream, limits, report)
        try:
            for item in interpreter:
                taken = collector.take(item)
                if isinstance(item, MessageItem):
                    messages[item.topic or f"topic number {item.raw.channel_id}"] += 1
                    if taken and isinstance(item.content, SampleBlock):
                        for name, values in item.content.samples.items():
                            not_finite[name] += int(np.count_nonzero(~np.isfinite(values)))
        except OSError as error:
            raise InputError(path, "", f"cannot read: {reason_of(error)}") from error
        stream.seek(0)
        begins_well = stream.read(len(MAGIC)) == MAGIC
    if not interpreter.records and not begins_well:
        raise InputError(path, "", "is not an MCAP file")
    collector.finish()
    channels = _channels(collector, not_finite)
    broken = any(problem.kind != "warning" for problem in problems)
    for warning in _warnings(collector, channels):
        report(warning)
    return CheckReport(
        path=str(path), sound=not broken, problems=tuple(problems), problems_not_listed=counted - len(problems),
        info=collector.info, channels=channels, messages=dict(messages), steps=len(collector.steps),
        events=dict(Counter(event.kind for event in collector.events)), duration_s=_duration_s(collector),
        bytes_lost=interpreter.bytes_lost, messages_lost=dict(interpreter.messages_lost),
    )  # fmt: skip


def _channels(collector: Collector, not_finite: Counter[str]) -> tuple[ChannelReport, ...]:
    counts: dict[str, int] = {}
    overload: dict[str, int] = {}
    lost: dict[str, tuple[int, int]] = {}
    for name, assembler in collector.assemblers.items():
        counts.update(assembler.counts())
        overload.update(assembler.overload())
        gaps = assembler.gaps()
        lost[name] = sum(gap.count for gap in gaps), len(gaps)
    return tuple(
        ChannelReport(
            name=channel.name, device=channel.device, quantity=channel.quantity, unit=channel.unit,
            samples=counts.get(channel.name, 0), lost=lost.get(channel.device, (0, 0))[0],
            gaps=lost.get(channel.device, (0, 0))[1], overload=overload.get(channel.name, 0),
            not_finite=not_finite[channel.name],
        )
        for channel in collector.channels.values()
    )  # fmt: skip


def _warnings(collector: Collector, channels: tuple[ChannelReport, ...]) -> list[Problem]:
    """What the contract allows, but somebody should know."""
    found = []
    for channel in channels:
        for count, what in (
            (channel.lost, f"samples lost in {channel.gaps} gaps"),
            (channel.overload, "samples on the converter's limit"),
            (channel.not_finite, "samples are not finite numbers"),
        ):
            if count:
                found.append(Problem(kind="warning", place=channel.name, reason=f"{count} {what}"))
        if not channel.samples:
            found.append(Problem(kind="warning", place=channel.name, reason="no samples of this channel"))
    for assembler in collector.assemblers.values():
        for event in assembler.notices():
            found.append(Problem(kind="warning", place=event.source, reason=f"{event.kind}: {event.detail}"))
    if not collector.steps:
        found.append(Problem(kind="warning", place="/procedure", reason="no message tells what the test was doing"))
    return found


def _duration_s(collector: Collector) -> float:
    spans = [span for each in collector.assemblers.values() if (span := each.span_ns()) is not None]
    return (max(end for _, end in spans) - min(start for start, _ in spans)) * 1e-9 if spans else 0.0
