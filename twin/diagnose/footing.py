"""Where a search stands before it blames anything: the base family fitted, and how tightly it follows the data."""

from __future__ import annotations

from dataclasses import dataclass

from twin.diagnose.candidate import Candidate, fit_candidate
from twin.diagnose.tournament import SLACKS
from twin.identify.base_fit import fit_base
from twin.identify.evidence import Evidence
from twin.identify.harmonics import harmonic_residuals
from twin.identify.prediction import Predictor
from twin.identify.unknowns import LOOSE, TIGHT, Slack, Unknowns
from twin.identify.whitening import HarmonicResiduals

__all__ = ["FOLLOWS", "Footing", "base_footing"]

FOLLOWS = 4.0
"""Chi2 per degree of freedom up to which a model follows the data roughly."""


@dataclass(frozen=True, kw_only=True)
class Footing:
    """The base family alone.

    Attributes
    ----------
    base : Candidate
        Its tight fit.
    start : Unknowns
        Where causes are scored: the tight fit where that follows the data, else one with detunings, which say best
        where the resonances are.
    slack : Slack
        The least with which it roughly follows the data: first order holds there.
    harmonics : HarmonicResiduals, optional
        Of the steps.
    """

    base: Candidate
    start: Unknowns
    slack: Slack
    harmonics: HarmonicResiduals | None


def base_footing(evidence: Evidence) -> Footing:
    """Fit the base family."""
    aligned, _ = fit_base(evidence, slacks=(LOOSE,))
    harmonics = harmonic_residuals(Predictor(evidence), aligned) if len(evidence.steps) else None
    base, slack = _least_slack(evidence, harmonics, aligned)
    start = base.unknowns if slack is TIGHT else aligned
    return Footing(base=base, start=start, slack=slack, harmonics=harmonics)


def _least_slack(evidence: Evidence, harmonics: HarmonicResiduals | None, start: Unknowns) -> tuple[Candidate, Slack]:
    """The tight fit, and the least slack with which the base family roughly follows the data."""
    least, follows = SLACKS[-1], True
    for slack in (*reversed(SLACKS[1:]), TIGHT):
        iterations, tolerance = (20, 0.1) if slack is TIGHT else (8, 0.3)
        trial = fit_candidate(evidence, harmonics, start, (), slack=slack, iterations=iterations, tolerance=tolerance)
        follows = follows and trial.chi2_per_dof < FOLLOWS
        least = slack if follows else least
        start = trial.unknowns
    # With slack the moduli are held, and a fit may have to wait for the last to move them.
    return trial, TIGHT if trial.chi2_per_dof < FOLLOWS else least
