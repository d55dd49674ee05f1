"""`twin rehearse`: a procedure on the twin, faster than real time."""

from __future__ import annotations

import math
import re
import sys
import time
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from recordings.errors import InputError
from recordings.staging import staged_folder
from twin.commands.common.options import FILE, causes_option, json_option, laws_option, overwrite_option
from twin.commands.common.output import next_step, plain, print_json, say, stage, tell_assumed, typed, write_json
from twin.commands.common.rehearsing import Meter, run_here, run_in_parallel
from twin.commands.common.viewing import WatchOptions, known_branches, view_options, watched

if TYPE_CHECKING:
    from recordings.streams import SampleSource
    from twin.procedures import Procedure, StepResult
    from twin.rehearsal import Caution, Rehearsed
    from twin.rigs import Rig

RESULTS = ("run.mcap", "improved.mcap", "procedure.toml", "result.json", "report.html")


@click.command()
@click.argument("procedure", metavar="PROCEDURE")
@click.option("--rig", "rig_name", required=True, metavar="RIG", help="A shipped rig's name or a TOML file.")
@click.option("--out", required=True, metavar="DIR", type=FILE, help="Folder of the results.")
@click.option(
    "--preload", "preloads", multiple=True, metavar="NAME",
    help="State of the joint; the rig's first if left out.  Several are rehearsed side by side, each in DIR/NAME.",
)  # fmt: skip
@click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, show_default=True, help="Of the noise.")
@click.option(
    "--rounds", type=click.IntRange(0, 20), default=5, show_default=True, help="Most improvements; 0 for none."
)
@overwrite_option
@view_options
@causes_option
@laws_option
@json_option
def command(
    procedure: str,
    rig_name: str,
    out: Path,
    preloads: tuple[str, ...],
    seed: int,
    rounds: int,
    overwrite: bool,
    watch: WatchOptions,
    as_json: bool,
) -> int:
    """Rehearse PROCEDURE (a shipped procedure's name or a TOML file) on the twin of RIG.

    Writes run.mcap, report.html, result.json with every step and warning, and procedure.toml: the procedure improved
    until its rehearsal (improved.mcap) raises no warning, or unchanged where there was none.  Ends with status 1 if the
    procedure must not be run as it is: a guard ended it, or a converter was overloaded.

    A live view shows the procedure as it was asked for, not its improvements, and never holds the rehearsal up.
    """
    parts = _parts(preloads)
    jobs = [
        _Job(procedure=procedure, rig=rig_name, preload=name, seed=seed, rounds=rounds, written=out, watch=watch)
        for name, _ in parts
    ]
    if watch.wanted and len(jobs) > 1:
        raise InputError("--preload", "", "is given more than once", "watch the rehearsal of one preload at a time")
    watch.check(overwrite=overwrite)
    asked = {job.prepare()[0].procedure for job in jobs}.pop()
    several = [str(part) for _, part in parts if len(parts) > 1]
    with staged_folder(out, results=[*RESULTS, *several], overwrite=overwrite, recovers=True) as folder:
        jobs = [replace(job, written=folder / part) for job, (_, part) in zip(jobs, parts, strict=True)]
        for job in jobs:
            job.written.mkdir(exist_ok=True)
        results = [run_here(jobs[0])] if not several else run_in_parallel(jobs, several)
        result: dict[str, Any] = results[0]
        if several:
            result = {"preloads": {r["preload"]: r for r in results}}
            write_json(result, folder / "result.json")
    if as_json:
        print_json(result)
    if any("interrupted" in _states(one) for one in results):
        say(f"interrupted; what was rehearsed is in {out}")
        sys.exit(130)
    say(f"results in {out}")
    ready = out / parts[0][1] / "procedure.toml"
    if asked == "impact":
        next_step(f"twin modes {ready.with_name('run.mcap')} --rig {rig_name}")
    next_step(f"open {ready.with_name('report.html')}; on the rig, twin acquire {ready} --instruments FILE --out RUN")
    return int(any(one["must_not_run"] for one in results))


@dataclass(frozen=True, kw_only=True)
class _Job:
    """One procedure on one state of the rig."""

    procedure: str
    rig: str
    preload: str | None
    seed: int
    rounds: int
    written: Path
    """The folder of the results, as long as they are made."""
    watch: WatchOptions
    again: str = field(default_factory=typed)

    def prepare(self, better: Procedure | None = None) -> tuple[Procedure, Rig, SampleSource]:
        """Everything that can be wrong is found here, before anything is written; `better` is run in place of it."""
        from twin.procedures import load_procedure
        from twin.rehearsal import open_twin
        from twin.rigs import load_rig
        from twin.rigs.preloads import known_preload

        asked = better or load_procedure(self.procedure)
        rig = load_rig(self.rig).driven_by(asked.drive)
        preload = known_preload(rig, self.preload)
        return asked, rig, open_twin(
            rig, asked, preload=preload, seed=self.seed, source=self.rig, named=self.procedure
        )  # fmt: skip

    def run(self, meter: Meter) -> dict[str, Any]:
        """Rehearse, improve, write; returns what went into result.json."""
        from twin.procedures import save_procedure
        from twin.rehearsal import NominalRig, rehearse, rehearse_until_clear, result_table
        from twin.rigs import preload_name
        from twin.rigs.assumed import assumed
        from twin.views.live.about import LiveAbout
        from twin.views.reports.rehearsal import noise_sentence, rehearsal_page

        asked, rig, source = self.prepare()
        preload = preload_name(rig, self.preload)
        stage("predicting the branches")
        branches = known_branches(rig, preload, asked)
        nominal = NominalRig.of(rig, preload=preload, branches=branches)
        about = LiveAbout(
            title=f"{rig.name} · {Path(self.procedure).stem}, rehearsed", channels=tuple(source.channels),
            procedure=asked, branches=tuple(branches),
            window_s=120.0,  # the rig's time passes hundreds of times as fast as the wall's
        )  # fmt: skip
        meter.begin("rehearsing", asked)
        with watched(self.watch, about) as watch:
            started = time.perf_counter()

            def on_step(step: StepResult) -> None:
                meter.step(step)
                watch.show(step)

            first = rehearse(
                asked, source, self.written / "run.mcap", nominal=nominal, on_step=on_step, progress=meter.time,
                watch=watch.both,
            )  # fmt: skip
            wall_s = time.perf_counter() - started
        better = None
        if self.rounds:
            better = rehearse_until_clear(
                first, lambda better: self.prepare(better)[2], self.written / "improved.mcap",
                rounds=self.rounds, on_step=meter.step, progress=meter.time, on_round=partial(meter.begin, "improving"),
            )  # fmt: skip
        tell_assumed(assumed(rig))
        _tell(preload, first, wall_s)
        if better is not None:
            _tell("improved procedure", better, None)
        if self.rounds and (left := (better or first).remaining):
            say(("not cleared by changing the procedure", "yellow"), f": {', '.join(left)}")
        save_procedure((better or first).rehearsal.procedure, self.written / "procedure.toml")
        result: dict[str, Any] = plain(result_table(
            first, better, procedure=self.procedure, rig=rig, preload=preload, seed=self.seed, branches=branches
        ))  # fmt: skip
        write_json(result, self.written / "result.json")
        for noise in (result["improved"] or result)["noise"]:
            say(f"  {noise_sentence(noise)}")
        rehearsal_page(result).write(self.written / "report.html", commands=[self.again])
        return result


def _parts(preloads: tuple[str, ...]) -> list[tuple[str | None, Path]]:
    """Each preload with its folder in that of the results."""
    if len(preloads) < 2:
        return [(preloads[0] if preloads else None, Path())]
    for name in preloads:
        if not re.fullmatch(r"[\w.+-]+", name) or name.startswith("."):
            raise InputError("--preload", "", f"{name!r} cannot name a folder", "rehearse it by itself")
    return [(name, Path(name)) for name in dict.fromkeys(preloads)]


def _states(result: dict[str, Any]) -> set[str]:
    return {result["state"], (result["improved"] or result)["state"]}


def _tell(title: str, rehearsed: Rehearsed, wall_s: float | None) -> None:
    from twin.views.reports.rehearsal import counted_notes

    result = rehearsed.rehearsal.result
    speed = f", rehearsed in {wall_s:.1f} s" if wall_s is not None else ""
    say((title, "bold"), f": {len(result.steps)} steps, {result.duration_s / 60:.1f} min on the rig{speed}")
    if result.state != "done":
        say((result.state, "red"), f": {result.reason}")
    for summary in rehearsed.rehearsal.summaries():
        say(
            f"  {summary.sweep}: peak at {summary.peak_frequency_Hz:g} Hz, "
            f"{summary.response_channel} {summary.peak_response:.4g}"
            + (f", Q {summary.quality_factor:.3g}" if math.isfinite(summary.quality_factor) else "")
        )
    for caution in rehearsed.cautions:
        _say_caution(caution)
    if rehearsed.clear:
        say(("no warnings" + counted_notes(len(rehearsed.cautions)), "green"))


def _say_caution(caution: Caution) -> None:
    colour = {"stop": "red", "warning": "yellow", "note": "cyan"}[caution.severity]
    where = f" ({caution.place})" if caution.sweep else ""
    say((caution.kind, colour), f"{where}: {caution.reason}; {caution.advice}")
