"""The report of a diagnosis: one self-contained page, the answer first."""

from collections.abc import Iterator, Sequence

import numpy as np

from twin.diagnose.answer.gain import Gain
from twin.diagnose.answer.result import Diagnosis, NamedCause
from twin.diagnose.posterior import temperature
from twin.diagnose.tables import TableDiagnosis
from twin.identify.identified import linear_estimates
from twin.views.curves import compared_models, has_law, shown_models
from twin.views.figures import law_figure
from twin.views.page import Page, Picture, Section, Table
from twin.views.reports.answer import (
    causes_table,
    errors_table,
    excluded_table,
    fitted_table,
    residuals_table,
    rivals_table,
    scores_table,
)
from twin.views.reports.fit_sections import (
    assumed_of_rig,
    broadband_section,
    fit_facts,
    modes_picture,
    residuals_picture,
    sweeps_picture,
)
from twin.views.reports.identified import linear_parameters, parameter_table
from twin.views.reports.missing_force import missing_force_section
from twin.views.reports.where import where_section
from twin.views.style import AFTER, BEFORE, CAUTION

ACCENT = {"explained": AFTER, "none": "#007a5a", "ambiguous": CAUTION, "unknown": BEFORE}
WITHIN_MODEL = (
    "Standard deviations hold within the model; an effect that is on no list can move the values by more than they say."
)


def diagnosis_page(diagnosis: Diagnosis) -> Page:
    """The report of `diagnosis`."""
    return Page(
        title="Diagnosis of a vibration test",
        answer=diagnosis.sentence,
        facts=f"{fit_facts(diagnosis.evidence)}; {diagnosis.seconds:.0f} s of work.",
        sections=[section for section in _sections(diagnosis) if section is not None],
        accent=ACCENT[diagnosis.verdict],
        files=diagnosis.files,
    )


def _sections(diagnosis: Diagnosis) -> Iterator[Section | None]:
    yield _gain(diagnosis)
    yield missing_force_section(diagnosis)
    yield causes_section(diagnosis.causes)
    yield where_section(diagnosis)
    yield excluded_section(diagnosis)
    yield _tried(diagnosis)
    yield _misfit(diagnosis)
    yield _sweeps(diagnosis)
    yield broadband_section(diagnosis.evidence, shown_models(diagnosis))
    yield _identified(diagnosis)
    yield _assumed(diagnosis)
    yield _uncertain(diagnosis)


def _gain(diagnosis: Diagnosis) -> Section | None:
    gain = diagnosis.gain
    if gain is None:
        return None
    where = ", ".join(gain.sweeps) + (f" of {', '.join(gain.runs)}" if gain.runs else "")
    several = len(compared_models(diagnosis)) > 1
    tables = [errors_table(gain, several=several)]
    if not several:
        return Section(
            title="On sweeps that were held out",
            texts=[f"No cause is in the model; this is its error on sweeps that no fit has seen: {where}."],
            tables=tables,
        )
    fold = gain.before / gain.after if gain.after > 0 else np.inf
    if len(gain.by_harmonic) > 1:
        tables.append(_by_harmonic(gain))
    told = f"The error falls {fold:.3g}-fold" if fold > 1.05 else "The error stays as it is"
    return Section(
        title="What naming it gains", texts=[f"{told} on sweeps that no fit has seen: {where}."], tables=tables
    )


def _by_harmonic(gain: Gain) -> Table:
    """The same error of each harmonic alone."""
    return Table(
        caption="The same, of each harmonic alone",
        head=("harmonic", "values", "before", "after", "noise floor"),
        rows=[
            (str(harmonic), str(part.count), *(f"{100 * x:.3g} %" for x in (part.before, part.after, part.noise_floor)))
            for harmonic, part in gain.by_harmonic.items()
        ],
        numbers=(0, 1, 2, 3, 4),
    )


def causes_section(causes: Sequence[NamedCause]) -> Section | None:
    """What is named; nothing where nothing is."""
    if not causes:
        return None
    return Section(
        title="Causes",
        tables=[causes_table(causes)],
        items=[f"{cause.cause}: {cause.summary}.  {cause.advice}".rstrip() for cause in causes],
    )


def excluded_section(diagnosis: Diagnosis | TableDiagnosis) -> Section | None:
    """What the data rule out."""
    if not diagnosis.excluded:
        return None
    return Section(
        title="What these data exclude",
        texts=[f"Together these hold 95 % of the probability: {', '.join(diagnosis.set_95)}."],
        tables=[excluded_table(diagnosis.excluded)],
    )


def _tried(diagnosis: Diagnosis) -> Section | None:
    """Why this cause and not another: first-order scores, and the models that were fitted."""
    stages = diagnosis.search.stages
    if not stages:
        return None
    tables = [rivals_table(diagnosis.hypotheses, temperature(diagnosis.evidence))] if diagnosis.hypotheses else []
    for number, stage in enumerate(stages, 1):
        of = f" (turn {number} of the search)" if len(stages) > 1 else ""
        tables.append(fitted_table(stage, caption=f"Models fitted to all evidence, the likeliest first{of}"))
        if number == 1:
            tables.append(scores_table(stage))
    return Section(
        title="Why this and nothing else",
        texts=[
            "Every listed cause is scored to first order at every place where it could sit, the best few are fitted "
            "together with moduli, damping and the joint's law, and the evidence decides."
        ],
        tables=[table for table in tables if table.rows],
    )


def _misfit(diagnosis: Diagnosis) -> Section:
    misfit = diagnosis.misfit
    agrees = misfit.chi2_per_dof <= misfit.threshold
    where = [
        (str(place["run"]), str(place["channel"]), str(place["harmonic"]), f"{100 * place['share']:.1f} %")
        for place in misfit.where
        if place["share"] >= 0.005  # worth a line
    ]
    several = len(compared_models(diagnosis)) > 1
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
    if diagnosis.sweeps:
        tables.append(residuals_table(diagnosis.sweeps, several=several))
    verb = "agrees with" if agrees else "does not agree with"
    return Section(
        title="How far the nominal model is from the data",
        texts=[
            f"Chi² per degree of freedom of the base family (moduli, damping and joint's law refitted) is "
            f"{misfit.chi2_per_dof:.3g}: it {verb} the data, the threshold being {misfit.threshold:.3g}."
            + (f" After the diagnosis it is {misfit.after:.3g}." if several else "")
        ],
        tables=tables,
        pictures=[residuals_picture(diagnosis.evidence, diagnosis.sweeps, kinds=tuple(shown_models(diagnosis)))]
        if diagnosis.sweeps
        else [],
    )


def _sweeps(diagnosis: Diagnosis) -> Section | None:
    if len(compared_models(diagnosis)) > 1:
        lines = "measured (points), before (dashed), after (solid)"
        meant = "Before means the nominal rig with moduli, damping and joint's law refitted"
    else:
        lines = "measured (points) and model (lines)"
        meant = "The model is the nominal rig with moduli, damping and joint's law refitted"
    pictures = [
        sweeps_picture(
            diagnosis.evidence, sweeps, kinds=tuple(shown_models(diagnosis)), caption=f"Sweeps {told}: {lines}. {meant}"
        )
        for sweeps, told in (
            (diagnosis.sweeps, "that the models were fitted to"),
            (diagnosis.held_out, "held out of all fits"),
        )
        if sweeps
    ]
    return Section(title="Sweeps", pictures=pictures) if pictures else None


def _identified(diagnosis: Diagnosis) -> Section:
    evidence, models = diagnosis.evidence, shown_models(diagnosis)
    model = list(models.values())[-1]
    linear = linear_estimates(model.baseline, model.solution, model.baseline, evidence)
    pictures = [
        modes_picture(
            evidence, model, caption="Modes of the identified structure without what the extension attaches to it."
        )
    ]
    if any(map(has_law, models.values())):
        law = Picture(
            draw=lambda: law_figure(evidence, models),
            alt="Softening of the joint over the opening of a point of its layer, and loss over its slip, on "
            "logarithmic axes, with bands of one standard deviation.",
            caption="The joint's law with one standard deviation either way, for each point of the layer by its own "
            "opening and slip. Shaded: amplitudes outside the measured range. Framed by the accepted model: a wrong "
            "one may need a law of quite another size, and then lies outside.",
        )
        pictures.insert(0, law)
    return Section(
        title="What was identified",
        tables=[
            parameter_table(
                linear_parameters(linear, evidence), caption="Of the accepted model, with one standard deviation"
            )
        ],
        pictures=pictures,
    )


def _assumed(diagnosis: Diagnosis) -> Section:
    return Section(
        title="What was assumed",
        items=[
            *assumed_of_rig(diagnosis.evidence),
            "Anything else than the named causes is as the rig file says. At most a few of the listed causes act at "
            f"once. Anything up to chi² {diagnosis.misfit.threshold:g} per degree of freedom counts as agreement.",
            "Nothing was drawn at random: the same files give the same answer, unless a time limit ends the search.",
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
        if diagnosis.next_test.sensor is not None:
            items.append(f"Or {diagnosis.next_test.sensor.why}.")
    return Section(title="What is uncertain", items=[*items, WITHIN_MODEL])
