"""Results that bring a model: to save, to report and to go on with; and pictures of how it fits recordings."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from matplotlib.figure import Figure

from twin.diagnose.answer.comparison import SweepComparison
from twin.identify.measured_data import MeasuredData
from twin.lab.shown import Reported
from twin.rigs.assumed import assumed
from twin.rigs.store import AnyRig, save_rig
from twin.views.curves import Fitted
from twin.views.figures import broadband_figure, sweeps_figure
from twin.views.rig_figure import modes_figure

if TYPE_CHECKING:
    from twin.lab.rig import LabRig


class ModelResult(Reported):
    """A result whose model is a rig file."""

    became: ClassVar[str] = "identified"
    """What its rig is called by, beside its name."""

    @property
    @abstractmethod
    def file(self) -> AnyRig:
        """What is written to the model file."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """As the command prints it with ``--json``, without the model file's name."""

    @property
    def assumed(self) -> tuple[str, ...]:
        """What stands for what the rig file leaves out; its law was found."""
        return assumed(self.file, law=False, bench=False)

    @property
    def rig(self) -> LabRig:
        """The model as a rig, to rehearse, predict and diagnose with."""
        from twin.lab.rig import LabRig

        return LabRig(source=f"{self.file.name}, {self.became}", file=self.file)


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class IdentifiedModel(ModelResult):
    """A model that was identified, which goes into a file of its own; `warnings` are what to know beside it."""

    warnings: tuple[str, ...]

    @abstractmethod
    def _values(self) -> dict[str, Any]:
        """What was identified, as ``twin identify --json`` prints it."""

    def to_dict(self) -> dict[str, Any]:
        """As the command prints it with ``--json``, without the model file's name."""
        return {**self._values(), "assumed": list(self.assumed), "warnings": list(self.warnings)}

    def save(self, path: str | Path) -> None:
        """Write the model file (TOML), whole or not at all."""
        save_rig(self.file, Path(path))


class FitPictures(ABC):
    """Pictures of models that were fitted to recordings."""

    @abstractmethod
    def _fit(self) -> tuple[MeasuredData, Mapping[str, Fitted], Sequence[SweepComparison]]:
        """The recordings reduced, the models by kind, the last the accepted one, and the sweeps beside them."""

    def plot_sweeps(self) -> Figure:
        """Receptances of the sweeps that were learnt from, measured and modelled."""
        return self._sweeps_figure(residuals=False)

    def plot_residuals(self) -> Figure:
        """Residuals of these sweeps in standard deviations of their noise."""
        return self._sweeps_figure(residuals=True)

    def _sweeps_figure(self, *, residuals: bool) -> Figure:
        evidence, models, sweeps = self._fit()
        if not sweeps:
            raise ValueError("nothing was measured by stepped sines")
        return sweeps_figure(evidence, sweeps, kinds=list(models), residuals=residuals)

    def plot_broadband(self, index: int = 0) -> Figure:
        """Measured and modelled responses of one broadband run, and the errors beside the noise."""
        evidence, models, _ = self._fit()
        if not 0 <= index < len(evidence.broadband):
            raise ValueError(f"there are {len(evidence.broadband)} broadband runs, none is number {index}")
        return broadband_figure(evidence, models, index)

    def plot_modes(self) -> Figure:
        """Mode shapes of the accepted model's structure."""
        evidence, models, _ = self._fit()
        return modes_figure(evidence, list(models.values())[-1])
