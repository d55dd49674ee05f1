"""The report of a diagnosis: one self-contained page, the answer first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from twin.diagnose.result import Diagnosis, Estimate, Gain
from twin.views.answer import estimate_text, residual_rows
from twin.views.curves import compared_models
from twin.views.figures import broadband_figure, law_figure, modes_figure, residuals_figure, sweeps_figure
from twin.views.missing_force import missing_force_section
from twin.views.page import Picture, Section, Table, picture, require_folder, write_page
from twin.views.style import AFTER, BEFORE, CAUTION

__all__ = ["write_report"]

LEAST_SHARE = 0.005
"""Least share of chi2 worth a line."""
ACCENT = {"explained": AFTER, "none": "#007a5a", "ambiguous": CAUTION, "unknown": BEFORE}


def write_report(
    diagnosis: Diagnosis, path: Path, *, commands: Sequence[str] = (), title: str = "Diagnosis of a vibration test"
) -> None:
    """Write the report of `diagnosis`.

    Parameters
    ----------
    path
        The HTML file to write; replaced if it exists.
    commands
        What to type to get the same again.
    title
        Of the page.

    Raises
    ------
    InputError
        If `path` cannot be written.
    """
    require_folder(path)
    evidence = diagnosis.evidence
    runs = ", ".join(Path(run.path).name for run in evidence.runs)
    facts = (
        f"Rig {evidence.rig.name}, preload {evidence.preload}; recordings {runs}; {diagnosis.seconds:.0f} s of work."
    )
    write_page(
        path,
        title=title,
        answer=diagnosis.sentence,
        facts=facts,
        sections=[section for section in _sections(diagnosis, commands) if section is not None],
        accent=ACCENT[diagnosis.verdict],
    )


def _sections(diagnosis: Diagnosis, commands: Sequence[str]) -> Iterator[Section | None]:
    yield _gain(diagnosis)
    yield missing_force_section(diagnosis)
    yield _causes(diagnosis)
    yield _misfit(diagnosis)
    yield _sweeps(diagnosis)
    yield _broadband(diagnosis)
    yield _identified(diagnosis)
    yield _assumed(diagnosis)
    yield _uncertain(diagnosis)
    if commands:
        yield Section(title="To get this again", commands=commands)


def _gain(diagnosis: Diagnosis) -> Section | None:
    gain = diagnosis.gain
    if gain is None:
        return None
    where = ", ".join(gain.sweeps) + (f" of {', '.join(gain.runs)}" if gain.runs else "")
    floor = ("noise floor of the measurement", f"{100 * gain.noise_floor:.2f} %")
    caption = "Root-mean-square relative error of the complex response over the held-out steps"
    if len(gain.by_harmonic) > 1:
        caption += ", fundamental and second harmonic where it stands out, each relative to itself"
    if len(compared_models(diagnosis)) == 1:
        rows = [("believed rig, base family refitted", f"{100 * gain.before:.2f} %"), floor]
        return Section(
            title="On sweeps that were held out",
            texts=[f"No cause is in the model; this is its error on sweeps that no fit has seen: {where}."],
            tables=[Table(caption=caption, head=("model", "error"), rows=rows, numbers=(1,))],
        )
    fold = gain.before / gain.after if gain.after > 0 else np.inf
    rows = [
        ("believed rig, base family refitted", f"{100 * gain.before:.2f} %"),
        ("extended model", f"{100 * gain.after:.2f} %"),
        floor,
    ]
    tables = [Table(caption=caption, head=("model", "error"), rows=rows, numbers=(1,))]
    if len(gain.by_harmonic) > 1:
        tables.append(_by_harmonic(gain))
    told = f"The error falls {fold:.1f}-fold" if fold > 1.05 else "The error stays as it is"
    return Section(
        title="What naming it gains",
        texts=[f"{told} on sweeps that no fit has seen: {where}."],
        tables=tables,
    )


def _by_harmonic(gain: Gain) -> Table:
    """The same error of each harmonic alone."""
    return Table(
        caption="The same, of each harmonic alone",
        head=("harmonic", "values", "before", "after", "noise floor"),
        rows=[
            (str(harmonic), str(part.count), *(f"{100 * x:.2g} %" for x in (part.before, part.after, part.noise_floor)))
            for harmonic, part in gain.by_harmonic.items()
        ],
        numbers=(0, 1, 2, 3, 4),
    )


def _causes(diagnosis: Diagnosis) -> Section | None:
    if not diagnosis.causes:
        return None
    rows = []
    for cause in diagnosis.causes:
        values = "; ".join(f"{name} = {estimate_text(value)}" for name, value in cause.parameters.items())
        rows.append(
            (
                cause.cause,
                values,
                f"{cause.probability:.3f}",
                "yes" if cause.in_model else "no",
                ", ".join(cause.confused_with) or "nothing listed",
            )
        )
    summaries = [f"{cause.cause}: {cause.summary}." for cause in diagnosis.causes]
    return Section(
        title="Causes",
        tables=[
            Table(
                caption="Most probable first; parameters in SI units with one standard deviation",
                head=("cause", "parameters", "probability", "in the model", "could be confused with"),
                rows=rows,
                numbers=(2,),
            )
        ],
        items=summaries,
    )


def _misfit(diagnosis: Diagnosis) -> Section:
    misfit = diagnosis.misfit
    agrees = misfit.chi2_per_dof <= misfit.threshold
    where = [
        (str(place["run"]), str(place["channel"]), str(place["harmonic"]), f"{100 * place['share']:.1f} %")
        for place in misfit.where
        if place["share"] >= LEAST_SHARE
    ]
    tables = []
    if where:
        tables.append(
            Table(
                caption="Where the base family's chi² comes from, largest shares first",
                head=("recording", "channel", "harmonic", "share"),
                rows=where,
                numbers=(2, 3),
            )
        )
    rows = [(s, c, f"{before:.3g}", f"{after:.3g}") for s, c, before, after in residual_rows(diagnosis.sweeps)]
    if rows:
        tables.append(
            Table(
                caption="Root-mean-square residual of the fundamental, in standard deviations of its noise",
                head=("sweep", "channel", "before", "after"),
                rows=rows,
                numbers=(2, 3),
            )
        )
    pictures = []
    if diagnosis.sweeps:
        alt = (
            "Residuals in standard deviations against frequency, before and after, by channel and sweep. "
            + "; ".join(
                f"{s} {c}: {before:.3g} before, {after:.3g} after (rms)"
                for s, c, before, after in residual_rows(diagnosis.sweeps)
            )
        )
        caption = (
            "Residuals of the fundamental in standard deviations of the measurement's noise alone. Close to a sharp "
            "resonance a shift of a thousandth of a hertz already shows here; chi² also allows for such errors of the "
            "model."
        )
        pictures.append(
            picture(
                residuals_figure(diagnosis.sweeps, kinds=tuple(compared_models(diagnosis))), alt=alt, caption=caption
            )
        )
    verb = "agrees with" if agrees else "does not agree with"
    return Section(
        title="How far the believed model is from the data",
        texts=[
            f"Chi² per degree of freedom of the base family (moduli, damping and joint's law refitted) is "
            f"{misfit.chi2_per_dof:.3g}: it {verb} the data, the threshold being {misfit.threshold:.3g}."
            + (f" After the diagnosis it is {misfit.after:.3g}." if len(compared_models(diagnosis)) > 1 else "")
        ],
        tables=tables,
        pictures=pictures,
    )


def _sweeps(diagnosis: Diagnosis) -> Section | None:
    pictures = []
    for sweeps, told in (
        (diagnosis.sweeps, "that the models were fitted to"),
        (diagnosis.held_out, "held out of all fits"),
    ):
        if not sweeps:
            continue
        names = ", ".join(sweep.sweep for sweep in sweeps)
        peaks = "; ".join(
            f"{sweep.sweep} peaks at {sweep.frequency_Hz[int(np.argmax(np.abs(sweep.measured[:, -1])))]:.5g} Hz"
            for sweep in sweeps
        )
        pictures.append(
            picture(
                sweeps_figure(diagnosis.evidence, sweeps, kinds=("measured", *compared_models(diagnosis))),
                alt=f"Receptance against frequency for {names}, measured and by both models. {peaks}.",
                caption=f"Sweeps {told}: measured (points), before (dashed), after (solid); amplitude of displacement "
                "per newton. Before means the believed rig with moduli, damping and joint's law refitted.",
            )
        )
    return Section(title="Sweeps", pictures=pictures) if pictures else None


def _broadband(diagnosis: Diagnosis) -> Section | None:
    evidence, models = diagnosis.evidence, compared_models(diagnosis)
    pictures = [
        picture(
            broadband_figure(evidence, models, i),
            alt=f"Broadband responses of {', '.join(data.channels)} from {data.frequency_Hz[0]:.0f} to "
            f"{data.frequency_Hz[-1]:.0f} Hz, logarithmic, measured and by the models, with relative errors below.",
            caption=f"Broadband run {Path(data.run).name}: responses per force, and the models' relative errors beside "
            "one standard deviation of the measurement.",
        )
        for i, data in enumerate(evidence.broadband)
    ]
    return Section(title="Broadband responses", pictures=pictures) if pictures else None


def _identified(diagnosis: Diagnosis) -> Section:
    evidence, models = diagnosis.evidence, compared_models(diagnosis)
    model = list(models.values())[-1]
    base = model.unknowns.base
    std = np.sqrt(np.maximum(np.diag(model.solution.covariance), 0.0))
    believed = evidence.rig.joint.preload[evidence.preload]
    rows: list[tuple[str, ...]] = [
        (name, f"{1e-6 * was:.4g}", estimate_text(Estimate(1e-6 * now, 1e-6 * now * error)), "N/mm²")
        for name, was, now, error in (
            ("normal modulus E′", believed.normal_modulus, base.E, std[0]),
            ("shear modulus G′", believed.shear_modulus, base.G, std[1]),
        )
    ]
    ratios = evidence.rig.damping.modal_ratio
    for i, zeta in enumerate(base.zeta):
        was = ratios[min(i, len(ratios) - 1)]
        rows.append(
            (
                f"damping ratio of mode {i + 1}",
                f"{was:.3g}",
                estimate_text(Estimate(float(zeta), float(zeta * std[4 + i]))),
                "",
            )
        )
    pictures: list[Picture] = []
    law = law_figure(evidence, models)
    if law is not None:
        pictures.append(
            picture(
                law,
                alt="Softening and loss of the joint against amplitude on a logarithmic axis, with bands of one "
                "standard deviation, for both models.",
                caption="The joint's law with one standard deviation either way. Framed by the accepted model: a wrong "
                "one may need a law of quite another size, and then lies outside.",
            )
        )
    pictures.append(
        picture(
            modes_figure(evidence, model),
            alt="Deflection lines of both beams in the first modes, with the overlap shaded and the sensors marked.",
            caption="Modes of the identified structure without what the extension attaches to it.",
        )
    )
    return Section(
        title="What was identified",
        tables=[
            Table(
                caption="Of the accepted model, with one standard deviation",
                head=("parameter", "believed", "identified", "unit"),
                rows=rows,
                numbers=(1, 2),
            )
        ],
        pictures=pictures,
    )


def _assumed(diagnosis: Diagnosis) -> Section:
    evidence = diagnosis.evidence
    places = ", ".join(f"{o.channel} at {o.position_m:g} m" for o in evidence.outputs)
    rig = evidence.rig
    return Section(
        title="What was assumed",
        items=[
            f"The rig file: two beams with an overlap of {1e3 * rig.joint.overlap:g} mm, clamped at one end, driven at "
            f"{rig.drive.position:g} m; {places}. Anything else than the named causes is as it says.",
            "The joint is a thin layer with moduli E′ − s(X) and G′ + j l(X), smooth functions of one amplitude X.",
            "The force is what the force cell reads; the steps used were settled.",
            "The noise is estimated from the recordings themselves, and is Gaussian.",
            f"At most a few of the listed causes act at once. Anything up to chi² {diagnosis.misfit.threshold:g} per "
            "degree of freedom counts as agreement.",
        ],
    )


def _uncertain(diagnosis: Diagnosis) -> Section:
    items = list(diagnosis.notes)
    for cause in diagnosis.causes:
        if cause.in_model and cause.confused_with:
            items.append(f"These data do not tell {cause.cause} from {', '.join(cause.confused_with)}.")
    if diagnosis.gain is None:
        items.append("No sweep was held out, so the gain was not measured.")
    if diagnosis.next_test is not None:
        items.append(f"Next test: {diagnosis.next_test.why} ({diagnosis.next_test.procedure}).")
    items.append(
        "Standard deviations hold within the model; an effect that is on no list can move the values by more than "
        "they say."
    )
    return Section(title="What is uncertain", items=items)
