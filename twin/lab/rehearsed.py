"""What a rehearsal gives: a recording, warnings, a better procedure."""

import shutil
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from recordings.whole import made_folder
from twin.lab.given import Report
from twin.lab.recording import Recording, load_run
from twin.lab.shown import Reported
from twin.procedures import Procedure, load_procedure, save_procedure
from twin.rehearsal import NominalRig, Rehearsed, branch_tables, open_twin, rehearse, rehearse_until_clear, result_table
from twin.rigs import Rig
from twin.rigs.preloads import known_preload
from twin.views.page import Page
from twin.views.reports.rehearsal import rehearsal_page, rehearsal_sentence, sweeps_table, warnings_table
from twin.views.reports.rehearsal_figures import range_figure, responses_figures
from twin.views.table import Table


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class RehearsedProcedure(Reported):
    """A procedure run on the twin."""

    first: Rehearsed
    better: Rehearsed | None
    """The procedure improved until it is clear; None where there was nothing to improve."""
    result: Mapping[str, Any]
    """The table that ``twin rehearse`` writes as ``result.json``."""

    @property
    def sentence(self) -> str:
        """Whether the procedure may be run, in one sentence."""
        return rehearsal_sentence(self.result)

    @property
    def clear(self) -> bool:
        """Whether the procedure as it was asked for raised no warning."""
        return self.first.clear

    @property
    def recording(self) -> Recording:
        """The rehearsal's recording, as of a real run."""
        return load_run(self.first.recording)

    @property
    def procedure(self) -> Procedure:
        """The improved procedure; as it was asked for where there was nothing to improve."""
        return (self.better or self.first).rehearsal.procedure

    def tables(self) -> Sequence[Table]:
        """Sweeps, and warnings with what to change."""
        tables = (sweeps_table(self.result), warnings_table(self.result))
        return [table for table in tables if table.rows]

    def save_procedure(self, path: str | Path) -> None:
        """Write :attr:`procedure` (TOML)."""
        save_procedure(self.procedure, Path(path))

    def page(self) -> Page:
        """The report."""
        return rehearsal_page(self.result)

    def plot_responses(self, *, resonance: int = 1) -> Figure:
        """Response per force at every step, over the branches that harmonic balance predicts.

        Parameters
        ----------
        resonance
            Which of those that were swept, counted from the lowest.

        Raises
        ------
        ValueError
            If nothing was rehearsed there.
        """
        rehearsal = self.first.rehearsal
        figures = responses_figures(
            self.result["steps"], self.result["branches"], rehearsal.response_channels, rehearsal.force_channel
        )
        if not 1 <= resonance <= len(figures):
            raise ValueError(f"no resonance number {resonance}: sweeps were rehearsed about {len(figures)}")
        return figures[resonance - 1][0]

    def plot_range(self) -> Figure:
        """Use of each converter's range, and the time of each step."""
        figure = range_figure(self.result["steps"])
        if figure is None:
            raise ValueError("too few steps to plot")
        return figure


def rehearse_procedure(
    procedure: str | Path | Procedure, rig: Rig, *, source: str, preload: str | None, seed: int, out: Path | None,
    rounds: int, report: Report,
) -> RehearsedProcedure:  # fmt: skip
    """Rehearse a procedure as :meth:`twin.lab.rig.LabRig.rehearse` does; `source` names the rig in errors."""
    asked = load_procedure(procedure) if isinstance(procedure, str | Path) else procedure
    rig = rig.driven_by(asked.drive)
    name, named = known_preload(rig, preload), asked.procedure if procedure is asked else str(procedure)
    bench = partial(open_twin, rig, preload=name, seed=seed, source=source, named=named)
    first_bench = bench(asked)
    folder = Path(tempfile.mkdtemp(prefix="twin-rehearsal-")) if out is None else made_folder(out)
    try:
        report("predicting the branches")
        branches = branch_tables(rig, preload=name, procedure=asked)
        nominal = NominalRig.of(rig, preload=name, branches=branches)
        report("rehearsing")
        first, better = rehearse(asked, first_bench, folder / "run.mcap", nominal=nominal), None
        if rounds:
            report("improving the procedure")
            better = rehearse_until_clear(first, bench, folder / "improved.mcap", rounds=rounds)
        result = result_table(first, better, procedure=named, rig=rig, preload=name, seed=seed, branches=branches)
        rehearsed = RehearsedProcedure(first=first, better=better, result=result)
    except BaseException:
        if out is None:
            shutil.rmtree(folder, ignore_errors=True)
        raise
    if out is None:  # nobody asked to keep the recordings: they go with the result
        weakref.finalize(rehearsed, shutil.rmtree, folder, ignore_errors=True)
    return rehearsed
