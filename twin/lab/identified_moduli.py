"""Moduli identified from a table of natural frequencies."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from recordings import FrequencyTable, InputError, read_table
from twin.diagnose.tables import FrequencyModuli, fit_moduli
from twin.lab.model_result import IdentifiedModel
from twin.rigs import Rig
from twin.views.page import Page
from twin.views.reports.moduli import errors_figure, frequency_table, moduli_page, moduli_sentence, moduli_table
from twin.views.table import Table


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class IdentifiedModuli(IdentifiedModel):
    """A lap joint's moduli, identified from the table of natural frequencies in the file `table`."""

    found: FrequencyModuli
    table: str

    @property
    def file(self) -> Rig:
        """The rig file with what was identified."""
        return self.found.model

    @property
    def sentence(self) -> str:
        """What was identified, in one sentence."""
        return moduli_sentence(self.found)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know beside it."""
        return self.found.warnings

    def tables(self) -> Sequence[Table]:
        """Moduli, and measured and modelled frequencies."""
        return [moduli_table(self.found), frequency_table(self.found)]

    def page(self) -> Page:
        """The report."""
        return moduli_page(self.found, table=Path(self.table).name)

    def plot_errors(self) -> Figure:
        """Relative errors of the frequencies, as assumed and as identified."""
        return errors_figure(self.found)

    def to_dict(self) -> dict[str, Any]:
        """As ``twin identify --json`` prints it, without the model file's name."""
        found = self.found
        return {
            "preload": found.preload,
            "linear": {
                name.partition("[")[0]: {"value": value, "std": found.fit.moduli_std[name]}
                for name, value in found.fit.moduli.items()
            },
            "nonlinear": {},
            "residual_percent": {
                f"mode {mode}": error
                for mode, error in zip(found.mode.tolist(), found.error_percent.tolist(), strict=True)
            },
            "assumed": list(self.assumed),
            "warnings": list(self.warnings),
        }


def identify_moduli(path: str | Path, rig: Rig, *, source: str, preload: str | None) -> IdentifiedModuli:
    """Moduli from a table of natural frequencies.

    Raises
    ------
    InputError
        If the table holds sweeps, or as of :func:`~twin.diagnose.tables.fit_moduli`.
    """
    table = read_table(path)
    if not isinstance(table, FrequencyTable):
        raise InputError(path, "", "holds sweeps, which need a rig of kind modal", "--rig brake-reuss, for example")
    return IdentifiedModuli(found=fit_moduli(table, rig, source=source, preload=preload), table=str(path))
