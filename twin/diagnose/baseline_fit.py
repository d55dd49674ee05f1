"""Where a search stands before it names anything: the base family fitted, and how tightly it follows the data."""

from __future__ import annotations

from dataclasses import dataclass

from twin.diagnose.fitted_model import FittedModel, fit_model
from twin.diagnose.successive_halving import DISCREPANCY_LEVELS
from twin.identify.base_fit import fit_base
from twin.identify.baseline_parameters import LOOSE, TIGHT, BaselineParameters, DiscrepancyLevel
from twin.identify.harmonics import harmonic_residuals
from twin.identify.measured_data import MeasuredData
from twin.identify.residual_model import ResidualModel
from twin.identify.whitening import HarmonicResiduals

__all__ = ["FOLLOWS", "BaselineFit", "fit_baseline"]

FOLLOWS = 4.0
"""Chi2 per degree of freedom up to which a model follows the data roughly."""


@dataclass(frozen=True, kw_only=True)
class BaselineFit:
    """The base family alone.

    Attributes
    ----------
    base : FittedModel
        Its tight fit.
    start : BaselineParameters
        Where causes are scored: the tight fit where that follows the data, else one with frequency discrepancies,
        which say best where the resonances are.
    discrepancy : DiscrepancyLevel
        The least with which it roughly follows the data: first order holds there.
    harmonics : HarmonicResiduals, optional
        Of the steps.
    """

    base: FittedModel
    start: BaselineParameters
    discrepancy: DiscrepancyLevel
    harmonics: HarmonicResiduals | None


def fit_baseline(evidence: MeasuredData) -> BaselineFit:
    """Fit the base family."""
    aligned, _ = fit_base(evidence, discrepancy_levels=(LOOSE,))
    harmonics = harmonic_residuals(ResidualModel(evidence), aligned) if len(evidence.steps) else None
    base, discrepancy = _least_discrepancy(evidence, harmonics, aligned)
    start = base.baseline if discrepancy is TIGHT else aligned
    return BaselineFit(base=base, start=start, discrepancy=discrepancy, harmonics=harmonics)


def _least_discrepancy(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, start: BaselineParameters
) -> tuple[FittedModel, DiscrepancyLevel]:
    """The tight fit, and the least discrepancy with which the base family roughly follows the data."""
    least, follows = DISCREPANCY_LEVELS[-1], True
    for discrepancy in (*reversed(DISCREPANCY_LEVELS[1:]), TIGHT):
        iterations, tolerance = (20, 0.1) if discrepancy is TIGHT else (8, 0.3)
        trial = fit_model(
            evidence, harmonics, start, (), discrepancy=discrepancy, iterations=iterations, tolerance=tolerance
        )
        follows = follows and trial.chi2_per_dof < FOLLOWS
        least = discrepancy if follows else least
        start = trial.baseline
    # With discrepancy the moduli are held, and a fit may have to wait for the last to move them.
    return trial, TIGHT if trial.chi2_per_dof < FOLLOWS else least
