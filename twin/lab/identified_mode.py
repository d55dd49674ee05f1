"""One mode identified from a table of sweeps."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from twin.identify.modal_table import identify_sweep_table
from twin.lab.model_result import IdentifiedModel
from twin.rigs.modal import ModalRig
from twin.views.page import Page
from twin.views.reports.mode import mode_figure, mode_page, mode_sentence, mode_table
from twin.views.table import Table


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class IdentifiedMode(IdentifiedModel):
    """One mode that depends on its amplitude, identified from a table of sweeps."""

    model: ModalRig
    table: str

    @property
    def file(self) -> ModalRig:
        """The rig file with what was identified."""
        return self.model

    @property
    def sentence(self) -> str:
        """What was identified, in one sentence."""
        return mode_sentence(self.model)

    def tables(self) -> Sequence[Table]:
        """Every sweep by itself, and predicted from all others."""
        return [mode_table(self.model)]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know beside it."""
        return tuple(self.model.note)

    def page(self) -> Page:
        """The report."""
        return mode_page(self.model, table=Path(self.table).name)

    def plot_law(self) -> Figure:
        """Resonance and damping ratio against amplitude, with one standard deviation."""
        return mode_figure(self.model)

    def to_dict(self) -> dict[str, Any]:
        """As ``twin identify --json`` prints it, without the model file's name."""
        law = self.model.law
        assert law is not None
        damping = law.damping_ratio[0]
        return {
            "linear": {
                "natural_frequency_Hz": {"value": law.frequency_Hz[0], "std": law.frequency_std_Hz[0]},
                "damping_ratio": {"value": damping, "std": damping * law.damping_relative_std[0]},
                "modal_mass_kg": {"value": law.modal_mass_kg, "std": None},
            },
            "nonlinear": {"law": law.model_dump(), "levels": [level.model_dump() for level in self.model.level]},
            "residual_percent": {level.level: 100 * level.left_out_force_rms for level in self.model.level},
            "assumed": list(self.assumed),
            "warnings": list(self.warnings),
        }


def identify_mode(path: str | Path, rig: ModalRig) -> IdentifiedMode:
    """The law of one mode from a table of sweeps."""
    return IdentifiedMode(model=identify_sweep_table(Path(path), rig), table=str(path))
