"""Moduli identified from a table of natural frequencies."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from recordings import FrequencyTable, InputError, read_table
from twin.diagnose.effects import with_effects
from twin.identify.eigensensitivity import FrequencyUpdate
from twin.identify.lap_joint_moduli import require_one_joint, update_moduli
from twin.identify.predict import blank_data
from twin.identify.residual_model import ResidualModel
from twin.lab.model_result import IdentifiedModel
from twin.rigs import Rig
from twin.rigs.preloads import known_preload
from twin.views.moduli_report import errors_figure, frequency_table, moduli_page, moduli_sentence, moduli_table
from twin.views.page import Page
from twin.views.table import Table

USUAL_STD = 1e-3
"""Relative uncertainty of a natural frequency whose table does not say it."""


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class IdentifiedModuli(IdentifiedModel):
    """A lap joint's moduli, identified from a table of natural frequencies.

    Attributes
    ----------
    model : Rig
        With the identified moduli.
    assumed : Rig
    preload : str
    update : FrequencyUpdate
    table : FrequencyTable
    warnings : tuple of str
    """

    model: Rig
    nominal: Rig
    preload: str
    update: FrequencyUpdate
    table: FrequencyTable
    warnings: tuple[str, ...]

    @property
    def file(self) -> Rig:
        """The rig file with what was identified."""
        return self.model

    @property
    def sentence(self) -> str:
        """What was identified, in one sentence."""
        return moduli_sentence(self.update)

    def tables(self) -> Sequence[Table]:
        """Moduli, and measured and modelled frequencies."""
        return [moduli_table(self.update, self._nominal()), frequency_table(self.update, self._modes())]

    def page(self) -> Page:
        """The report."""
        return moduli_page(
            self.update, rig=self.nominal.name, table=Path(self.table.path).name, modes=self._modes(),
            nominal=self._nominal(), warnings=self.warnings,
        )  # fmt: skip

    def plot_errors(self) -> Figure:
        """Relative errors of the frequencies, as assumed and as identified."""
        return errors_figure(self.update, self._modes())

    def to_dict(self) -> dict[str, Any]:
        """As ``twin identify --json`` prints it, without the model file's name."""
        values = {key: f"{key}[{self.preload}]" for key in ("normal_modulus", "shear_modulus")}
        error = 100 * (self.update.after[self.preload] / self.table.frequency_Hz - 1)
        return {
            "preload": self.preload,
            "linear": {
                key: {"value": self.update.values[name], "std": self.update.std[name]} for key, name in values.items()
            },
            "nonlinear": {},
            "residual_percent": {f"mode {m}": float(e) for m, e in zip(self._modes(), error, strict=True)},
            "assumed": list(self.assumed),
            "warnings": list(self.warnings),
        }

    def _modes(self) -> list[int]:
        return [int(mode) for mode in self.table.mode]

    def _nominal(self) -> dict[str, float]:
        moduli = self.nominal.moduli(self.preload)[0]
        return {f"{key}[{self.preload}]": getattr(moduli, key) for key in ("normal_modulus", "shear_modulus")}


def identify_moduli(path: str | Path, rig: Rig, *, source: str, preload: str | None) -> IdentifiedModuli:
    """Moduli from a table of natural frequencies.

    Raises
    ------
    InputError
        If the table holds anything else, fewer than two frequencies, or several preloads.
    """
    table = read_table(path)
    if not isinstance(table, FrequencyTable):
        raise InputError(path, "", "holds sweeps, which need a rig of kind modal", "--rig brake-reuss, for example")
    require_one_joint(rig, source=source)
    if len(table) < 2:
        raise InputError(path, "", "holds one natural frequency", "E' and G' need at least two")
    if len(states := dict.fromkeys(table.preload)) > 1:
        raise InputError(path, "column preload", f"holds {', '.join(states)}", "identify each preload by itself")
    if (state := table.preload[0]) and preload not in (None, state):
        raise InputError("--preload", "", f"is {preload}, {path} holds {state}")
    name = known_preload(rig, preload or state or None)
    structure = ResidualModel(with_effects(blank_data(rig, name), source=source)).model.structure
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
    told = np.isfinite(table.std_Hz)
    if not told.all():
        warnings.append(f"frequencies without std_Hz are taken to be good to {100 * USUAL_STD:g} %")
    std_Hz = np.where(told & (table.std_Hz > 0), table.std_Hz, USUAL_STD * table.frequency_Hz)
    update = update_moduli(
        rig, {name: table.frequency_Hz}, std_Hz={name: std_Hz}, numbers={name: table.mode}, structure=structure
    )
    moduli = rig.moduli(name)[0].model_copy(
        update={key: float(update.values[f"{key}[{name}]"]) for key in ("normal_modulus", "shear_modulus")}
    )
    return IdentifiedModuli(
        model=rig.with_moduli(name, [moduli]), nominal=rig, preload=name, update=update, table=table,
        warnings=tuple(warnings),
    )  # fmt: skip
