"""`twin rehearse`: a procedure on the twin, faster than real time."""

from __future__ import annotations

import math
import re
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from recordings.errors import InputError
from twin.commands.output import console, json_option, print_json, progress_bar, write_json

if TYPE_CHECKING:
    from twin.procedures import Procedure
    from twin.rehearsal import Caution, Rehearsed
    from twin.rigs import Rig

__all__ = ["command"]


@click.command()
@click.argument("procedure", metavar="PROCEDURE")
@click.option("--rig", "rig_name", required=True, metavar="RIG", help="A shipped rig's name or a TOML file.")
@click.option("--out", required=True, metavar="DIR", type=click.Path(path_type=Path), help="Folder of the results.")
@click.option("--preload", metavar="NAME", help="State of the joint; the rig's first if left out.")
@click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, show_default=True, help="Of the noise.")
@click.option(
    "--rounds", type=click.IntRange(0, 20), default=5, show_default=True, help="Most improvements; 0 for none."
)
@json_option
def command(
    procedure: str, rig_name: str, out: Path, preload: str | None, seed: int, rounds: int, as_json: bool
) -> int:
    """Rehearse PROCEDURE (a shipped procedure's name or a TOML file) on the twin of RIG.

    Writes run.mcap, result.json with every step and warning, and procedure.toml: the procedure improved until its
    rehearsal (improved.mcap) raises no warning, or unchanged where there was none.  Ends with status 1 if the procedure
    must not be run as it is: a guard ended it, or a converter was overloaded.
    """
    from twin.bench import open_bench
    from twin.procedures import check_channels, load_procedure, save_procedure
    from twin.rehearsal import Believed, rehearse, rehearse_until_clear, rehearsed_table
    from twin.rigs import load_rig

    asked, rig = load_procedure(procedure), load_rig(rig_name)
    _check_preload(rig, preload)
    believed = Believed(
        rig_name=rig.name,
        rig_file=_rig_bytes(rig),
        preload_N=_preload_newtons(rig.preload_name(preload)),
        damping_ratio=min(rig.damping.modal_ratio),
        bits=rig.acquisition.bits,
    )

    def make_source() -> Any:
        try:
            return open_bench(rig, preload=preload, seed=seed, sample_rate_Hz=asked.sample_rate)
        except ValueError as error:
            raise InputError(rig_name, "", str(error)) from error

    source = make_source()
    check_channels(asked, source.channels, source=procedure)
    _make_folder(out)
    started = time.perf_counter()
    with _Meter("rehearsing", asked) as meter:
        first = rehearse(asked, source, out / "run.mcap", believed=believed, on_step=meter.step, progress=meter.time)
    wall_s = time.perf_counter() - started
    _tell(first, wall_s)
    result: dict[str, Any] = {
        "procedure": procedure,
        "rig": rig.name,
        "preload": rig.preload_name(preload),
        "seed": seed,
        **rehearsed_table(first),
        "wall_s": wall_s,
        "improved": None,
    }
    better: Rehearsed | None = None
    if rounds and not first.clear and first.rehearsal.result.state != "interrupted":
        with _Meter("improving", asked) as meter:
            better = rehearse_until_clear(
                first, make_source, out / "improved.mcap", believed=believed, rounds=rounds,
                on_step=meter.step, progress=meter.time, on_round=meter.restart,
            )  # fmt: skip
    if better is not None:
        result["improved"] = rehearsed_table(better)
        console.print("[bold]Improved procedure[/bold]")
        _tell(better, None)
    save_procedure((better or first).rehearsal.procedure, out / "procedure.toml")
    write_json(result, out / "result.json")
    if as_json:
        print_json(result)
    if "interrupted" in (first.rehearsal.result.state, better.rehearsal.result.state if better else ""):
        console.print(f"interrupted; what was rehearsed is in {out}")
        sys.exit(130)
    console.print(f"results in {out}")
    return 1 if first.must_not_run or first.rehearsal.result.state == "aborted" else 0


class _Meter:
    """Progress of one rehearsal on standard error."""

    def __init__(self, title: str, procedure: Procedure) -> None:
        self._bar = progress_bar()
        self._task = self._bar.add_task(title)
        self._title, self._procedure = title, procedure

    def __enter__(self) -> _Meter:
        self._bar.start()
        self.restart(self._procedure)
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def restart(self, procedure: Procedure) -> None:
        """Another procedure begins."""
        from twin.procedures import planned_steps

        self._bar.reset(self._task, total=planned_steps(procedure))

    def step(self, _: object) -> None:
        """One step more is measured."""
        self._bar.advance(self._task)

    def time(self, seconds: float) -> None:
        """Rig time that has passed."""
        self._bar.update(self._task, description=f"{self._title}, {seconds / 60:.1f} min of rig time")


def _tell(rehearsed: Rehearsed, wall_s: float | None) -> None:
    result = rehearsed.rehearsal.result
    speed = f", rehearsed in {wall_s:.1f} s" if wall_s is not None else ""
    console.print(f"{len(result.steps)} steps, {result.duration_s / 60:.1f} min on the rig{speed}")
    if result.state != "done":
        console.print(f"[red]{result.state}[/red]: {result.reason}")
    for summary in rehearsed.rehearsal.summaries():
        console.print(
            f"  {summary.sweep}: peak at {summary.peak_frequency_Hz:g} Hz, "
            f"{summary.response_channel} {summary.peak_response:.4g}"
            + (f", Q {summary.quality_factor:.3g}" if math.isfinite(summary.quality_factor) else "")
        )
    for caution in rehearsed.cautions:
        console.print(_line(caution))
    if rehearsed.clear:
        console.print("[green]no warnings[/green]")


def _line(caution: Caution) -> str:
    colour = {"stop": "red", "warning": "yellow", "note": "cyan"}[caution.severity]
    where = f"{caution.sweep}, step {caution.index}" + (
        f" at {caution.frequency_Hz:g} Hz" if caution.frequency_Hz else ""
    )
    return f"[{colour}]{caution.kind}[/{colour}] ({where}): {caution.reason}; {caution.advice}"


def _rig_bytes(rig: Rig) -> bytes:
    import tomli_w

    return tomli_w.dumps(rig.model_dump(exclude_none=True, exclude_defaults=True)).encode()


def _check_preload(rig: Rig, preload: str | None) -> None:
    try:
        rig.preload_name(preload)
    except KeyError as error:
        raise InputError("--preload", "", str(error.args[0])) from error


def _preload_newtons(name: str) -> float | None:
    """120 for "120N"; None for other names."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?) ?N", name)
    return float(found[1]) if found else None


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("--out", str(out), (error.strerror or str(error)).lower()) from error
