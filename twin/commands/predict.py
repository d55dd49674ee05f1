"""``twin predict``: the response of an identified model to given frequencies and forces."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from recordings.errors import InputError
from twin.commands.output import console, json_option, print_json, working

if TYPE_CHECKING:
    from twin.identify.modal_prediction import ModalResponse

__all__ = ["command"]


@click.command(short_help="Predict responses to given frequencies and forces.")
@click.argument("model", metavar="MODEL")
@click.option("--drive", required=True, metavar="DRIVE.csv", type=click.Path(path_type=Path), help="What to predict.")
@click.option("--out", required=True, metavar="RESPONSE.csv", type=click.Path(path_type=Path), help="The answer.")
@click.option("--preload", metavar="NAME", help="State of the joint; the model's first if left out.")
@json_option
def command(model: str, drive: Path, out: Path, preload: str | None, as_json: bool) -> None:
    """Predict the response of MODEL (a rig file, as `twin identify` writes it, or a shipped rig's name).

    DRIVE.csv has the columns frequency_Hz and force_N, or frequency_Hz and acceleration_m_per_s2 for a response that is
    held.  RESPONSE.csv gets one row a solution: several branches at one step where the joint's law folds the response.
    std is the standard deviation of what was not given.
    """
    from twin.identify.modal_table import predict_drive, write_response
    from twin.rigs.modal import is_modal_rig, load_modal_rig

    if not out.absolute().parent.is_dir():
        raise InputError(out, "", "its folder does not exist")
    warnings: list[str] = []
    with working("predicting", usual_s=6.0):
        if is_modal_rig(model):
            if preload is not None:
                raise InputError(model, "--preload", "a modal model has no preloads")
            response = predict_drive(load_modal_rig(model), drive, source=model)
        else:
            response, warnings = _rig_response(model, drive, preload)
    write_response(response, out)
    for warning in warnings:
        console.print(f"warning: {warning}", soft_wrap=True)
    rows, branches = len(response.step), response.branches
    if as_json:
        print_json({"rows": rows, "branches": branches})
    console.print(f"{rows} solutions, at most {branches} at a step, in {out}")


def _rig_response(model: str, drive: Path, preload: str | None) -> tuple[ModalResponse, list[str]]:
    from twin.diagnose.effects import left_out_effects, with_effects
    from twin.identify.drive_table import read_drive
    from twin.identify.predict import RigResponse, blank_evidence
    from twin.rigs import load_rig

    rig = load_rig(model)
    try:
        evidence = blank_evidence(rig, preload)
    except KeyError as error:
        raise InputError("--preload", "", str(error.args[0])) from error
    law = rig.joint.law
    if law is not None and law.channel not in evidence.channels:
        raise InputError(
            model, "joint.law.channel", f"no response sensor is called {law.channel!r}",
            f"the rig has {', '.join(evidence.channels)}",
        )  # fmt: skip
    warnings = left_out_effects(rig.effect)
    if law is None:
        warnings.append("the model has no joint law, so its response is linear; see 'twin identify'")
    asked = read_drive(drive)
    response = RigResponse(with_effects(evidence, source=model))
    if asked.force_N is not None:
        return response.forced(asked.frequency_Hz, asked.force_N), warnings
    assert asked.acceleration_m_per_s2 is not None
    return response.held(asked.frequency_Hz, asked.acceleration_m_per_s2), warnings
