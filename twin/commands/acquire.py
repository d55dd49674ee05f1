"""`twin acquire`: a procedure on instruments, real or virtual, recorded as it happens."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from recordings.errors import InputError, blamed_on
from recordings.run import StepState
from recordings.whole import refuse_existing
from twin.commands.common.options import FILE, FiniteRange, json_option, laws_option, overwrite_option
from twin.commands.common.output import console, next_step, print_json, progress_bar, say, stage
from twin.commands.common.viewing import Watch, WatchOptions, known_branches, view_options, watched

if TYPE_CHECKING:
    from drivers.host import RigAcquisition
    from recordings import Event, Indicator, RunWriter, SampleBlock, Step
    from recordings.streams import Acquisition
    from twin.procedures import Procedure, ProcedureResult, RunSink, StepResult
    from twin.rigs import Rig


@click.command()
@click.argument("procedure_name", metavar="[PROCEDURE]", required=False)
@click.option("--instruments", required=True, type=FILE, help="Devices and their addresses.")
@click.option("--out", required=True, type=FILE, metavar="RUN", help="The recording to be made.")
@click.option("--rig", "rig_name", metavar="RIG", help="What is assumed of the rig, attached to the recording.")
@click.option("--preload", metavar="NAME", help="The joint's preload, by its name in the rig file.")
@click.option("--seconds", type=FiniteRange(min=0, min_open=True), help="Without a procedure: how long.")
@overwrite_option
@view_options
@laws_option
@json_option
def command(
    procedure_name: str | None,
    instruments: Path,
    out: Path,
    rig_name: str | None,
    preload: str | None,
    seconds: float | None,
    overwrite: bool,
    watch: WatchOptions,
    as_json: bool,
) -> int:
    """Run PROCEDURE (a shipped one's name or a TOML file) on instruments, and record it.

    Without a procedure, record with the generator off, until the instruments end their stream or for --seconds.
    Everything that goes wrong on the way is written to the recording as an event and told at the end.

    A live view never holds the run up: what a slow viewer has no room for is left out of the picture and counted.
    With --rig the sweeps grow over their predicted branches.
    """
    from drivers.host import open_instruments
    from recordings import RunWriter
    from twin.procedures import check_channels, dump_procedure, load_procedure
    from twin.rigs import load_rig
    from twin.views.live.about import LiveAbout

    procedure = load_procedure(procedure_name) if procedure_name is not None else None
    if procedure is not None and seconds is not None:
        raise InputError("--seconds", "", "a procedure has its own duration", "leave one of them out")
    rig = load_rig(rig_name) if rig_name is not None else None
    info, attachments = _beliefs(rig, preload)
    if procedure is not None:
        attachments["procedure.toml"] = dump_procedure(procedure)
        info |= {"procedure": Path(str(procedure_name)).stem, "stored": procedure.store}
        info |= {"drive": procedure.drive} if procedure.drive else {}
    refuse_existing(out, overwrite=overwrite)
    watch.check(overwrite=overwrite)
    branches: list[dict[str, Any]] = []
    if watch.wanted and rig is not None and procedure is not None:
        with console.status("predicting the branches"):
            branches = known_branches(rig.driven_by(procedure.drive), preload, procedure)
    with open_instruments(instruments) as acquisition:
        info["source"] = _origin(acquisition.identity)
        for value, quantity in acquisition.meter_values.values():
            if quantity == "preload" and not {"preload_N", "preload_Nm"} & set(info):
                info["preload_N"] = f"{value:.4g}"
        if procedure is not None:
            check_channels(procedure, acquisition.channels)

        title = " · ".join(info[name] for name in ("rig", "procedure") if info.get(name)) or "Recording"
        about = LiveAbout(
            title=title, channels=tuple(acquisition.channels), procedure=procedure, branches=tuple(branches)
        )
        with blamed_on(instruments, "", "correct the channel in the instruments file"):
            writer = RunWriter(
                out, info=info, channels=acquisition.channels, attachments=attachments, overwrite=overwrite
            )
        sink = _CountingSink(writer, acquisition.take_indicators, procedure)
        with writer:
            try:
                with watched(watch, about) as shown:
                    if procedure is None:
                        state, reason = _record(shown.over(acquisition), shown.over(sink), seconds)
                        ended: dict[str, Any] = {"state": state, "reason": reason, "steps": 0}
                    else:
                        result = _run(procedure, acquisition, sink, shown)
                        ended = {"state": result.state, "reason": result.reason, "steps": len(result.steps)}
                        ended["rig_seconds"] = result.duration_s
                    if watch.wanted:
                        ended["view"] = {"not_shown": shown.not_shown}
            except (InputError, KeyboardInterrupt):
                if not sink.samples:
                    writer.abandon()
                raise
            except TimeoutError as error:
                writer.abandon()
                raise InputError(instruments, "", str(error), "are the instruments still on?") from error
            if ended["state"] == "interrupted" and not sink.samples:
                writer.abandon()
    return _tell(out, sink, ended, as_json)


class _CountingSink:
    """The recording, with a count of what went into it, and what the meters have read meanwhile."""

    def __init__(
        self, writer: RunWriter, take_indicators: Callable[[], Sequence[Indicator]], procedure: Procedure | None
    ) -> None:
        self._writer = writer
        self._hits = getattr(procedure, "hits", 0)
        self._take_indicators = take_indicators
        self.samples: Counter[str] = Counter()
        self.lost: Counter[str] = Counter()
        self.events: Counter[str] = Counter()
        self.first_events: dict[str, Event] = {}
        self._next: dict[str, int] = {}
        self.end_ns = 0
        """Time in the file at which the latest samples end."""

    def write_block(self, block: SampleBlock) -> None:
        """Record a block."""
        self._writer.write_block(block)
        self.samples[block.device] += len(block)
        self.lost[block.device] += block.first_index - self._next.get(block.device, block.first_index)
        self._next[block.device] = block.first_index + len(block)
        self.end_ns = max(self.end_ns, block.end_ns)
        # The file's time may leave out the waits, a meter's does not: of what it read meanwhile the latest stands.
        for indicator in {each.name: each for each in self._take_indicators()}.values():
            self.write_indicator(replace(indicator, time_ns=self.end_ns))

    def write_step(self, step: Step) -> None:
        """Record a step; of an impact test the operator is told where to hit."""
        self._writer.write_step(step)
        if self._hits and step.state == StepState.SETTLING:
            say(f"hit {step.sweep}, {step.index + 1} of {self._hits}")

    def write_event(self, event: Event) -> None:
        """Record an event."""
        self._writer.write_event(event)
        name = f"{event.kind} ({event.source})"
        self.events[name] += 1
        self.first_events.setdefault(name, event)

    def write_indicator(self, indicator: Indicator) -> None:
        """Record an indicator."""
        self._writer.write_indicator(indicator)


def _beliefs(rig: Rig | None, preload: str | None) -> tuple[dict[str, str], dict[str, bytes]]:
    """Metadata and attachments that say what is assumed of the rig."""
    if rig is None:
        if preload is not None:
            raise InputError("--preload", "", "names a preload of a rig file", "add --rig")
        return {}, {}
    from twin.rigs import known_preload, nominal_rig_file, preload_record

    info = {"rig": rig.name, **preload_record(known_preload(rig, preload))}
    return info, {"rig.toml": nominal_rig_file(rig)}


def _origin(identity: str) -> str:
    """The recording's ``source``: virtual instruments say what they are, all others measure."""
    maker, _, serial, *_ = [*identity.split(","), "", "", ""]
    return serial if maker == "Virtual Test Rig" and serial in ("simulated", "replayed") else "measured"


def _run(procedure: Procedure, acquisition: RigAcquisition, sink: _CountingSink, shown: Watch) -> ProcedureResult:
    from twin.procedures import Dwell, Random, planned_steps, run_procedure

    steps, single_s = planned_steps(procedure), None
    if steps == 1 and isinstance(procedure, (Dwell, Random)):  # the only step's time is what is left
        single_s = procedure.duration + (procedure.settle.seconds or 0.0)
    stage(f"running the procedure: {steps} steps")
    with progress_bar() as bar:
        task = bar.add_task("starting", total=single_s or steps)
        passed = 0.0
        where = ""

        def on_time(seconds: float) -> None:
            nonlocal passed
            passed = seconds
            bar.update(task, description=f"{seconds:.0f} s of rig time{where}")
            if single_s is not None:
                bar.update(task, completed=seconds)

        def on_step(step: StepResult) -> None:
            nonlocal where
            where = f", {step.sweep} at {step.frequency_Hz:.2f} Hz"
            on_time(passed)
            if single_s is None:
                bar.advance(task)
            shown.show(step)

        result = run_procedure(procedure, shown.over(acquisition), shown.over(sink), progress=on_time, on_step=on_step)
    for event in acquisition.take_events():  # what ended the run may have been noticed after its last sample
        sink.write_event(replace(event, time_ns=sink.end_ns))
    return result


def _record(acquisition: Acquisition, sink: RunSink, seconds: float | None) -> tuple[str, str]:
    """Record what comes, with the generator off; how it ended, and why if something is wrong."""
    from drivers.host import StreamEndedError

    def drain() -> None:
        for event in acquisition.take_events():
            sink.write_event(event)

    state, reason = "done", ""
    start_ns: int | None = None
    try:
        acquisition.start()
        stage("recording")
        with progress_bar() as bar:
            task = bar.add_task("recording", total=seconds)
            while True:
                for block in acquisition.read(timeout_s=5.0):
                    start_ns = block.time_ns if start_ns is None else start_ns
                    passed_s = (block.time_ns - start_ns) * 1e-9 + len(block) / block.sample_rate_Hz
                    if seconds is None or (block.time_ns - start_ns) * 1e-9 < seconds:
                        sink.write_block(block)
                bar.update(task, completed=passed_s)
                drain()
                if seconds is not None and passed_s >= seconds:
                    break
    except StreamEndedError:
        pass
    except KeyboardInterrupt:
        state = "interrupted"
    except TimeoutError as error:
        state, reason = "aborted", str(error)
    finally:
        acquisition.stop()
        drain()
    return state, reason


def _tell(out: Path, sink: _CountingSink, ended: dict[str, Any], as_json: bool) -> int:
    for name, count in sink.events.items():
        event = sink.first_events[name]
        say(f"{count} x {name}, first at {event.time_ns * 1e-9:.3f} s: {event.detail}")
    total = sum(sink.samples.values())
    if as_json:
        counted = {"samples": dict(sink.samples), "lost_samples": dict(sink.lost), "events": dict(sink.events)}
        print_json({**ended, "recording": out, **counted})
    outcome = f"{ended['state']}: {ended['reason']}" if ended["reason"] else ended["state"]
    say(f"{outcome}; {ended['steps']} steps, {total} samples in {out}")
    if total:
        next_step(f"twin check {shlex.quote(str(out))}, or twin view {shlex.quote(str(out))}")
    return 0 if ended["state"] == "done" else 1
