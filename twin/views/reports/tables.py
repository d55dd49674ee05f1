"""The report of a diagnosis of tables: the answer first, then what was measured, tried, assumed and left open."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure

from twin.diagnose.tables import FrequencyRow, SweepRow, TableDiagnosis
from twin.rigs.modal import ModalRig
from twin.views.drawing import draw_band, dressed, legend, panels
from twin.views.figures import bars, error_bars
from twin.views.page import Page, Picture, Section, Table
from twin.views.reports.diagnosis import ACCENT, causes_section, excluded_section
from twin.views.style import AFTER, BEFORE, MEASURED


def table_page(diagnosis: TableDiagnosis) -> Page:
    """The report of `diagnosis`."""
    return Page(
        title=f"Diagnosis of {'natural frequencies' if diagnosis.kind == 'frequencies' else 'sweeps'}",
        answer=diagnosis.sentence,
        facts=f"Rig {diagnosis.rig}; {', '.join(diagnosis.runs)}; {diagnosis.seconds:.0f} s of work.",
        sections=[section for section in _sections(diagnosis) if section is not None],
        accent=ACCENT[diagnosis.verdict],
    )


def _sections(diagnosis: TableDiagnosis) -> Iterator[Section | None]:
    if diagnosis.gain is not None:
        yield _gain(diagnosis)
    yield causes_section(diagnosis.causes)
    frequencies = [row for row in diagnosis.rows if isinstance(row, FrequencyRow)]
    sweeps = [row for row in diagnosis.rows if isinstance(row, SweepRow)]
    if frequencies:
        yield _frequencies(diagnosis, frequencies)
    if sweeps:
        yield _sweeps(diagnosis, sweeps)
    yield excluded_section(diagnosis)
    if diagnosis.tried:
        yield Section(title="What was tried", tables=[tried_table(diagnosis)])
    if frequencies:
        yield _identified(diagnosis)
    yield Section(title="What was assumed", items=diagnosis.assumed)
    yield Section(
        title="What is uncertain, and what else was seen",
        items=[
            *diagnosis.notes,
            "Standard deviations hold within the model; an effect that is on no list can move the values by more than "
            "they say.",
        ],
    )


def _gain(diagnosis: TableDiagnosis) -> Section:
    gain = diagnosis.gain
    assert gain is not None
    same = gain.after == gain.before
    rows = [
        (
            "smooth law" if diagnosis.kind == "sweeps" else "moduli identified, nothing named",
            f"{100 * gain.before:.2f} %",
        )
    ]
    if not same:
        rows.append(("with what is named", f"{100 * gain.after:.2f} %"))
    rows.append(("noise floor", f"{100 * gain.noise_floor:.2f} %"))
    told = "This is the error" if same else f"The error falls {gain.before / max(gain.after, 1e-12):.1f}-fold"
    quantity = "force" if diagnosis.kind == "sweeps" else "frequency"
    table = Table(
        caption=f"Root-mean-square relative error of the {quantity}", head=("model", "error"), rows=rows, numbers=(1,)
    )
    return Section(
        title="On what no fit has seen" if same else "What naming it gains",
        texts=[f"{told} on values that no fit has seen: {gain.how}."],
        tables=[table],
    )


def _frequencies(diagnosis: TableDiagnosis, rows: Sequence[FrequencyRow]) -> Section:
    misfit = diagnosis.misfit
    extended = any(row.before_Hz != row.after_Hz for row in rows)
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
        numbers=(1, 2, 3, 4, 5, 6, 7),
    )  # fmt: skip
    told = "; ".join(
        f"mode {row.mode} {row.condition}: {100 * row.left_out_before:+.2f} % before, "
        f"{100 * row.left_out_after:+.2f} % after"
        for row in rows
    )
    verb = "agrees with" if misfit.chi2_per_dof <= misfit.threshold else "does not agree with"
    texts = [
        f"Chi² per degree of freedom with the moduli identified is {misfit.chi2_per_dof:.3g}: the model {verb} the "
        f"frequencies, the threshold being {misfit.threshold:.3g}."
        + (f" With what is named it is {misfit.after:.3g}." if extended else "")
    ]
    drawn = Picture(
        draw=lambda: _frequency_figure(rows, extended=extended),
        alt=f"Relative error of every frequency predicted from all others. {told}.",
        caption="Every frequency predicted from all others: measured over model, minus one.",
    )
    return Section(title="Measured and modelled frequencies", texts=texts, tables=[table], pictures=[drawn])


def _frequency_figure(rows: Sequence[FrequencyRow], *, extended: bool) -> Figure:
    kinds = [("moduli alone", [100 * row.left_out_before for row in rows], BEFORE)]
    if extended:
        kinds.append(("extended", [100 * row.left_out_after for row in rows], AFTER))
    names = [f"{row.mode}\n{row.condition}" for row in rows]
    return error_bars(kinds, names, xlabel="mode and condition", ylabel="left-out error, %")


def _sweeps(diagnosis: TableDiagnosis, rows: Sequence[SweepRow]) -> Section:
    misfit = diagnosis.misfit
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
                f"{row.shift_Hz:+.3f}",
                f"{100 * row.force_error:.1f} %", f"{100 * row.own_error:.1f} %",
            )
            for row in rows
        ],
        numbers=(1, 2, 3, 4, 5, 6),
    )  # fmt: skip
    texts = [
        f"Chi² per sweep of the resonances against the law of all others is {misfit.chi2_per_dof:.3g}, the threshold "
        f"being {misfit.threshold:.3g}. The lowest and the highest amplitude (end) are extrapolated and do not count."
    ]
    peaks = "; ".join(
        f"sweep {row.sweep} at {row.amplitude_m_per_s2:.0f} m/s²: {row.frequency_Hz:.3f} Hz" for row in rows
    )
    drawn = Picture(
        draw=lambda: _sweep_figure(diagnosis, rows),
        alt=f"Resonance of every sweep against its amplitude, with the smooth law, and force errors by sweep. {peaks}.",
        caption="Left: resonance of every sweep by itself and the smooth law with one standard deviation; right: "
        "errors of the force, by the law of all other sweeps and by a linear mode of its own.",
    )
    return Section(title="Sweep by sweep", texts=texts, tables=[table], pictures=[drawn])


def _sweep_figure(diagnosis: TableDiagnosis, rows: Sequence[SweepRow]) -> Figure:
    figure, ((left, right),) = panels(1, 2, height_in=3.4)
    assert isinstance(diagnosis.model, ModalRig)
    law = diagnosis.model.law
    assert law is not None
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


def tried_table(diagnosis: TableDiagnosis) -> Table:
    """The models that were fitted, the likeliest first."""
    rows = [
        (model.hypotheses, f"{model.log_evidence:+.1f}", f"{model.chi2_per_dof:.3g}", f"{100 * model.rms_error:.2f} %")
        for model in diagnosis.tried[:12]
    ]
    return Table(
        caption="Log odds against naming nothing, what is assumed beforehand included",
        head=("named", "log odds", "chi² per degree of freedom", "rms error"),
        rows=rows,
        numbers=(1, 2, 3),
    )


def table_figure(diagnosis: TableDiagnosis) -> Figure:
    """Errors of the frequencies, or resonances of the sweeps beside their law."""
    frequencies = [row for row in diagnosis.rows if isinstance(row, FrequencyRow)]
    if frequencies:
        return _frequency_figure(frequencies, extended=any(row.before_Hz != row.after_Hz for row in frequencies))
    return _sweep_figure(diagnosis, [row for row in diagnosis.rows if isinstance(row, SweepRow)])


def _identified(diagnosis: TableDiagnosis) -> Section:
    rows = [
        (name, f"{nominal:.4g}", f"{estimate.value:.4g}", f"{estimate.std:.2g}")
        for name, (nominal, estimate) in diagnosis.parameters.items()
    ]
    head = ("parameter", "nominal", "identified", "standard deviation")
    return Section(
        title="What was identified", tables=[Table(caption="Moduli in N/m²", head=head, rows=rows, numbers=(1, 2, 3))]
    )
