"""A rig's numbers, damping and modes identified from frequency responses."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from recordings.errors import InputError
from recordings.responses import read_responses
from twin.identify.responses.modal_tables import update_to_modes
from twin.identify.responses.updating import Updated, update_rig
from twin.lab.model_result import IdentifiedModel
from twin.rigs import Rig
from twin.views.page import Page
from twin.views.reports.updated import (
    damping_table,
    pairs_table,
    responses_figure,
    updated_page,
    updated_sentence,
    values_table,
)
from twin.views.table import Table


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class IdentifiedResponses(IdentifiedModel):
    """What frequency responses in files tell of a rig."""

    found: Updated

    @property
    def file(self) -> Rig:
        """The rig file with what was identified."""
        return self.found.rig

    @property
    def sentence(self) -> str:
        """What was identified, in one sentence."""
        return updated_sentence(self.found)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know beside it."""
        return self.found.notes

    def tables(self) -> Sequence[Table]:
        """Numbers before and after, pairs of frequencies with MAC, damping."""
        values = [values_table(self.found)] if self.found.values else []
        return [*values, pairs_table(self.found), damping_table(self.found)]

    def page(self) -> Page:
        """The report."""
        return updated_page(self.found)

    def plot_responses(self, index: int = 0) -> Figure:
        """Measured and modelled responses of one case."""
        return responses_figure(self.found, index)

    def to_dict(self) -> dict[str, Any]:
        """As ``twin identify --json`` prints it, without the model file's name."""
        found = self.found
        return {
            "preload": found.preload,
            "linear": {
                **{
                    one.name: {**asdict(one.after), "before": one.before.value, "told": one.told}
                    for one in found.values
                },
                "modal_damping": [asdict(one) for one in found.damping.values()],
            },
            "nonlinear": {},
            "residual_percent": {
                f"mode {pair.mode}": 100 * (pair.after_Hz / pair.measured_Hz - 1) for pair in found.pairs
            },
            "modes": [asdict(pair) for pair in found.pairs],
            "frequency_scatter": found.scatter,
            "assumed": list(self.assumed),
            "warnings": list(self.warnings),
        }


def identify_responses(
    paths: Sequence[Path], rig: Rig, *, preload: str | None, scatter: float | None
) -> IdentifiedResponses:
    """Update a rig to files of frequency responses of one state.

    Raises
    ------
    InputError
        As :func:`~twin.identify.responses.gather_responses`.
    """
    files = [read_responses(path) for path in paths]
    tables = [file for file in files if not file.responses]
    if tables and len(files) > 1:
        raise InputError(tables[0].path, "", "has modes and no responses: it is taken by itself", "give it alone")
    if tables:
        return IdentifiedResponses(found=update_to_modes(tables[0], rig, preload=preload, scatter=scatter))
    return IdentifiedResponses(found=update_rig(files, rig, preload=preload, scatter=scatter))
