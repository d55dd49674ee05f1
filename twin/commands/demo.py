"""`twin demo`: the main job from end to end, on a rig in which chance has hidden something."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.table import Table

from recordings.beside import temporary_folder
from recordings.errors import InputError, reason_of
from recordings.staging import staged_folder
from twin.commands.common.options import FILE, causes_option, json_option, overwrite_option
from twin.commands.common.output import console, print_json, say, write_json
from twin.commands.common.served import ServedRig, ServedRigError
from twin.commands.common.stages import Stages

if TYPE_CHECKING:
    from drivers.host import RigAcquisition
    from recordings import Run
    from twin.demo import DemoCase
    from twin.diagnose import Diagnosis
    from twin.procedures import Procedure
    from twin.rigs import Rig

RIG = "steel-lap-joint"
LEAST_MEASURED = 0.5
"""Share of the planned steps without which there is nothing to learn from."""
RESULT, REPORT, VIEW, TRUTH = "result.json", "report.html", "run.rrd", "hidden-rig.toml"
RESULTS = (RESULT, REPORT, VIEW, TRUTH, "broadband.mcap", "run.mcap", "held-out.mcap", "extended.toml", "next.toml")


@click.command()
@click.option("--out", type=FILE, metavar="DIR", help="Folder of the results; demo-SEED.")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), help="Of what is hidden and of the noise; any if left out.")
@click.option("--cause", metavar="NAME", help="Hide this cause, or none, instead of drawing one.")
@overwrite_option
@causes_option
@json_option
def command(out: Path | None, seed: int | None, cause: str | None, overwrite: bool, as_json: bool) -> int:
    """Serve a virtual steel rig, drive it over a serial line and CAN, record, identify, and find what is wrong.

    A cause is drawn and hidden in the rig that the instruments serve.  The client knows the instruments' addresses and
    the rig file as an experimenter believes it; the diagnosis sees the recordings and that file alone.  Ends with
    status 1 where it leaves them unexplained, as twin diagnose does.
    """
    seed = secrets.randbelow(10_000) if seed is None else seed
    if cause not in (None, "none"):
        from twin.bench import EFFECTS

        if cause not in EFFECTS:
            raise InputError("--cause", "", f"no cause {cause!r:.60}", f"one of none, {', '.join(sorted(EFFECTS))}")
    out = out if out is not None else Path(f"demo-{seed}")
    try:
        if out.is_dir() and any(out.iterdir()) and not overwrite:
            raise InputError(out, "", "exists already and is not empty", "give another --out, or --overwrite")
    except OSError as error:
        raise InputError(out, "", reason_of(error)) from error
    with staged_folder(out, results=RESULTS, overwrite=overwrite, recovers=True) as folder:
        try:
            with Stages() as stages:
                result = _demonstrate(folder, seed, cause, stages)
        except ServedRigError as error:
            say(f"twin: {error}")
            return 1  # with what was measured
        result |= {"seconds": stages.elapsed_s, "stages_s": stages.seconds}
        write_json(result, folder / RESULT)
    if as_json:
        print_json(result)
    _tell(result, out)
    return int(not result["found"]["explains"])


def _demonstrate(out: Path, seed: int, cause: str | None, stages: Stages) -> dict[str, Any]:
    stages.begin("serve", "Starting the virtual instruments of the steel rig")
    from twin.demo import draw_demo_case
    from twin.rigs import load_rig, save_rig

    nominal = load_rig(RIG)
    with temporary_folder("twin-demo") as folder, ExitStack() as helpers:
        # The truth lies where the client does not look, and comes to the results when all is said.
        case = draw_demo_case(nominal, seed=seed, cause=cause)
        save_rig(case.rig, folder / TRUTH)
        with ServedRig(folder / TRUTH, folder=folder, seed=seed) as served:
            from twin.diagnose import in_processes, usual_processes  # takes long, while the instruments start

            # The helpers compile what a diagnosis needs while the rig is being measured.
            helpers.enter_context(in_processes(usual_processes()))
            served.wait_ready()
            runs = _measure(served.instruments, nominal, out, stages)
        found = _diagnose(runs, nominal, out, stages)
    return _report(found, case, seed, out, stages)


def _measure(instruments: Path, nominal: Rig, out: Path, stages: Stages) -> dict[str, Run]:
    """Record every run, as `twin acquire` does; what is known of the rig is its file and its instruments."""
    from drivers.host import open_instruments
    from recordings import read_run
    from twin.demo import BROADBAND, HELD_OUT, SWEEPS, broadband, planned_sweeps, resonance

    with open_instruments(instruments) as acquisition:
        stages.say(
            f"A client has opened {_addresses(instruments)}: "
            + ", ".join(f"{c.name} [{c.unit}]".replace("[", r"\[") for c in acquisition.channels)
        )
        stages.begin("broadband", f"Random noise up to 1000 Hz for 60 s of the rig's time, into {BROADBAND}")
        _record(broadband(), acquisition, nominal, out / BROADBAND, stages, steps=0)
        resonance_Hz = resonance(read_run(out / BROADBAND), nominal)
        planned = planned_sweeps(nominal, resonance_Hz)
        stages.begin(
            "sweeps",
            f"Mode 1 shows at {resonance_Hz:.2f} Hz: stepped sines about it at 1.5, 3 and 6 N, into {SWEEPS}, "
            f"and one at 4.5 N to be held out, into {HELD_OUT}",
        )
        total = sum(len(p.amplitudes) * len(p.frequencies) for p in planned.values())
        done = 0
        for name, procedure in planned.items():
            done += _record(procedure, acquisition, nominal, out / name, stages, steps=total, done=done)
    return {name: read_run(out / name) for name in (BROADBAND, SWEEPS, HELD_OUT)}


def _record(
    procedure: Procedure,
    acquisition: RigAcquisition,
    nominal: Rig,
    path: Path,
    stages: Stages,
    *,
    steps: int,
    done: int = 0,
) -> int:
    """Run a procedure on the instruments; how many steps it measured."""
    from drivers.host.transport import LineLostError
    from recordings import RunWriter
    from twin.procedures import dump_procedure, run_procedure
    from twin.rigs import nominal_rig_file, preload_name, preload_record

    told = {"source": "simulated", "rig": nominal.name, "procedure": procedure.procedure, "stored": procedure.store}
    info = told | preload_record(preload_name(nominal))
    attachments = {"rig.toml": nominal_rig_file(nominal), "procedure.toml": dump_procedure(procedure)}
    measured = 0

    def on_step(step: Any) -> None:
        nonlocal measured
        measured += 1
        if steps:
            stages.update(f"{step.sweep}, {step.frequency_Hz:.2f} Hz", (done + measured) / steps)

    def on_time(seconds: float) -> None:
        if not steps:
            stages.update(f"{seconds:.0f} s of the rig's time")

    try:
        with RunWriter(
            path, info=info, channels=acquisition.channels, attachments=attachments, overwrite=True
        ) as writer:
            result = run_procedure(procedure, acquisition, writer, on_step=on_step, progress=on_time)
    except LineLostError as error:
        raise ServedRigError(
            f"the virtual instruments were lost ({error}); what was measured is in {path.name}"
        ) from error
    if result.state == "interrupted":
        raise KeyboardInterrupt
    if result.state != "done" and (not steps or done + measured < LEAST_MEASURED * steps):
        raise ServedRigError(f"the run was {result.state}: {result.reason}; what was measured is in {path.name}")
    if result.state != "done":
        stages.say(f"The guard ended a sweep early: {result.reason}; what was measured till then is used")
    return measured


def _addresses(instruments: Path) -> str:
    from drivers.instruments import read_instruments

    return " and ".join(f"{device.name} at {device.address}" for device in read_instruments(instruments).device)


def _diagnose(runs: dict[str, Run], nominal: Rig, out: Path, stages: Stages) -> Diagnosis:
    from twin.demo import HELD_OUT
    from twin.diagnose import diagnose

    stages.begin("diagnose", "Identifying the rig from the recordings, and looking for what its model gets wrong")
    learn = [run for name, run in runs.items() if name != HELD_OUT]
    return diagnose(learn, nominal, held_out=[runs[HELD_OUT]], out=out, report=stages.turn)


def _report(found: Diagnosis, case: DemoCase, seed: int, out: Path, stages: Stages) -> dict[str, Any]:
    from twin.demo import BROADBAND, HELD_OUT, SWEEPS
    from twin.rigs import save_rig
    from twin.views.reports.diagnosis import diagnosis_page
    from twin.views.rerun.diagnosis import save_diagnosis

    stages.begin("report", "Writing the report and the pictures")
    again = f"twin diagnose {BROADBAND} {SWEEPS} --held-out {HELD_OUT} --rig {RIG} --out diagnosis"
    diagnosis_page(found).write(out / REPORT, commands=[again])
    stages.turn("pictures for rerun")
    save_diagnosis(found, out / VIEW)
    save_rig(case.rig, out / TRUTH)
    return {
        "seed": seed,
        "hidden": case.hidden,
        "found": found.to_dict(),
        "files": {
            "recording": SWEEPS, "broadband": BROADBAND, "held_out": HELD_OUT, "view": VIEW, "report": REPORT,
            "extended_model": found.extended_model, "truth": TRUTH,
        },
    }  # fmt: skip


def _tell(result: Mapping[str, Any], out: Path) -> None:
    """Print the ending of a demonstration whose results lie in `out`."""
    found = result["found"]
    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    rows = {"hidden": _hidden(**result["hidden"]), "found": found["answer"]}
    if found["gain"]:
        rows["gain"] = _gain(found["gain"])
    rows |= {name: str(out / result["files"][name]) for name in ("report", "recording", "view")}
    for name, text in rows.items():
        table.add_row(name, text)
    console.print()
    console.print(table)
    stages = ", ".join(f"{name} {seconds:.0f} s" for name, seconds in result["stages_s"].items())
    say(f"\n{result['seconds']:.0f} s in all ({stages}); the rest is in {out}")


def _hidden(cause: str, parameters: Mapping[str, float | str]) -> str:
    values = ", ".join(f"{k} {v}" if isinstance(v, str) else f"{k} {v:.4g}" for k, v in parameters.items())
    return f"{cause} ({values})" if values else cause


def _gain(gain: dict[str, Any]) -> str:
    before, after, noise_floor = (gain["held_out"][name] for name in ("before", "after", "noise_floor"))
    fold = before / max(after, 1e-12)
    told = f"{fold:.1f} times smaller" if fold > 1.05 else "as it was"
    what = " (fundamental and second harmonic)" if len(gain["by_harmonic"]) > 1 else ""
    return (
        f"error on the held-out sweep{what} {100 * before:.2g} % before, {100 * after:.2g} % after: {told} "
        f"(noise floor {100 * noise_floor:.2g} %)"
    )
