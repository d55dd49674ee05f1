"""``twin predict``: the response of an identified model to given frequencies and forces."""

from pathlib import Path

import click

from recordings.whole import check_writable
from twin.commands.common.options import FILE, causes_option, json_option, laws_option, overwrite_option
from twin.commands.common.output import print_json, say, tell_assumed, working


@click.command()
@click.argument("model", metavar="MODEL")
@click.option("--drive", required=True, metavar="DRIVE.csv", type=FILE, help="What to predict.")
@click.option("--out", required=True, metavar="RESPONSE.csv", type=FILE, help="The answer.")
@click.option("--preload", metavar="NAME", help="State of the joint; the model's first if left out.")
@click.option("--shaker", metavar="NAME", help="Which of the model's drives acts; its first if left out.")
@click.option("--channel", metavar="NAME", help="Whose response; that of the file's law, or the farthest out.")
@causes_option
@laws_option
@overwrite_option
@json_option
def command(
    model: str, drive: Path, out: Path, preload: str | None, shaker: str | None, channel: str | None, overwrite: bool,
    as_json: bool,
) -> None:  # fmt: skip
    """Predict the response of MODEL (a rig file, as `twin identify` writes it, or a shipped rig's name).

    DRIVE.csv has the columns frequency_Hz and force_N, or frequency_Hz and acceleration_m_per_s2 for a response that is
    held.  RESPONSE.csv gets one row a solution: several branches at one step where the joint's law folds the response.
    std is the standard deviation of what was not given.
    """
    from twin.identify.backbones.drive_table import read_drive, write_response
    from twin.lab import load_rig

    check_writable(out, overwrite=overwrite)
    with working("predicting"):
        rig = load_rig(model)
        asked = read_drive(drive)
        predicted = rig.predict(
            asked.frequency_Hz, force_N=asked.force_N, acceleration_m_per_s2=asked.acceleration_m_per_s2,
            preload=preload, shaker=shaker, channel=channel,
        )  # fmt: skip
    response = predicted.response
    write_response(response, out)
    tell_assumed(predicted.assumed)
    for warning in predicted.warnings:
        say(f"warning: {warning}")
    rows, branches = len(response.step), response.branches
    if as_json:
        print_json({"rows": rows, "branches": branches, "assumed": predicted.assumed})
    say(f"{rows} solutions, at most {branches} at a step, in {out}")
