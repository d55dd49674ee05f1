"""``twin identify``: a model file from recordings, or from tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from recordings.errors import InputError
from twin.commands.output import console, json_option, print_json, working

if TYPE_CHECKING:
    from recordings import FrequencyTable
    from twin.identify.identified import Identified, Polynomials
    from twin.identify.polynomial_law import PolynomialFit
    from twin.rigs import Rig

__all__ = ["command"]

USUAL_s = 20.0
"""What recordings take on two cores."""


@click.command(short_help="Identify E', G' and the joint's nonlinear law from recordings.")
@click.argument("runs", metavar="RUN...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--rig", "rig_name", required=True, metavar="RIG", help="A shipped rig's name or a TOML file.")
@click.option("--preload", metavar="NAME", help="State of the joint; what the recordings name if left out.")
@click.option("--out", required=True, metavar="MODEL", type=click.Path(path_type=Path), help="The model, TOML.")
@json_option
def command(runs: tuple[Path, ...], rig_name: str, preload: str | None, out: Path, as_json: bool) -> None:
    """Identify the model of a rig from RUNs.

    Recordings (.mcap): broadband runs and stepped sines together give the layer's moduli, the modal damping and the
    joint's law.  A table of natural frequencies (.csv) gives the moduli; a table of sweeps gives the law of a rig of
    kind modal, such as brake-reuss.
    """
    from twin.rigs.modal import is_modal_rig

    if not out.parent.is_dir():
        raise InputError(out, "", "its folder does not exist")
    tables = [path for path in runs if path.suffix.lower() == ".csv"]
    if is_modal_rig(rig_name):
        result = _from_sweep_table(runs, rig_name, preload, out)
    elif not tables:
        result = _from_recordings(runs, rig_name, preload, out)
    elif len(runs) == 1:
        result = _from_frequencies(runs[0], rig_name, preload, out)
    else:
        raise InputError(tables[0], "", "a table is identified by itself", "give it as the only RUN")
    for warning in result["warnings"]:
        console.print(f"warning: {warning}", soft_wrap=True)
    if as_json:
        print_json(result)
    else:
        _tell(result)
    console.print(f"model in {out}")


def _from_recordings(paths: Sequence[Path], rig_name: str, preload: str | None, out: Path) -> dict[str, Any]:
    from recordings import read_run
    from twin.bench import open_bench
    from twin.diagnose.effects import effects_extension, unmodelled_effects
    from twin.identify.evidence import gather_evidence
    from twin.identify.identified import identify_rig
    from twin.rigs import foreign_preload, load_rig

    rig = load_rig(rig_name)
    _need_preload(rig, preload)
    with working("reading", usual_s=USUAL_s) as say:
        runs = [read_run(path) for path in paths]
        say("reducing the runs to responses")
        evidence = gather_evidence(runs, rig, preload=preload)
        extension = effects_extension(evidence, rig.effect, source=rig_name)
        found = identify_rig(evidence, extension, report=say)
    _write_rig(found.rig, out)
    warnings = [
        f"the effect {cause} acts on recordings only and is left out" for cause in unmodelled_effects(rig.effect)
    ]
    try:
        open_bench(found.rig)
    except ValueError as error:
        warnings.append(f"the model predicts, but 'twin rehearse' cannot march it in time: {error}")
    if (foreign := foreign_preload(rig, runs[0].info)) and preload is None:
        warnings.append(foreign)
    return {
        "preload": found.preload,
        "linear": {
            name: [asdict(e) for e in entry] if isinstance(entry, list) else asdict(entry)
            for name, entry in found.linear.items()
        },
        "nonlinear": _nonlinear(found),
        "residual_percent": found.residual_percent,
        "chi2_per_dof": found.chi2_per_dof,
        "model": str(out),
        "warnings": [*warnings, *found.warnings],
    }


def _from_sweep_table(paths: Sequence[Path], rig_name: str, preload: str | None, out: Path) -> dict[str, Any]:
    from twin.identify.modal_table import identify_sweep_table
    from twin.rigs.modal import load_modal_rig, save_modal_rig

    if len(paths) != 1 or paths[0].suffix.lower() != ".csv":
        raise InputError(paths[0], "", "a rig of kind modal is identified from one table of sweeps (.csv)")
    if preload is not None:
        raise InputError(rig_name, "--preload", "a modal rig has no preloads")
    model = identify_sweep_table(paths[0], load_modal_rig(rig_name))
    _write(lambda path: save_modal_rig(model, path), out)
    assert model.law is not None
    law = model.law
    linear = {
        "natural_frequency_Hz": {"value": law.frequency_Hz[0], "std": law.frequency_std_Hz[0]},
        "damping_ratio": {
            "value": law.damping_ratio[0], "std": law.damping_ratio[0] * law.damping_relative_std[0]
        },
        "modal_mass_kg": {"value": law.modal_mass_kg, "std": None},
    }  # fmt: skip
    return {
        "linear": linear,
        "nonlinear": {"law": law.model_dump(), "levels": [level.model_dump() for level in model.level]},
        "residual_percent": {level.level: 100 * level.left_out_force_rms for level in model.level},
        "model": str(out),
        "warnings": list(model.note),
    }


def _from_frequencies(path: Path, rig_name: str, preload: str | None, out: Path) -> dict[str, Any]:
    import numpy as np

    from recordings import FrequencyTable, read_table
    from twin.rigs import load_rig

    table = read_table(path)
    if not isinstance(table, FrequencyTable):
        raise InputError(path, "", "holds sweeps, which need a rig of kind modal", "--rig brake-reuss, for example")
    if len(table) < 2:
        raise InputError(path, "", "holds one natural frequency", "E' and G' need at least two")
    if len(states := dict.fromkeys(table.preload)) > 1:
        raise InputError(path, "column preload", f"holds {', '.join(states)}", "identify each preload by itself")
    if (state := table.preload[0]) and preload not in (None, state):
        raise InputError("--preload", "", f"is {preload}, {path} holds {state}")
    rig, preload = load_rig(rig_name), preload or state or None
    _need_preload(rig, preload)
    name = rig.preload_name(preload)
    values, std, model_Hz, warnings = _moduli(rig, rig_name, name, table)
    moduli = rig.joint.preload[name].model_copy(update=values)
    joint = rig.joint.model_copy(update={"preload": {**rig.joint.preload, name: moduli}})
    _write_rig(rig.model_copy(update={"joint": joint}), out)
    error = 100 * (model_Hz / table.frequency_Hz - 1)
    if not np.isfinite(table.std_Hz).all():
        warnings.append("frequencies without std_Hz are taken to be good to 0.1 %")
    return {
        "preload": name,
        "linear": {key: {"value": value, "std": std[key]} for key, value in values.items()},
        "nonlinear": {},
        "residual_percent": {f"mode {m}": e for m, e in zip(table.mode.tolist(), error.tolist(), strict=True)},
        "model": str(out),
        "warnings": warnings,
    }


def _moduli(
    rig: Rig, rig_name: str, preload: str, table: FrequencyTable
) -> tuple[dict[str, float], dict[str, float], Any, list[str]]:
    """Moduli and their standard deviations, the model's frequencies, and warnings."""
    import numpy as np

    from twin.diagnose.effects import effects_extension
    from twin.identify.lap_joint_moduli import update_moduli
    from twin.identify.predict import blank_evidence
    from twin.identify.prediction import Predictor

    evidence = blank_evidence(rig, preload)
    extension = effects_extension(evidence, rig.effect, source=rig_name)
    structure = Predictor(evidence, extension).model.structure
    for effect in rig.effect:
        if effect.cause == "added-mass":
            position, mass = effect.parameters["position_m"], effect.parameters["mass_kg"]
            structure = structure.with_point_mass(float(position), float(mass))
    acting = {"added-mass", "beam-modulus", "clamp-compliance", "transverse-shear", "joint-uneven"}
    warnings = [
        f"the effect {effect.cause} does not act on natural frequencies here"
        for effect in rig.effect
        if effect.cause not in acting
    ]
    std_Hz = np.where(np.isfinite(table.std_Hz) & (table.std_Hz > 0), table.std_Hz, 1e-3 * table.frequency_Hz)
    update = update_moduli(
        rig, {preload: table.frequency_Hz}, std_Hz={preload: std_Hz}, numbers={preload: table.mode},
        structure=structure,
    )  # fmt: skip
    names = {key: f"{key}[{preload}]" for key in ("normal_modulus", "shear_modulus")}
    values = {key: float(update.values[name]) for key, name in names.items()}
    std = {key: float(update.std[name]) for key, name in names.items()}
    return values, std, np.asarray(update.after[preload]), warnings


def _nonlinear(found: Identified) -> dict[str, Any]:
    law = found.rig.joint.law
    assert law is not None
    result: dict[str, Any] = {"law": law.model_dump(exclude={"channel"}), "channel": law.channel}
    if found.polynomials is not None:
        result |= _polynomials(found.polynomials)
    return result


def _polynomials(found: Polynomials) -> dict[str, Any]:
    return {
        "polynomials": {name: _fit(fit) for name, fit in found.levels.items()} | {"all": _fit(found.together)},
        "residual_percent": found.residual_percent,
    }


def _fit(fit: PolynomialFit) -> dict[str, Any]:
    curve = fit.l_curve
    return {
        "g1": {"coefficients": fit.softening, "std": fit.std[0], "order": fit.orders[0]},
        "g2": {"coefficients": fit.loss, "std": fit.std[1], "order": fit.orders[1]},
        "covariance": fit.covariance,
        "bic": fit.bic,
        "largest_amplitude_m": fit.largest_amplitude_m,
        "residual_percent": fit.residual_percent,
        "l_curve": {
            "lambda": curve.strength, "rho": curve.residual_norm, "eta": curve.solution_norm,
            "corner": curve.corner, "cross_validated": curve.cross_validated,
        },
        "history": [
            {"cost": step.cost, "g1": step.softening, "g2": step.loss, "lambda": step.strength} for step in fit.history
        ],
    }  # fmt: skip


def _need_preload(rig: Rig, preload: str | None) -> None:
    try:
        rig.preload_name(preload)
    except KeyError as error:
        raise InputError("--preload", "", str(error.args[0])) from error


def _write_rig(rig: Rig, out: Path) -> None:
    from twin.rigs import save_rig

    _write(lambda path: save_rig(rig, path), out)


def _write(save: Callable[[Path], None], out: Path) -> None:
    """The file appears whole or not at all."""
    part = out.with_name(out.name + ".part")
    try:
        save(part)
        part.replace(out)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise InputError(out, "", (error.strerror or str(error)).lower()) from error


def _tell(result: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    out = Console(highlight=False)
    table = Table(title="Linear")
    for heading in ("parameter", "value", "std"):
        table.add_column(heading, justify="left" if heading == "parameter" else "right")
    for name, entry in result["linear"].items():
        several = isinstance(entry, list)
        for number, one in enumerate(entry if several else [entry], 1):
            std = "" if one["std"] is None else f"{one['std']:.2g}"
            table.add_row(f"{name} {number}" if several else name, f"{one['value']:.4g}", std)
    out.print(table)
    polynomial = result["nonlinear"].get("residual_percent", {})
    table = Table(title="Residual (%)")
    for heading in ("", "model", "polynomials of its level", "polynomials of all levels"):
        table.add_column(heading, justify="right" if heading else "left")
    for name, value in result["residual_percent"].items():
        beside = polynomial.get(name, {})
        cells = [f"{beside[key]:.2f}" if key in beside else "" for key in ("level", "together")]
        table.add_row(name, f"{value:.3f}", *cells)
    out.print(table)
