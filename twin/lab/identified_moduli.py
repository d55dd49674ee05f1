"""Moduli identified from a table of natural frequencies."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from recordings import FrequencyTable, InputError, read_table
from twin.diagnose.effects import with_effects
from twin.diagnose.tables import felt_causes
from twin.identify.frequency_moduli import FrequencyModuli, fit_moduli, moduli_data
from twin.lab.model_result import IdentifiedModel
from twin.rigs import Rig
from twin.rigs.beam import BeamRig
from twin.views.page import Page
from twin.views.reports.moduli import errors_figure, frequency_table, moduli_page, moduli_sentence, moduli_table
from twin.views.table import Table


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class IdentifiedModuli(IdentifiedModel):
    """A structure's moduli, identified from the table of natural frequencies in the file `table`."""

    found: FrequencyModuli
    table: str
    nominal: Rig | BeamRig
    warnings: tuple[str, ...]

    @property
    def file(self) -> Rig | BeamRig:
        """The rig file with what was identified."""
        model = self.found.model
        return self.nominal.found(model) if isinstance(self.nominal, BeamRig) else model

    @property
    def sentence(self) -> str:
        """What was identified, in one sentence."""
        return moduli_sentence(self.found)

    def tables(self) -> Sequence[Table]:
        """Moduli, and measured and modelled frequencies."""
        return [moduli_table(self.found), frequency_table(self.found)]

    def page(self) -> Page:
        """The report."""
        return moduli_page(self.found, table=Path(self.table).name, warnings=self.warnings)

    def plot_errors(self) -> Figure:
        """Relative errors of the frequencies, as assumed and as identified."""
        return errors_figure(self.found)

    def to_dict(self) -> dict[str, Any]:
        """As ``twin identify --json`` prints it, without the model file's name."""
        found, joints = self.found, self.found.model.joints
        linear: dict[str, Any] = {}
        for name, value in found.moduli.items():
            estimate, kind = {"value": value, "std": found.moduli_std[name]}, name.partition("[")[0]
            if len(joints) > 1:
                linear.setdefault(kind, []).append(estimate)
            else:
                linear[kind if joints else name] = estimate
        return {
            "preload": found.preload if joints else "",
            "linear": linear,
            **({"joints": [joint.name for joint in joints]} if len(joints) > 1 else {}),
            "nonlinear": {},
            "residual_percent": {
                f"mode {mode}": error
                for mode, error in zip(found.mode.tolist(), found.error_percent.tolist(), strict=True)
            },
            "assumed": list(self.assumed),
            "warnings": list(self.warnings),
        }


def identify_moduli(path: str | Path, rig: Rig | BeamRig, *, source: str, preload: str | None) -> IdentifiedModuli:
    """Moduli from a table of natural frequencies.

    Raises
    ------
    InputError
        If the table holds sweeps, or as of :func:`~twin.identify.frequency_moduli.moduli_data`.
    """
    table = read_table(path)
    if not isinstance(table, FrequencyTable):
        raise InputError(path, "", "holds sweeps, which need a rig of kind modal", "--rig brake-reuss, for example")
    structure = rig.structure() if isinstance(rig, BeamRig) else rig
    evidence = with_effects(moduli_data(table, structure, source=source, preload=preload), source=source)
    felt, acting = felt_causes(evidence), dict.fromkeys(effect.cause for effect in rig.effect)
    silent = [f"the effect {name} does not act on natural frequencies here" for name in acting if name not in felt]
    found = fit_moduli(evidence)
    return IdentifiedModuli(found=found, table=str(path), nominal=rig, warnings=(*silent, *found.warnings))
