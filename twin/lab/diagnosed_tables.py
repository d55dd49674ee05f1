"""What a diagnosis of tables gives: of natural frequencies, or of sweeps that held their response."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from recordings import FrequencyTable, InputError, read_table
from twin.diagnose.tables import FrequencyRow, SweepRow, TableDiagnosis, diagnose_frequencies, diagnose_sweeps
from twin.identify.backbones.backbone import BackboneSweep
from twin.identify.backbones.modal_table import read_sweeps
from twin.lab.diagnosed import EXTENDED, DiagnosedModel
from twin.rigs import Rig
from twin.rigs.modal import ModalRig
from twin.rigs.store import AnyRig
from twin.views.drawing import draw_band, dressed, legend, panels
from twin.views.figures import bars, error_bars
from twin.views.page import LEFT_OUT, Page, Picture, Section
from twin.views.reports.answer import causes_table
from twin.views.reports.diagnosis import ACCENT, WITHIN_MODEL, causes_section, excluded_section
from twin.views.style import AFTER, BEFORE, MEASURED
from twin.views.table import Table


@dataclass(frozen=True, repr=False, eq=False)
class DiagnosedTables(DiagnosedModel):
    """The diagnosis of natural frequencies or of sweeps."""

    diagnosis: TableDiagnosis

    @property
    def file(self) -> AnyRig:
        """The extended model."""
        return self.diagnosis.model

    save = DiagnosedModel.save_model

    def to_dict(self) -> dict[str, Any]:
        """As ``twin diagnose --json`` prints it."""
        return {**self.diagnosis.to_dict(EXTENDED), "assumed": list(self.assumed)}

    def tables(self) -> Sequence[Table]:
        """Causes, and the models that were tried."""
        return [*([causes_table(self.diagnosis.causes)] if self.diagnosis.causes else []), *self._tried()]

    def plot(self) -> Figure:
        """Errors of the frequencies when left out, or resonances of the sweeps beside their law."""
        return self._plot_errors() if self._frequencies else self._plot_law()

    def page(self) -> Page:
        """The report."""
        found = self.diagnosis
        page = Page(
            title=f"Diagnosis of {'natural frequencies' if found.kind == 'frequencies' else 'sweeps'}",
            answer=found.sentence,
            facts=f"Rig {found.rig}; {', '.join(found.runs)}; {found.seconds:.0f} s of work.",
            sections=[section for section in self._sections() if section is not None],
            accent=ACCENT[found.verdict],
        )
        return page.beginning(LEFT_OUT, self.assumed)

    @property
    def _frequencies(self) -> list[FrequencyRow]:
        return [row for row in self.diagnosis.rows if isinstance(row, FrequencyRow)]

    @property
    def _sweeps(self) -> list[SweepRow]:
        return [row for row in self.diagnosis.rows if isinstance(row, SweepRow)]

    @property
    def _extended(self) -> bool:
        return any(row.before_Hz != row.after_Hz for row in self._frequencies)

    def _sections(self) -> Iterator[Section | None]:
        found = self.diagnosis
        yield self._gain()
        yield causes_section(found.causes)
        if self._frequencies:
            yield self._frequency_section()
        if self._sweeps:
            yield self._sweep_section()
        yield excluded_section(found)
        if found.tried:
            yield Section(title="What was tried", tables=self._tried())
        if self._frequencies:
            yield Section(title="What was identified", tables=[self._moduli()])
        yield Section(title="What was assumed", items=found.assumed)
        yield Section(title="What is uncertain, and what else was seen", items=[*found.notes, WITHIN_MODEL])

    def _gain(self) -> Section | None:
        gain, of_sweeps = self.diagnosis.gain, self.diagnosis.kind == "sweeps"
        if gain is None:
            return None
        same = gain.after == gain.before
        errors = {"smooth law" if of_sweeps else "moduli identified, nothing named": gain.before}
        errors |= {} if same else {"with what is named": gain.after}
        rows = [(name, f"{100 * error:.2f} %") for name, error in [*errors.items(), ("noise floor", gain.noise_floor)]]
        caption = f"Root-mean-square relative error of the {'force' if of_sweeps else 'frequency'}"
        told = "This is the error" if same else f"The error falls {gain.before / max(gain.after, 1e-12):.1f}-fold"
        return Section(
            title="On what no fit has seen" if same else "What naming it gains",
            texts=[f"{told} on values that no fit has seen: {gain.how}."],
            tables=[Table(caption=caption, head=("model", "error"), rows=rows, numbers=(1,))],
        )

    def _frequency_section(self) -> Section:
        misfit, rows = self.diagnosis.misfit, self._frequencies
        table = Table(
            caption="Natural frequencies in Hz; errors are measured over model, minus one",
            head=("condition", "mode", "measured", "moduli alone", "error", "extended", "error", "error when left out"),
            rows=[
                (
                    row.condition, str(row.mode), f"{row.measured_Hz:.5g}", f"{row.before_Hz:.5g}",
                    f"{100 * (row.measured_Hz / row.before_Hz - 1):+.2f} %", f"{row.after_Hz:.5g}",
                    f"{100 * (row.measured_Hz / row.after_Hz - 1):+.2f} %", f"{100 * row.left_out_after:+.2f} %",
                )
                for row in rows
            ],
            numbers=range(1, 8),
        )  # fmt: skip
        told = "; ".join(
            f"mode {row.mode} {row.condition}: {100 * row.left_out_before:+.2f} % before, "
            f"{100 * row.left_out_after:+.2f} % after"
            for row in rows
        )
        verb = "agrees with" if misfit.chi2_per_dof <= misfit.threshold else "does not agree with"
        text = (
            f"Chi² per degree of freedom with the moduli identified is {misfit.chi2_per_dof:.3g}: the model {verb} the "
            f"frequencies, the threshold being {misfit.threshold:.3g}."
            + (f" With what is named it is {misfit.after:.3g}." if self._extended else "")
        )
        drawn = Picture(
            draw=self._plot_errors,
            alt=f"Relative error of every frequency predicted from all others. {told}.",
            caption="Every frequency predicted from all others: measured over model, minus one.",
        )
        return Section(title="Measured and modelled frequencies", texts=[text], tables=[table], pictures=[drawn])

    def _plot_errors(self) -> Figure:
        rows = self._frequencies
        kinds = [("moduli alone", [100 * row.left_out_before for row in rows], BEFORE)]
        if self._extended:
            kinds.append(("extended", [100 * row.left_out_after for row in rows], AFTER))
        names = [f"{row.mode}\n{row.condition}" for row in rows]
        return error_bars(kinds, names, xlabel="mode and condition", ylabel="left-out error, %")

    def _sweep_section(self) -> Section:
        misfit, rows = self.diagnosis.misfit, self._sweeps
        table = Table(
            caption="Every sweep beside the smooth law of all others, in the order of the file",
            head=(
                "sweep", "amplitude, m/s²", "resonance, Hz", "damping ratio", "off the law, Hz", "force error",
                "own mode's error",
            ),
            rows=[
                (
                    row.sweep + ("" if row.inside else " (end)") + (", shifted" if row.shifted else ""),
                    f"{row.amplitude_m_per_s2:.3g}", f"{row.frequency_Hz:.3f}", f"{row.damping_ratio:.5f}",
                    f"{row.shift_Hz:+.3f}", f"{100 * row.force_error:.1f} %", f"{100 * row.own_error:.1f} %",
                )
                for row in rows
            ],
            numbers=range(1, 7),
        )  # fmt: skip
        text = (
            f"Chi² per sweep of the resonances against the law of all others is {misfit.chi2_per_dof:.3g}, the "
            f"threshold being {misfit.threshold:.3g}. The lowest and the highest amplitude (end) are extrapolated and "
            "do not count."
        )
        peaks = "; ".join(
            f"sweep {row.sweep} at {row.amplitude_m_per_s2:.0f} m/s²: {row.frequency_Hz:.3f} Hz" for row in rows
        )
        drawn = Picture(
            draw=self._plot_law,
            alt="Resonance of every sweep against its amplitude, with the smooth law, and force errors by sweep. "
            f"{peaks}.",
            caption="Left: resonance of every sweep by itself and the smooth law with one standard deviation; right: "
            "errors of the force, by the law of all other sweeps and by a linear mode of its own.",
        )
        return Section(title="Sweep by sweep", texts=[text], tables=[table], pictures=[drawn])

    def _plot_law(self) -> Figure:
        rows, model = self._sweeps, self.diagnosis.model
        assert isinstance(model, ModalRig)
        law = model.law
        assert law is not None
        figure, ((left, right),) = panels(1, 2, height_in=3.4)
        a, f, std = (np.array(v) for v in (law.amplitude_m_per_s2, law.frequency_Hz, law.frequency_std_Hz))
        draw_band(left, a, f, std, colour=AFTER, label="smooth law")
        amplitude, resonance = [row.amplitude_m_per_s2 for row in rows], [row.frequency_Hz for row in rows]
        left.plot(amplitude, resonance, "o", color=MEASURED, markersize=5, label="sweep by itself")
        dressed(left, title="Resonance", xlabel="amplitude, m/s²", ylabel="frequency, Hz")
        errors = [
            ("law of all others", [100 * row.force_error for row in rows], BEFORE),
            ("own mode", [100 * row.own_error for row in rows], AFTER),
        ]
        names = [row.sweep for row in rows]
        bars(right, errors, names, title="Error of the force", xlabel="sweep", ylabel="rms error, %")
        highest = max([row.force_error for row in rows if row.inside] + [row.own_error for row in rows])
        right.set_ylim(0, 130 * highest)  # the ends are extrapolated and may lie far above
        legend(figure)
        return figure

    def _tried(self) -> list[Table]:
        """The models that were fitted, the likeliest first."""
        rows = [
            (one.hypotheses, f"{one.log_evidence:+.1f}", f"{one.chi2_per_dof:.3g}", f"{100 * one.rms_error:.2f} %")
            for one in self.diagnosis.tried[:12]
        ]
        head = ("named", "log odds", "chi² per degree of freedom", "rms error")
        caption = "Log odds against naming nothing, what is assumed beforehand included"
        return [Table(caption=caption, head=head, rows=rows, numbers=(1, 2, 3))] if rows else []

    def _moduli(self) -> Table:
        rows = [
            (name, f"{nominal:.4g}", f"{estimate.value:.4g}", f"{estimate.std:.2g}")
            for name, (nominal, estimate) in self.diagnosis.parameters.items()
        ]
        head = ("parameter", "nominal", "identified", "standard deviation")
        return Table(caption="Moduli in N/m²", head=head, rows=rows, numbers=(1, 2, 3))


def diagnose_tables(
    runs: Sequence[Path],
    held_out: Sequence[Path],
    rig: AnyRig,
    *,
    source: str,
    preloads: Sequence[str],
    report: Callable[[str], None],
) -> DiagnosedTables:
    """Diagnose tables of one kind.

    Raises
    ------
    InputError
        If the tables, the rig or the preloads are wrong, or do not fit together.
    """
    # Told apart by their columns; sweeps are read again by kind, which costs little.
    tables = {path: read_table(path) for path in [*runs, *held_out]}
    kinds = [isinstance(table, FrequencyTable) for table in tables.values()]
    if any(kinds) and not all(kinds):
        odd = list(tables)[kinds.index(not kinds[0])]
        kind = "sweeps" if kinds[0] else "natural frequencies"
        raise InputError(odd, "", f"holds {kind}, {runs[0]} does not", "diagnose them by themselves")
    if not all(kinds):
        return DiagnosedTables(_diagnose_sweeps(runs, held_out, rig, preloads))
    if isinstance(rig, ModalRig):
        raise InputError(
            source, "kind", "is a rig of one mode, without a structure", "natural frequencies need a rig of parts"
        )
    frequencies = {path: table for path, table in tables.items() if isinstance(table, FrequencyTable)}
    found = diagnose_frequencies(
        [frequencies[path] for path in runs], rig, preloads=preloads,
        held_out=[frequencies[path] for path in held_out], source=source, report=report,
    )  # fmt: skip
    return DiagnosedTables(found)


def _diagnose_sweeps(
    runs: Sequence[Path], held_out: Sequence[Path], rig: AnyRig, preloads: Sequence[str]
) -> TableDiagnosis:
    if preloads:
        raise InputError("--preload", "", "a table of sweeps is diagnosed without a joint's model", "leave it out")
    channel, source = "acc1", ""
    if isinstance(rig, ModalRig):
        channel, source = rig.channel, rig.source
    elif isinstance(rig, Rig) and rig.response_sensors:
        channel = rig.response_sensors[-1].channel
    path = runs[0] if len(runs) == 1 else Path(" ".join(map(str, runs)))
    return diagnose_sweeps(
        _read(runs), path=path, rig_name=rig.name, held_out=_read(held_out), held_out_paths=held_out, channel=channel,
        source=source,
    )  # fmt: skip


def _read(paths: Sequence[Path]) -> list[BackboneSweep]:
    """Sweeps of all tables; named after their table where there are several."""
    if len(paths) == 1:
        return read_sweeps(paths[0])
    return [replace(sweep, level=f"{path.stem}:{sweep.level}") for path in paths for sweep in read_sweeps(path)]
