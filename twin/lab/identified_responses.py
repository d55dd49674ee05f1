"""A rig's numbers, damping and modes identified from frequency responses: what they tell, pairs of modes, responses."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from recordings.errors import InputError
from recordings.responses import read_responses
from twin.identify.estimate import Estimate
from twin.identify.responses.modal_tables import update_to_modes
from twin.identify.responses.updating import Updated, update_rig
from twin.lab.model_result import IdentifiedModel
from twin.rigs import Rig
from twin.views.figures import plots_figure
from twin.views.page import Page, Picture, Section
from twin.views.plots import response_plots
from twin.views.reports.answer import frequencies_table, sentences
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
        """What was updated, and how well the frequencies are met."""
        told = [one.name for one in self.found.values if one.told]
        worst = max((abs(error) for error in self._errors().values()), default=0.0)
        what = f"{', '.join(told)} updated" if told else "no number of the rig file is told by these data"
        return f"{what}; {len(self.found.pairs)} natural frequencies met within {worst:.2g} %."

    def tables(self) -> Sequence[Table]:
        """Numbers before and after, pairs of frequencies with MAC, damping."""
        return [*self._numbers(), *self._modes()]

    def _numbers(self) -> list[Table]:
        """Numbers of the rig file before and after, where it has any that may be updated."""
        rows = [
            (one.name, one.unit, str(one.before), str(one.after), "yes" if one.told else "hardly")
            for one in self.found.values
        ]
        head = ("number", "unit", "assumed", "updated", "told by the data")
        caption = "Numbers of the rig file, with one standard deviation"
        return [Table(caption=caption, head=head, rows=rows, numbers=(2, 3))] if rows else []

    def _modes(self) -> list[Table]:
        """Pairs of measured and modelled modes, and damping ratios of the modes that show."""
        pairs, damping = self.found.pairs, self.found.damping
        columns = zip(*((p.mode, p.measured_Hz, p.before_Hz, p.after_Hz) for p in pairs), strict=True)
        macs = {"MAC before": [p.mac_before for p in pairs], "MAC after": [p.mac_after for p in pairs]}
        alike = {name: ["" if mac is None else f"{mac:.3f}" for mac in column] for name, column in macs.items()}
        rows = [(str(n), str(Estimate(100 * one.value, 100 * one.std))) for n, one in damping.items()]
        return [
            frequencies_table(*(list(columns) or [()] * 4), after="updated", more=alike),
            Table(caption="Damping ratios, per cent", head=("mode", "ratio"), rows=rows, numbers=(0, 1)),
        ]

    def _errors(self) -> dict[str, float]:
        """Of every natural frequency after the update, per cent."""
        return {f"mode {pair.mode}": 100 * (pair.after_Hz / pair.measured_Hz - 1) for pair in self.found.pairs}

    def plot_responses(self, index: int = 0) -> Figure:
        """Measured and modelled responses of one case."""
        assert self.found.found is not None
        evidence = self.found.found.evidence
        predicted = {"model": self.found.predicted(index)}
        plots, _ = response_plots(evidence.broadband[index], evidence.units, predicted)
        return plots_figure(plots, columns=len(plots), height_in=2.6)

    def page(self) -> Page:
        """The report."""
        found = self.found
        shown = Picture(
            draw=self.plot_responses,
            alt="Measured frequency responses and those of the updated model.",
            caption="Responses of the first case, in bins, and the updated model's.",
        )
        pictures = [shown] if found.found is not None else []
        hardly = [one.name for one in found.values if not one.told]
        uncertain = [
            *([f"{', '.join(hardly)}: rather assumed than measured."] if hardly else []),
            *sentences(self.warnings),
            "What these numbers leave of natural frequencies and of what sensors show of each mode is in the model.",
            "Frequency responses have no force level: nothing is said of a joint's nonlinear law.",
        ]
        return Page(
            title="A rig updated to frequency responses",
            answer=self.sentence,
            facts=f"Rig {found.rig.name}; {', '.join(found.sources)}.",
            sections=[
                Section(title="What was updated", tables=self._numbers()),
                Section(title="Measured and modelled", tables=self._modes(), pictures=pictures),
                Section(title="What is uncertain", items=uncertain),
            ],
            files=found.sources,
        )

    def _values(self) -> dict[str, Any]:
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
            "residual_percent": self._errors(),
            "modes": [asdict(pair) for pair in found.pairs],
            "frequency_scatter": found.scatter,
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
        found = update_to_modes(tables[0], rig, preload=preload, scatter=scatter)
    else:
        found = update_rig(files, rig, preload=preload, scatter=scatter)
    return IdentifiedResponses(found=found, warnings=found.notes)
