"""What a diagnosis gives: an answer to show, to save and to go on with."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from matplotlib.figure import Figure

from recordings.whole import made_folder
from twin.checks import Finding
from twin.diagnose import Diagnosis
from twin.diagnose.answer.comparison import SweepComparison
from twin.diagnose.answer.extended import updated_rig_file
from twin.diagnose.tables import TableDiagnosis
from twin.identify.measured_data import MeasuredData
from twin.lab.model_result import FitPictures, ModelResult
from twin.rigs import Rig, save_rig
from twin.views.curves import Fitted, has_law, shown_models
from twin.views.figures import law_figure, sweeps_figure
from twin.views.page import LEFT_OUT, Page
from twin.views.reports.answer import causes_table, errors_table, residuals_table
from twin.views.reports.diagnosis import diagnosis_page
from twin.views.reports.missing_force import missing_force_figure
from twin.views.table import Table

EXTENDED, VIEW = "extended.toml", "view.rrd"
"""Files of a saved diagnosis."""


@dataclass(frozen=True, repr=False, eq=False)
class DiagnosedModel(ModelResult):
    """What the diagnoses of recordings and of tables have in common; `diagnosis` holds all that is behind it."""

    became: ClassVar[str] = "extended"

    diagnosis: Diagnosis | TableDiagnosis

    @property
    def sentence(self) -> str:
        """The answer in one sentence."""
        return self.diagnosis.sentence

    @property
    def verdict(self) -> str:
        """``explained``, ``none``, ``ambiguous`` or ``unknown``."""
        return self.diagnosis.verdict

    def save_model(self, folder: str | Path) -> dict[str, Any]:
        """Write the extended model into a folder, which is made if it is not there.

        Returns what ``twin diagnose --json`` prints.
        """
        save_rig(self.file, made_folder(folder) / EXTENDED)
        return {**self.to_dict(), "extended_model": EXTENDED}


@dataclass(frozen=True, repr=False, eq=False)
class DiagnosedRecordings(FitPictures, DiagnosedModel):
    """The diagnosis of recordings, and what a first look at them saw."""

    diagnosis: Diagnosis
    findings: tuple[Finding, ...] = ()

    @property
    def sentence(self) -> str:
        """The answer in one sentence; with what a first look suspects, where it blames or leaves something."""
        found = self.diagnosis
        if found.verdict == "none" and not found.shortfall:
            return found.sentence
        suspected = {(one.kind, one.channel): one for one in reversed(self.findings)}
        return found.sentence + "".join(f"  At first look: {one.line}." for one in reversed(suspected.values()))

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
    def file(self) -> Rig:
        """The extended model."""
        found = self.diagnosis
        accepted = list(shown_models(found).values())[-1]
        return updated_rig_file(found.evidence, replace(found.search, model=accepted))

    def page(self) -> Page:
        """The report, with what a first look saw before all else."""
        page = replace(diagnosis_page(self.diagnosis), answer=self.sentence).beginning(LEFT_OUT, self.assumed)
        return page.beginning("At first look", [finding.line for finding in self.findings])

    def save(self, folder: str | Path) -> dict[str, Any]:
        """Write the extended model, and then a file for the rerun viewer, into a folder, made if it is not there.

        Returns what ``twin diagnose --json`` prints.
        """
        data = self.save_model(folder)
        self.save_view(Path(folder) / VIEW)
        return data

    def save_view(self, path: str | Path) -> None:
        """Write a file for the rerun viewer."""
        from twin.views.rerun.diagnosis import save_diagnosis

        save_diagnosis(self.diagnosis, Path(path))

    def _fit(self) -> tuple[MeasuredData, Mapping[str, Fitted], Sequence[SweepComparison]]:
        return self.diagnosis.evidence, shown_models(self.diagnosis), self.diagnosis.sweeps

    def plot_held_out(self) -> Figure:
        """Receptances of the sweeps that were held out."""
        if not self.diagnosis.held_out:
            raise ValueError("no sweeps were held out")
        evidence, models, _ = self._fit()
        return sweeps_figure(evidence, self.diagnosis.held_out, kinds=list(models))

    def plot_law(self) -> Figure:
        """The joints' laws, before and after."""
        models = shown_models(self.diagnosis)
        if not any(map(has_law, models.values())):
            raise ValueError("no joint's law was seen: there is no joint, or nothing was measured by stepped sines")
        return law_figure(self.diagnosis.evidence, models)

    def plot_missing_force(self) -> Figure:
        """Where no listed cause explains the data: the force that is missing, over a period and along the beam."""
        force = self.diagnosis.missing_force
        if force is None:
            raise ValueError("no force was found to be missing")
        return missing_force_figure(self.diagnosis, force)

    def to_dict(self) -> dict[str, Any]:
        """As ``twin diagnose --json`` prints it."""
        found = self.diagnosis.to_dict()
        notes = [*(finding.line for finding in self.findings), *found["notes"]]
        return {
            **found,
            "answer": self.sentence,
            "assumed": list(self.assumed),
            "notes": notes,
            "findings": [asdict(finding) for finding in self.findings],
        }
