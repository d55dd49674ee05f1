"""The search: score all causes, refit the best, let evidence decide, and add causes while the data pay for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from twin.diagnose.acceptance import FALSE, left_by_effects
from twin.diagnose.baseline_fit import BaselineFit, fit_baseline
from twin.diagnose.cause import Cause
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.forward_selection import EXPLAINED, ForwardSelection, Stage
from twin.diagnose.successive_halving import Report
from twin.identify.measured_data import MeasuredData
from twin.identify.whitening import HarmonicResiduals

__all__ = ["Search", "search_causes"]

LESS = 0.8
"""Share of chi2 that another beginning must leave at most to be the better one, with no more causes."""


@dataclass(frozen=True)
class Search:
    """Outcome of a search.

    Attributes
    ----------
    baseline_fit : BaselineFit
        The base family as it was fitted before any cause.
    base : FittedModel
        The base family alone, in the best minimum that was found.
    model : FittedModel
        The base family with every accepted cause.
    stages : tuple of Stage
    evidence : MeasuredData
        What `model` was fitted to: broadband runs may have been binned anew against what was found.
    harmonics : HarmonicResiduals, optional
        Of the steps, as `model` was fitted to them.
    """

    baseline_fit: BaselineFit
    base: FittedModel
    model: FittedModel
    stages: tuple[Stage, ...]
    evidence: MeasuredData
    harmonics: HarmonicResiduals | None


def search_causes(
    evidence: MeasuredData,
    causes: Mapping[str, Cause],
    *,
    most: int = 3,
    baseline_fit: BaselineFit | None = None,
    report: Report = lambda text: None,
) -> Search:
    """Find what the base family does not explain.

    Parameters
    ----------
    most
        Largest number of causes at once.
    baseline_fit
        Where to begin, if the base family has been fitted already.
    report
        Told what is being done.
    """
    if baseline_fit is None:
        report("fitting moduli, damping and the joint's law")
        baseline_fit = fit_baseline(evidence)
    expected_residual_chi2 = left_by_effects(evidence, baseline_fit.harmonics, baseline_fit.base)
    found = _forward_selection(evidence, causes, baseline_fit, expected_residual_chi2, most, report)
    for stage in _other_beginnings(found):
        if found.model.chi2_per_dof < EXPLAINED:
            break
        report(f"beginning again with {stage.finalists[0].hypotheses[-1].key}")
        other = _forward_selection(evidence, causes, baseline_fit, expected_residual_chi2, most, report, first=stage)
        no_more = len(other.model.hypotheses) <= len(found.model.hypotheses)
        if other.model.chi2_per_dof < (LESS if no_more else FALSE) * found.model.chi2_per_dof:
            found = other
    return found


def _other_beginnings(found: Search) -> list[Stage]:
    """The first stage with each other finalist that paid, alone: how they compared holds beside no further cause.

    Of two causes that act at once, either may look less like the data than a third one does.
    """
    if not found.stages:
        return []
    first = found.stages[0]
    return [replace(first, finalists=(rival,), acceptance=(rival,)) for rival in first.acceptance[1:]]


def _forward_selection(
    evidence: MeasuredData,
    causes: Mapping[str, Cause],
    baseline_fit: BaselineFit,
    expected_residual_chi2: float,
    most: int,
    report: Report,
    *,
    first: Stage | None = None,
) -> Search:
    forward_selection = ForwardSelection(evidence, causes, baseline_fit, expected_residual_chi2, report)
    forward_selection.add_causes(most, first=first)
    return Search(
        baseline_fit,
        forward_selection.base,
        forward_selection.model,
        tuple(forward_selection.stages),
        forward_selection.evidence,
        forward_selection.harmonics,
    )
