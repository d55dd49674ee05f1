"""What a diagnosis gives: an answer to show, to save and to go on with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from recordings import InputError, whole_file
from twin.diagnose import Diagnosis
from twin.diagnose.comparison import SweepComparison
from twin.diagnose.extended import updated_rig_file
from twin.diagnose.tables import TableDiagnosis
from twin.lab.shown import Reported
from twin.rigs.kinds import save_any_rig
from twin.views.answer import causes_table, errors_table, residuals_table
from twin.views.curves import has_law, shown_models
from twin.views.figures import broadband_figure, law_figure, residuals_figure, sweeps_figure
from twin.views.missing_force import missing_force_figure
from twin.views.page import Page
from twin.views.report import diagnosis_page
from twin.views.rig_figure import modes_figure
from twin.views.table import Table
from twin.views.table_report import table_figure, table_page, tried_table

if TYPE_CHECKING:
    from twin.lab.rig import LabRig

EXTENDED, VIEW = "extended.toml", "view.rrd"
"""Files of a saved diagnosis."""


@dataclass(frozen=True, repr=False, eq=False)
class _Diagnosed(Reported):
    """What the diagnoses of recordings and of tables have in common; `diagnosis` holds all that is behind it."""

    diagnosis: Diagnosis | TableDiagnosis

    @property
    def sentence(self) -> str:
        """The answer in one sentence."""
        return self.diagnosis.sentence

    @property
    def verdict(self) -> str:
        """``explained``, ``none``, ``ambiguous`` or ``unknown``."""
        return self.diagnosis.verdict

    @property
    def rig(self) -> LabRig:
        """The extended model as a rig."""
        raise NotImplementedError

    def to_dict(self) -> dict[str, Any]:
        """As ``twin diagnose --json`` prints it."""
        raise NotImplementedError

    def save_model(self, folder: str | Path) -> dict[str, Any]:
        """Write the extended model into a folder, which is made if it is not there.

        Returns what ``twin diagnose --json`` prints.
        """
        with whole_file(_folder(folder) / EXTENDED) as part:
            save_any_rig(self.rig.file, part)
        return {**self.to_dict(), "extended_model": EXTENDED}


@dataclass(frozen=True, repr=False, eq=False)
class DiagnosedRecordings(_Diagnosed):
    """The diagnosis of recordings."""

    diagnosis: Diagnosis

    def tables(self) -> Sequence[Table]:
        """Causes, errors on what was held out, residuals by sweep and channel."""
        found = self.diagnosis
        several = len(shown_models(found)) > 1
        tables = [causes_table(found.causes)] if found.causes else []
        if found.gain is not None:
            tables.append(errors_table(found.gain, several=several))
        if found.sweeps:
            tables.append(residuals_table(found.sweeps, several=several))
        return tables

    @property
    def rig(self) -> LabRig:
        """The extended model as a rig."""
        from twin.lab.rig import LabRig

        found = self.diagnosis
        accepted = list(shown_models(found).values())[-1]
        rig = updated_rig_file(found.evidence, replace(found.search, model=accepted))
        return LabRig(source=f"{rig.name}, extended", file=rig)

    def page(self) -> Page:
        """The report."""
        return diagnosis_page(self.diagnosis)

    def save(self, folder: str | Path) -> dict[str, Any]:
        """Write the extended model, and then a file for the rerun viewer, into a folder, made if it is not there.

        Returns what ``twin diagnose --json`` prints.
        """
        data = self.save_model(folder)
        self.save_view(Path(folder) / VIEW)
        return data

    def save_view(self, path: str | Path) -> None:
        """Write a file for the rerun viewer."""
        from twin.views import save_diagnosis

        save_diagnosis(self.diagnosis, Path(path))

    def plot_sweeps(self) -> Figure:
        """Receptances of the sweeps that were learnt from: measured, before and after."""
        return self._beside(self.diagnosis.sweeps)

    def plot_held_out(self) -> Figure:
        """The same of the sweeps that were held out."""
        return self._beside(self.diagnosis.held_out)

    def plot_residuals(self) -> Figure:
        """Residuals in standard deviations of their noise, before and after."""
        return residuals_figure(_some(self.diagnosis.sweeps), kinds=list(shown_models(self.diagnosis)))

    def plot_law(self) -> Figure:
        """The joint's law, before and after."""
        models = shown_models(self.diagnosis)
        if not any(map(has_law, models.values())):
            raise ValueError("the joint's law was not seen: nothing was measured by stepped sines")
        return law_figure(self.diagnosis.evidence, models)

    def plot_broadband(self, index: int = 0) -> Figure:
        """Responses of one broadband run: measured, before and after."""
        evidence = self.diagnosis.evidence
        if not 0 <= index < len(evidence.broadband):
            raise ValueError(f"there are {len(evidence.broadband)} broadband runs, none is number {index}")
        return broadband_figure(evidence, shown_models(self.diagnosis), index)

    def plot_modes(self) -> Figure:
        """Mode shapes of the accepted model's structure."""
        return modes_figure(self.diagnosis.evidence, list(shown_models(self.diagnosis).values())[-1])

    def plot_missing_force(self) -> Figure:
        """Where no listed cause explains the data: the force that is missing, over a period and along the beam."""
        force = self.diagnosis.missing_force
        if force is None:
            raise ValueError("no force was found to be missing")
        return missing_force_figure(self.diagnosis, force)

    def _beside(self, sweeps: Sequence[SweepComparison]) -> Figure:
        kinds = ["measured", *shown_models(self.diagnosis)]
        return sweeps_figure(self.diagnosis.evidence, _some(sweeps), kinds=kinds)

    def to_dict(self) -> dict[str, Any]:
        """As ``twin diagnose --json`` prints it."""
        return self.diagnosis.to_dict()


def _some(sweeps: Sequence[SweepComparison]) -> Sequence[SweepComparison]:
    if not sweeps:
        raise ValueError("there are no such sweeps")
    return sweeps


@dataclass(frozen=True, repr=False, eq=False)
class DiagnosedTables(_Diagnosed):
    """The diagnosis of natural frequencies or of sweeps."""

    diagnosis: TableDiagnosis

    def tables(self) -> Sequence[Table]:
        """Causes, and the models that were tried."""
        found = self.diagnosis
        tables = [causes_table(found.causes)] if found.causes else []
        return [*tables, tried_table(found)] if found.tried else tables

    @property
    def rig(self) -> LabRig:
        """The extended model as a rig."""
        from twin.lab.rig import LabRig

        return LabRig(source=f"{self.diagnosis.rig}, extended", file=self.diagnosis.model)

    def save(self, folder: str | Path) -> dict[str, Any]:
        """As :meth:`save_model`."""
        return self.save_model(folder)

    def page(self) -> Page:
        """The report."""
        return table_page(self.diagnosis)

    def plot(self) -> Figure:
        """Errors of the frequencies, or resonances of the sweeps beside their law."""
        return table_figure(self.diagnosis)

    def to_dict(self) -> dict[str, Any]:
        """As ``twin diagnose --json`` prints it."""
        return self.diagnosis.to_dict(EXTENDED)


def _folder(path: str | Path) -> Path:
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(folder, "", (error.strerror or str(error)).lower()) from error
    return folder
