"""A joint identified from recordings: the answer, the law, how well it is known, what is left over."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from matplotlib.figure import Figure

from twin.bench import open_bench
from twin.checks import FirstLook
from twin.diagnose.answer.comparison import SweepComparison, sweeps_beside
from twin.diagnose.effects import left_out_effects
from twin.diagnose.sound_data import sound_data
from twin.identify.identified import Identified, identify_rig
from twin.identify.limits import LIMITS
from twin.identify.measured_data import MeasuredData
from twin.identify.polynomials import PolynomialFit, Polynomials
from twin.identify.residuals.residual_model import ResidualModel
from twin.lab.given import Report
from twin.lab.model_result import FitPictures, IdentifiedModel
from twin.rigs import Rig, foreign_preload
from twin.structure.plausibility import unlikely_units
from twin.views.curves import Fitted, joint_name, law_reach
from twin.views.page import LEFT_OUT, Page, Picture, Section
from twin.views.reports.answer import sentences
from twin.views.reports.fit_sections import (
    assumed_of_rig,
    broadband_section,
    fit_facts,
    modes_picture,
    residuals_picture,
    sweeps_picture,
)
from twin.views.reports.identified import (
    Determined,
    determined,
    determined_table,
    file_law_bands,
    identified_law_figure,
    law_table,
    left_out_table,
    parameter_table,
    polynomial_table,
    residual_table,
    strength_figure,
)
from twin.views.style import AFTER, CAUTION
from twin.views.table import Table

AMPLITUDE = {"softening": "an opening of", "loss": "a slip of"}


class Beside(Protocol):
    """Another identification of the same data, which is reported beside the joint's own law."""

    def __call__(self, found: Identified, evidence: MeasuredData, *, report: Report) -> Identified:
        """What was `found` with the other identification in it."""


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class IdentifiedJoint(FitPictures, IdentifiedModel):
    """A lap joint's moduli, damping and law, identified from recordings."""

    found: Identified
    """Values, covariance, polynomials, residuals."""
    evidence: MeasuredData
    """The recordings, reduced."""

    @property
    def file(self) -> Rig:
        """The rig file with what was identified."""
        return self.found.rig

    @property
    def sentence(self) -> str:
        """What was identified, in one sentence."""
        found, evidence, rows = self.found, self.evidence, self._determined
        moduli = " and ".join(
            f"{symbol}{' of ' + row.joint if row.joint else ''} = {row.estimate} {row.unit}"
            for symbol, name in (("E′", "normal modulus E′"), ("G′", "shear modulus G′"))
            for row in rows
            if row.parameter == name
        )
        if found.chi2_per_dof > LIMITS.poor_fit:
            return (
                f"The model misses something: chi² per degree of freedom is {found.chi2_per_dof:.3g} even with "
                f"{moduli or 'the best damping ratios'}, and no value below can be relied on before 'twin diagnose' "
                "has named what it is."
            )
        told = f"The layer has {moduli}, mode" if moduli else "Mode"
        told += f" 1 {'' if moduli else 'has '}a damping ratio of {100 * found.baseline.base.zeta[0]:.3g} %"
        errors = list(found.residual_percent.values())
        if errors:
            for number, ((_, largest), _) in enumerate(law_reach(evidence, found)):
                fallen = float(np.max(found.baseline.laws[number].softening_at(np.linspace(0.0, largest, 200))))
                name, part = joint_name(evidence, number), fallen / found.baseline.base.E[number]
                told += (
                    f"; E′{' of ' + name if name else ''} falls by up to {100 * part:.2g} % as far as the layer was "
                    f"opened ({1e6 * largest:.2g} µm)"
                )
            told += f", and the model meets the sweeps within {min(errors):.2g} to {max(errors):.2g} %"
        return f"{told}."

    def tables(self) -> Sequence[Table]:
        """Parameters, how well they are known, and residuals by sweep."""
        left = [residual_table(self.found)] if self.found.residual_percent else []
        return [parameter_table(self._determined), determined_table(self._determined), *left]

    @cached_property
    def _determined(self) -> tuple[Determined, ...]:
        return determined(self.found, self.evidence)

    @cached_property
    def _sweeps(self) -> tuple[SweepComparison, ...]:
        """Every sweep beside the identified model, which stands for both models of the comparison."""
        if not len(self.evidence.steps):
            return ()
        residual_model = ResidualModel(self.evidence)
        R, omega, _ = residual_model.step_receptance(self.found.baseline, inner=False)
        H = residual_model.responses(R, omega)
        return sweeps_beside(self.evidence, H, H)

    def page(self) -> Page:
        """The report; the warnings are told beside what is uncertain by itself."""
        page = Page(
            title=f"Identification of {'a bolted joint' if self.evidence.rig.joints else 'a structure'}",
            answer=self.sentence,
            facts=f"{fit_facts(self.evidence)}.",
            sections=[section for section in self._sections() if section is not None],
            accent=CAUTION if self.found.chi2_per_dof > LIMITS.poor_fit else AFTER,
            files=self.evidence.sources,
        )
        return page.beginning(LEFT_OUT, self.assumed)

    def _sections(self) -> Iterator[Section | None]:
        found, evidence = self.found, self.evidence
        yield self._parameter_section()
        if len(evidence.steps):
            yield Section(
                title="Sweeps and what is left of them",
                texts=[f"Chi² per degree of freedom of everything together is {found.chi2_per_dof:.3g}."],
                tables=[residual_table(found)],
                pictures=[
                    sweeps_picture(
                        evidence, self._sweeps, kinds=("model",), caption="Measured (points) and model (lines)"
                    ),
                    residuals_picture(evidence, self._sweeps, kinds=("model",)),
                ],
            )
        yield broadband_section(evidence, {"model": found})
        yield self._determined_section()
        if found.polynomials is not None:
            yield _levels(found.polynomials)
            yield _regularisation(found.polynomials.together)
        shapes = modes_picture(
            evidence, found, caption="With the joint at rest, and without what the rig file's effects attach."
        )  # fmt: skip
        yield Section(title="Modes of the identified structure", pictures=[shapes])
        assumed = [
            *assumed_of_rig(evidence),
            "The moduli are the same for all elements of a joint and in every mode.",
            "The model may be wrong by a little more than the noise, which counts as noise.",
            "Beforehand the moduli are assumed to within some per cent, the damping ratios to within a half.",
        ]
        yield Section(title="What was assumed", items=assumed)
        yield self._uncertain_section()

    def _parameter_section(self) -> Section:
        found, evidence = self.found, self.evidence
        tables, pictures = [parameter_table(self._determined)], []
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
            below = " Below, the polynomials of each level over one sensor's amplitude." if found.polynomials else ""
            alt = (
                "Softening of the joint over the opening of a point of its layer, and loss modulus over its slip, with "
                f"bands of one standard deviation: {told}.{below}"
            )
            pictures.append(Picture(draw=self.plot_law, alt=alt, caption=caption))
        if found.polynomials is not None:
            tables.append(polynomial_table(found.polynomials))
        return Section(title="What was identified", tables=tables, pictures=pictures)

    def _determined_section(self) -> Section:
        little = [row.name for row in self._determined if row.little]
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
            tables=[determined_table(self._determined)],
        )

    def _uncertain_section(self) -> Section:
        items = [
            *sentences(self.warnings),
            *(
                f"{row.name} and {row.partner} are known together rather than each: correlation {row.correlation:+.2f}."
                for row in self._determined
                if abs(row.correlation) > 0.9 and row.name < row.partner
            ),
            "Standard deviations hold within the model: an effect that it lacks can move the values by more than they "
            "say. 'twin diagnose' looks for one.",
        ]
        return Section(title="What is uncertain", items=items)

    def plot_law(self) -> Figure:
        """Softening over opening and loss over slip, with one standard deviation, and the papers' polynomials."""
        if not (len(self.evidence.steps) and self.evidence.rig.joints):
            raise ValueError("no joint's law was seen: there is no joint, or nothing was measured by stepped sines")
        return identified_law_figure(self.found, self.evidence)

    def plot_strength(self) -> Figure:
        """L-curve, cross-validation and iterations of the polynomials of all levels."""
        if self.found.polynomials is None:
            raise ValueError("no polynomials were identified: there are no sweeps, or too few steps")
        return strength_figure(self.found.polynomials.together)

    def _fit(self) -> tuple[MeasuredData, Mapping[str, Fitted], Sequence[SweepComparison]]:
        return self.evidence, {"model": self.found}, self._sweeps

    def _values(self) -> dict[str, Any]:
        found = self.found
        laws = {joint.name: joint.law.model_dump() for joint in found.rig.joints if joint.law is not None}
        channel = self.evidence.channels[self.evidence.reference]
        nonlinear: dict[str, Any] = {"law": next(iter(laws.values()))} if len(laws) == 1 else {"laws": laws}
        nonlinear["channel"] = channel
        if found.polynomials is not None:
            levels = {name: _fit_dict(fit) for name, fit in found.polynomials.levels.items()}
            nonlinear["polynomials"] = levels | {"all": _fit_dict(found.polynomials.together)}
            nonlinear["residual_percent"] = found.polynomials.residual_percent
            nonlinear["left_out"] = {name: asdict(one) for name, one in found.polynomials.left_out.items()}
            nonlinear["depends_on_force"] = found.polynomials.depends_on_force
        return {
            "preload": found.preload,
            "linear": {
                name: [asdict(e) for e in entry] if isinstance(entry, list) else asdict(entry)
                for name, entry in found.linear.items()
            },
            **({"joints": [joint.name for joint in found.rig.joints]} if len(found.rig.joints) > 1 else {}),
            "nonlinear": nonlinear,
            "residual_percent": found.residual_percent,
            "chi2_per_dof": found.chi2_per_dof,
        }


def identify_recordings(
    looked: FirstLook, rig: Rig, *, source: str, preload: str | None, report: Report, beside: Beside | None
) -> IdentifiedJoint:
    """Moduli, damping and joint law from recordings that passed a first look; `source` names the rig in errors."""
    runs = looked.runs
    report("reducing the runs to responses")
    sound = sound_data(runs, rig, preload=preload, source=source)
    found = identify_rig(sound.evidence, report=report)
    if beside is not None:
        found = beside(found, sound.evidence, report=report)
    warnings = [*(f"implausible: {line}" for line in unlikely_units(rig)), *looked.told, *left_out_effects(rig.effect)]
    warnings += [f"{finding.cause}: {finding.summary}" for finding in sound.findings]
    try:
        open_bench(found.rig)
    except ValueError as error:
        warnings.append(f"the model predicts, but 'twin rehearse' cannot integrate it in time: {error}")
    if (foreign := foreign_preload(rig, runs[0].info)) and preload is None:
        warnings.append(foreign)
    return IdentifiedJoint(found=found, evidence=sound.evidence, warnings=(*warnings, *found.warnings))


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


def _fit_dict(fit: PolynomialFit) -> dict[str, Any]:
    curve = fit.l_curve
    return {
        "g1": {"coefficients": fit.softening, "std": fit.std[0], "order": fit.orders[0]},
        "g2": {"coefficients": fit.loss, "std": fit.std[1], "order": fit.orders[1]},
        "covariance": fit.covariance,
        "bic": fit.bic,
        "largest_amplitude_m": fit.largest_amplitude_m,
        "residual_percent": fit.residual_percent,
        "l_curve": {
            "lambda": curve.strength, "rho": curve.residual_norm, "eta": curve.solution_norm,
            "corner": curve.corner, "cross_validated": curve.cross_validated,
        },
        "history": [
            {"cost": step.cost, "g1": step.softening, "g2": step.loss, "lambda": step.strength} for step in fit.history
        ],
    }  # fmt: skip
