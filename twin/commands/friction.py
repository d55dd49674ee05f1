"""``twin friction``: a friction joint's law from measured loops of force over displacement."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from recordings.errors import InputError
from twin.commands.common.options import FILE, FiniteRange, json_option
from twin.commands.common.output import print_json, print_tables, working

if TYPE_CHECKING:
    from twin.identify.friction_loops import FrictionFit, FrictionIdentification

R2_WANTED = 0.97


@click.command()
@click.argument("loops", metavar="LOOP...", nargs=-1, required=True, type=FILE)
@click.option(
    "--cutoff", default=10.0, show_default=True, type=FiniteRange(0.0, min_open=True), metavar="HZ",
    help="Loops are compared below it: above, a slow drive's frame rings.",
)  # fmt: skip
@json_option
def command(loops: tuple[Path, ...], cutoff: float, as_json: bool) -> None:
    """Choose among Jenkins, Iwan and Jenkins with backlash by evidence, and fit the law to all LOOPs together.

    A LOOP is one test at one clamp tension, the lowest tension first: CSV with the columns time_s, displacement_m and
    force_N, or a JSON table of the ARTS laboratory's friction damper.  Stiffness, backlash and spread are shared by all
    loops; the slip forces are each loop's own.
    """
    from twin.identify.friction_loops import identify_friction
    from twin.identify.loop_files import read_loop

    read = [read_loop(path) for path in loops]
    names = [loop.name for loop in read]
    if len(set(names)) < len(names):
        raise InputError(loops[0], "", f"the loops' names are not unique: {', '.join(names)}", "rename the files")
    if cutoff >= min(loop.sample_rate for loop in read) / 2:
        raise InputError("--cutoff", "", f"{cutoff:g} Hz is not below half of the sample rate")
    with working("fitting three laws"):
        found = identify_friction(read, cutoff_Hz=cutoff)
    result = _result(found, names)
    if as_json:
        print_json(result)
    else:
        _tell(found, result)


def _result(found: FrictionIdentification, names: list[str]) -> dict[str, Any]:
    best = found.best
    mean = [float(np.mean(best.slip_force_N[name])) for name in names]
    std = [float(np.hypot(*best.slip_force_std_N[name]) / 2) for name in names]
    return {
        "law": best.law,
        "laws": [asdict(fit) for fit in found.fits],
        "r2": best.r2,
        "left_out_r2": found.left_out_r2,
        "slip_force_N": {n: {"value": v, "std": s} for n, v, s in zip(names, mean, std, strict=True)},
        "slip_force_rises": bool(np.all(np.diff(mean) > 0)),
        "one_law_holds": bool(min(found.left_out_r2.values(), default=0.0) >= R2_WANTED),
    }


def _tell(found: FrictionIdentification, result: dict[str, Any]) -> None:
    from twin.views.table import Table

    laws = [(fit.law, _shared(fit), f"{min(fit.r2.values()):.4f}", f"{fit.bic:.0f}") for fit in found.fits]
    best = found.best
    loops = [
        (
            name, f"{up:.0f}", f"{down:.0f}", f"{best.r2[name]:.4f}", f"{best.r2_unfiltered[name]:.4f}",
            f"{found.left_out_r2[name]:.4f}" if name in found.left_out_r2 else "",
        )
        for name, (up, down) in best.slip_force_N.items()
    ]  # fmt: skip
    head = ("loop", "slip force + (N)", "slip force - (N)", "R2", "R2 unfiltered", "R2, shared from the others")
    print_tables(
        Table(
            caption="Laws (BIC: lower is better supported)", head=("law", "shared", "least R2", "BIC"), rows=laws,
            numbers=(2, 3),
        ),
        Table(caption=f"{best.law}, loop by loop", head=head, rows=loops, numbers=range(1, 6)),
    )  # fmt: skip
    if len(best.slip_force_N) > 1:
        rises = "rises" if result["slip_force_rises"] else "does not rise"
        holds = "holds" if result["one_law_holds"] else "does not hold"
        click.echo(f"The slip force {rises} from loop to loop; one law with the slip force as its only change {holds}.")


def _shared(fit: FrictionFit) -> str:
    from twin.identify.estimate import Estimate

    return ", ".join(f"{name} {Estimate(value, fit.shared_std[name])}" for name, value in fit.shared.items())
