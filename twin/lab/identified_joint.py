"""A joint identified from recordings: to save, to show and to go on with."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol

from matplotlib.figure import Figure

from twin.bench import open_bench
from twin.checks import FirstLook
from twin.diagnose.comparison import SweepComparison
from twin.diagnose.effects import left_out_effects
from twin.diagnose.sound_data import sound_data
from twin.identify.identified import Identified, identify_rig
from twin.identify.measured_data import MeasuredData
from twin.identify.polynomials import PolynomialFit
from twin.lab.model_result import FitPictures, IdentifiedModel
from twin.rigs import Rig, foreign_preload
from twin.structure.plausibility import unlikely_units
from twin.views.curves import Fitted
from twin.views.page import LEFT_OUT, Page
from twin.views.reports.identification import fitted_sweeps, identified_page, identified_sentence
from twin.views.reports.identified_figures import identified_law_figure, strength_figure
from twin.views.reports.identified_tables import determined, determined_table, parameter_table, residual_table
from twin.views.table import Table

Report = Callable[[str], None]


class Beside(Protocol):
    """Another identification of the same data, which is reported beside the joint's own law."""

    def __call__(self, found: Identified, evidence: MeasuredData, *, report: Report) -> Identified:
        """What was `found` with the other identification in it."""


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class IdentifiedJoint(FitPictures, IdentifiedModel):
    """A lap joint's moduli, damping and law, identified from recordings.

    Attributes
    ----------
    found : Identified
        Values, covariance, polynomials, residuals.
    evidence : MeasuredData
        The recordings, reduced.
    """

    found: Identified
    evidence: MeasuredData
    warnings: tuple[str, ...]

    @property
    def file(self) -> Rig:
        """The rig file with what was identified."""
        return self.found.rig

    @property
    def sentence(self) -> str:
        """What was identified, in one sentence."""
        return identified_sentence(self.found, self.evidence)

    def tables(self) -> Sequence[Table]:
        """Parameters, how well they are known, and residuals by sweep."""
        rows = determined(self.found, self.evidence)
        left = [residual_table(self.found)] if self.found.residual_percent else []
        return [parameter_table(rows), determined_table(rows), *left]

    def page(self) -> Page:
        """The report."""
        return identified_page(self.found, self.evidence, self.warnings).beginning(LEFT_OUT, self.assumed)

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
        return self.evidence, {"model": self.found}, fitted_sweeps(self.found, self.evidence)

    def to_dict(self) -> dict[str, Any]:
        """As ``twin identify --json`` prints it, without the model file's name."""
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
            "assumed": list(self.assumed),
            "warnings": list(self.warnings),
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
        warnings.append(f"the model predicts, but 'twin rehearse' cannot march it in time: {error}")
    if (foreign := foreign_preload(rig, runs[0].info)) and preload is None:
        warnings.append(foreign)
    return IdentifiedJoint(found=found, evidence=sound.evidence, warnings=(*warnings, *found.warnings))


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
