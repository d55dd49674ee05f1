"""The search: score all causes, refit the best, let evidence decide, and add causes while the data pay for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from twin.diagnose.candidate import Candidate
from twin.diagnose.cause import Cause
from twin.diagnose.climb import EXPLAINED, Climb, Stage
from twin.diagnose.footing import Footing, base_footing
from twin.diagnose.paying import FALSE, left_by_effects
from twin.diagnose.tournament import Report
from twin.identify.evidence import Evidence
from twin.identify.whitening import HarmonicResiduals

__all__ = ["Search", "search_causes"]

LESS = 0.8
"""Share of chi2 that another beginning must leave at most to be the better one, with no more causes."""


@dataclass(frozen=True)
class Search:
    """Outcome of a search.

    Attributes
    ----------
    footing : Footing
        The base family as it was fitted before any cause.
    base : Candidate
        The base family alone, in the best minimum that was found.
    model : Candidate
        The base family with every accepted cause.
    stages : tuple of Stage
    evidence : Evidence
        What `model` was fitted to: broadband runs may have been binned anew against what was found.
    harmonics : HarmonicResiduals, optional
        Of the steps, as `model` was fitted to them.
    """

    footing: Footing
    base: Candidate
    model: Candidate
    stages: tuple[Stage, ...]
    evidence: Evidence
    harmonics: HarmonicResiduals | None


def search_causes(
    evidence: Evidence,
    causes: Mapping[str, Cause],
    *,
    most: int = 3,
    footing: Footing | None = None,
    report: Report = lambda text: None,
) -> Search:
    """Find what the base family does not explain.

    Parameters
    ----------
    most
        Largest number of causes at once.
    footing
        Where to begin, if the base family has been fitted already.
    report
        Told what is being done.
    """
    if footing is None:
        report("fitting moduli, damping and the joint's law")
        footing = base_footing(evidence)
    excused = left_by_effects(evidence, footing.harmonics, footing.base)
    found = _climb(evidence, causes, footing, excused, most, report)
    for stage in _other_beginnings(found):
        if found.model.chi2_per_dof < EXPLAINED:
            break
        report(f"beginning again with {stage.finalists[0].blames[-1].key}")
        other = _climb(evidence, causes, footing, excused, most, report, first=stage)
        no_more = len(other.model.blames) <= len(found.model.blames)
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
    return [replace(first, finalists=(rival,), paying=(rival,)) for rival in first.paying[1:]]


def _climb(
    evidence: Evidence,
    causes: Mapping[str, Cause],
    footing: Footing,
    excused: float,
    most: int,
    report: Report,
    *,
    first: Stage | None = None,
) -> Search:
    climb = Climb(evidence, causes, footing, excused, report)
    climb.add_causes(most, first=first)
    return Search(footing, climb.base, climb.model, tuple(climb.stages), climb.evidence, climb.harmonics)
