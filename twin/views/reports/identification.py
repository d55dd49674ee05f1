"""The report of an identification from recordings: the answer, the law, how well it is known, what is left over."""

from collections.abc import Iterator, Sequence

import numpy as np

from twin.diagnose.comparison import SweepComparison, sweeps_beside
from twin.identify.identified import Identified
from twin.identify.limits import LIMITS
from twin.identify.measured_data import MeasuredData
from twin.identify.polynomials import PolynomialFit, Polynomials
from twin.identify.residual_model import ResidualModel
from twin.views.curves import joint_name, law_reach
from twin.views.page import Page, Picture, Section
from twin.views.reports.answer import estimate_text
from twin.views.reports.fit_sections import (
    assumed_of_rig,
    broadband_section,
    fit_facts,
    modes_picture,
    residuals_picture,
    sweeps_picture,
)
from twin.views.reports.identified_figures import file_law_bands, identified_law_figure, strength_figure
from twin.views.reports.identified_tables import (
    Determined,
    determined,
    determined_table,
    law_table,
    left_out_table,
    parameter_table,
    polynomial_table,
    residual_table,
)
from twin.views.style import AFTER, CAUTION

AMPLITUDE = {"softening": "an opening of", "loss": "a slip of"}


def fitted_sweeps(found: Identified, evidence: MeasuredData) -> tuple[SweepComparison, ...]:
    """Every sweep beside the identified model, which stands for both models of the comparison."""
    if not len(evidence.steps):
        return ()
    residual_model = ResidualModel(evidence)
    R, omega, _ = residual_model.step_receptance(found.baseline, inner=False)
    H = residual_model.responses(R, omega)
    return sweeps_beside(evidence, H, H)


def identified_sentence(found: Identified, evidence: MeasuredData) -> str:
    """The answer in one sentence."""
    rows = determined(found, evidence)
    moduli = " and ".join(
        f"{symbol}{' of ' + row.joint if row.joint else ''} = {estimate_text(row.estimate)} {row.unit}"
        for symbol, name in (("E′", "normal modulus E′"), ("G′", "shear modulus G′"))
        for row in rows
        if row.parameter == name
    )
    if found.chi2_per_dof > LIMITS.poor_fit:
        return (
            f"The model misses something: chi² per degree of freedom is {found.chi2_per_dof:.3g} even with "
            f"{moduli or 'the best damping ratios'}, and no value below can be relied on before 'twin diagnose' has "
            "named what it is."
        )
    told = f"The layer has {moduli}, mode" if moduli else "Mode"
    told += f" 1 {'' if moduli else 'has '}a damping ratio of {100 * found.baseline.base.zeta[0]:.3g} %"
    errors = list(found.residual_percent.values())
    if errors:
        for number, ((_, largest), _) in enumerate(law_reach(evidence, found)):
            fallen = float(np.max(found.baseline.laws[number].softening_at(np.linspace(0.0, largest, 200))))
            name, part = joint_name(evidence, number), fallen / found.baseline.base.E[number]
            told += (
                f"; E′{' of ' + name if name else ''} falls by up to {100 * part:.2g} % as far as the layer was opened "
                f"({1e6 * largest:.2g} µm)"
            )
        told += f", and the model meets the sweeps within {min(errors):.2g} to {max(errors):.2g} %"
    return f"{told}."


def identified_page(found: Identified, evidence: MeasuredData, warnings: Sequence[str]) -> Page:
    """The report of an identification; `warnings` are told beside what is uncertain by itself."""
    return Page(
        title=f"Identification of {'a bolted joint' if evidence.rig.joints else 'a structure'}",
        answer=identified_sentence(found, evidence),
        facts=f"{fit_facts(evidence)}.",
        sections=[section for section in _sections(found, evidence, warnings) if section is not None],
        accent=CAUTION if found.chi2_per_dof > LIMITS.poor_fit else AFTER,
    )


def _sections(found: Identified, evidence: MeasuredData, warnings: Sequence[str]) -> Iterator[Section | None]:
    rows = determined(found, evidence)
    yield _parameters(found, evidence, rows)
    if len(evidence.steps):
        yield _sweeps(found, evidence, fitted_sweeps(found, evidence))
    yield broadband_section(evidence, {"model": found})
    yield _determined(rows)
    if found.polynomials is not None:
        yield _levels(found.polynomials)
        yield _regularisation(found.polynomials.together)
    shapes = "With the joint at rest, and without what the rig file's effects attach."
    yield Section(title="Modes of the identified structure", pictures=[modes_picture(evidence, found, caption=shapes)])
    yield _assumed(evidence)
    yield _uncertain(rows, warnings)


def _parameters(found: Identified, evidence: MeasuredData, rows: Sequence[Determined]) -> Section:
    tables, pictures = [parameter_table(tuple(rows))], []
    if found.residual_percent and found.rig.joints:
        bands = file_law_bands(found, evidence)
        tables += [law_table(softening, loss) for softening, loss in zip(bands[::2], bands[1::2], strict=True)]
        told = "; ".join(
            f"{band.joint} at {AMPLITUDE[band.quantity]} {1e6 * band.amplitude_m[-1]:.3g} µm ".lstrip()
            + f"the {band.quantity} is {1e-6 * band.value[-1]:.3g} N/mm²"
            for band in bands
        )
        caption = (
            "The joint's law as the model file has it, for each point of the layer by its own opening and slip: "
            "splines, with one standard deviation either way. Shaded: amplitudes outside the measured range."
        )
        if found.polynomials is not None:
            caption += (
                " Below, over one sensor's amplitude: the same law as moduli of the whole layer that act alike on "
                "the lowest mode that was swept, and the papers' polynomials as far as they hold. Their own "
                "uncertainty is in their table."
            )
        pictures.append(
            Picture(
                draw=lambda: identified_law_figure(found, evidence),
                alt="Softening of the joint over the opening of a point of its layer, and loss modulus over its slip, "
                f"with bands of one standard deviation: {told}."
                + (" Below, the polynomials of each level over one sensor's amplitude." if found.polynomials else ""),
                caption=caption,
            )
        )
    if found.polynomials is not None:
        tables.append(polynomial_table(found.polynomials))
    return Section(title="What was identified", tables=tables, pictures=pictures)


def _sweeps(found: Identified, evidence: MeasuredData, sweeps: Sequence[SweepComparison]) -> Section:
    return Section(
        title="Sweeps and what is left of them",
        texts=[f"Chi² per degree of freedom of everything together is {found.chi2_per_dof:.3g}."],
        tables=[residual_table(found)],
        pictures=[
            sweeps_picture(evidence, sweeps, kinds=("model",), caption="Measured (points) and model (lines)"),
            residuals_picture(sweeps, kinds=("model",)),
        ],
    )


def _determined(rows: Sequence[Determined]) -> Section:
    little = [row.name for row in rows if row.little]
    told = (
        f"Rather assumed than measured, since the data narrow them less than twofold: {', '.join(little)}."
        if little
        else "The data narrow every parameter at least twofold."
    )
    return Section(
        title="How well the data determine it",
        texts=[
            f"{told} Two parameters whose correlation is near one are known better together than each by itself: a "
            "larger value of one is made up by the other."
        ],
        tables=[determined_table(tuple(rows))],
    )


def _levels(polynomials: Polynomials) -> Section:
    told = {
        None: "A single level cannot tell whether the law depends on the force",
        False: "The polynomials of all levels together do nearly as well as each level's own",
        True: "The law depends on the force: polynomials that fit each level by itself do not fit all together",
    }[polynomials.depends_on_force]
    each = ", ".join(f"{name} {fit.residual_percent:.2g} %" for name, fit in polynomials.levels.items())
    told += f" (all together leave {polynomials.together.residual_percent:.2g} %; by themselves {each})"
    tables = [left_out_table(polynomials)] if polynomials.left_out else []
    return Section(title="Whether the law depends on the force", texts=[f"{told}."], tables=tables)


def _regularisation(fit: PolynomialFit) -> Section:
    curve = fit.l_curve
    return Section(
        title="How strongly the polynomials were regularised",
        texts=[
            f"The orders {fit.orders[0]} and {fit.orders[1]} have the lowest Schwarz criterion up to order 4. The "
            f"L-curve's corner is at λ = {curve.corner:.2g}, generalised cross-validation is least at "
            f"λ = {curve.cross_validated:.2g}; every iteration begins with the corner of its own."
        ],
        pictures=[
            Picture(
                draw=lambda: strength_figure(fit),
                alt=f"Left: the L-curve, its corner at {curve.corner:.2g}. Middle: cross-validation against strength, "
                f"least at {curve.cross_validated:.2g}. Right: the residual's norm, from {fit.history[0].cost:.3g} to "
                f"{fit.history[-1].cost:.3g} in {len(fit.history) - 1} iterations.",
                caption="Polynomials of all levels together. L-curve and cross-validation are those of the first "
                "iteration, in units in which both functions move the response alike.",
            )
        ],
    )


def _assumed(evidence: MeasuredData) -> Section:
    return Section(
        title="What was assumed",
        items=[
            *assumed_of_rig(evidence),
            "The moduli are the same for all elements of a joint and in every mode.",
            "The model may be wrong by a little more than the noise, which counts as noise.",
            "Beforehand the moduli are assumed to within some per cent, the damping ratios to within a half.",
        ],
    )


def _uncertain(rows: Sequence[Determined], warnings: Sequence[str]) -> Section:
    items = [text[0].upper() + text[1:] + "." for text in warnings]
    items += [
        f"{row.name} and {row.partner} are known together rather than each: correlation {row.correlation:+.2f}."
        for row in rows
        if abs(row.correlation) > 0.9 and row.name < row.partner
    ]
    items.append(
        "Standard deviations hold within the model: an effect that it lacks can move the values by more than they say. "
        "'twin diagnose' looks for one."
    )
    return Section(title="What is uncertain", items=items)
