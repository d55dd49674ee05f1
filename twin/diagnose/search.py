"""The search: score all causes, refit the best, let evidence decide, and add causes while the data pay for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from twin.diagnose.candidate import Blame, Candidate, extension_of, fit_candidate
from twin.diagnose.cause import Cause, main_strength
from twin.diagnose.footing import FOLLOWS, Footing, base_footing
from twin.diagnose.score import Score, score_causes
from twin.diagnose.shortlist import shortlist
from twin.diagnose.side_by_side import side_by_side
from twin.diagnose.thin import thin_evidence
from twin.diagnose.thresholds import refined
from twin.diagnose.tournament import (
    LEAST_GAIN,
    SLACKS,
    Report,
    at_the_best_place,
    fitted_to_the_end,
    tournament,
    with_own_law,
)
from twin.identify.base_fit import starting_unknowns
from twin.identify.evidence import Evidence
from twin.identify.harmonics import harmonic_residuals
from twin.identify.prediction import Predictor
from twin.identify.rebinning import rebinned
from twin.identify.unknowns import LOOSE, TIGHT, Slack, Unknowns
from twin.identify.whitening import HarmonicResiduals

__all__ = ["LEAST_SHARE", "Search", "Stage", "search_causes"]

RIVAL = 1.5
"""Chi2 over the best finalist's up to which another is fitted to all evidence."""
EXPLAINED = 1.25
"""Chi2 per degree of freedom at which an extended model needs no other reduction of the recordings, nor beginning."""
PROMISING = 16.0
"""First-order gain of chi2 from which on a further cause is looked for: beside the right one, clean rigs' best is five.
Whatever is left may be small on the whole, as broadband runs count most, and yet all there is of a second cause."""
REDUCED_ANEW = 2
"""Times that the recordings are reduced against a model and it is fitted to them, while it does not explain them."""
LEAST_SHARE = 0.08
"""Least share of chi2 that a cause must take away: what is left of a clean rig's is the model's own error as much as
noise, and there is always something that would follow a twentieth of that."""
FALSE = 0.5
"""Share of chi2 that is left from another start where the first one had led into a false minimum."""
CLEAR = 2.0
"""Standard deviations from nothing."""
OWN_ERROR = 0.1
"""Largest model error of a cause that counts as leaving chi2 behind: larger ones say that strength and place are known
only together, not that the cause fits badly."""
LEAST_SHARE_OF_HARMONICS = 0.15
"""The same of the steps' higher harmonics, where a stop or a slap shows while the broadband runs know nothing of it."""


@dataclass(frozen=True)
class Stage:
    """One turn of the search: the models that were tried, best evidence first, and the first-order scores.

    `paying` are those of them that the data would pay for.
    """

    finalists: tuple[Candidate, ...]
    scores: tuple[Score, ...]
    paying: tuple[Candidate, ...]

    @property
    def accepted(self) -> bool:
        """Whether the first model was taken: the data pay for one."""
        return bool(self.paying)


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
    found = _climb(evidence, causes, footing, most, report)
    for stage in _other_beginnings(found):
        if found.model.chi2_per_dof < EXPLAINED:
            break
        report(f"beginning again with {stage.finalists[0].blames[-1].key}")
        other = _climb(evidence, causes, footing, most, report, first=stage)
        if other.model.chi2_per_dof < FALSE * found.model.chi2_per_dof:
            found = other
    return found


def _other_beginnings(found: Search) -> list[Stage]:
    """The first stage with each other finalist that paid in the place of the first.

    Of two causes that act at once, either may look less like the data than a third one does.
    """
    if not found.stages:
        return []
    first = found.stages[0]
    return [
        replace(first, finalists=(rival, *(f for f in first.finalists if f is not rival))) for rival in first.paying[1:]
    ]


def _climb(
    evidence: Evidence,
    causes: Mapping[str, Cause],
    footing: Footing,
    most: int,
    report: Report,
    *,
    first: Stage | None = None,
) -> Search:
    """Add the best cause again and again while the data pay for it; what `first` has found already is taken."""
    base, start, slack, harmonics = footing.base, footing.start, footing.slack, footing.harmonics
    model = base
    thinner, thin_harmonics = thin_evidence(evidence, harmonics)
    stages: list[Stage] = []
    # How many causes the model had that was last fitted anew; and what of chi2 the causes so far leave anyway.
    settled, left_behind = -1, 0.0
    while len(model.blames) < most:
        if first is not None and not stages:
            stages.append(first)
        else:
            report(f"looking for a further cause beside {model.blames[-1].key}" if model.blames else "scoring causes")
            left = {name: cause for name, cause in causes.items() if name not in {b.cause.name for b in model.blames}}
            scores = score_causes(thinner, thin_harmonics, replace(model, unknowns=start), left)
            promise = max((score.gain for score in scores), default=0.0)
            if model.blames and promise < max(PROMISING, left_behind * _count(thinner) / _count(evidence)):
                break
            finalists = _finalists(evidence, harmonics, (thinner, thin_harmonics), model, start, slack, scores, report)
            paying = _paying(evidence, finalists, model, left_behind)
            if finalists and settled < len(model.blames) and (paying or not model.blames):
                settled = len(model.blames)
                anew = _anew(evidence, harmonics, model, finalists[0].unknowns)
                if anew.log_evidence > model.log_evidence + LEAST_GAIN:
                    paying = _paying(evidence, finalists, anew, left_behind)
                    if not paying or anew.solution.chi2 < FALSE * model.solution.chi2:
                        # The model had come to rest in a false minimum, and was scored there.
                        base = base if model.blames else anew
                        model, start = anew, anew.unknowns
                        slack = TIGHT if anew.chi2_per_dof < FOLLOWS else slack
                        continue
            if paying:
                finalists = finalists[finalists.index(paying[0]) :]
            stages.append(Stage(tuple(finalists), tuple(scores), paying))
            if not paying:
                break
        before, model = model, stages[-1].finalists[0]
        left_behind += _left_behind(evidence, model.blames[-1], before.solution.chi2 - model.solution.chi2)
        for turn in range(REDUCED_ANEW):
            # What was reduced against a model far off also has that model's errors in it.
            if model.chi2_per_dof < EXPLAINED and (turn or before.chi2_per_dof < FOLLOWS):
                break
            report("reducing the recordings anew, against the model found")
            evidence, harmonics = _reduced_anew(evidence, harmonics, model)
            thinner, thin_harmonics = thin_evidence(evidence, harmonics)
            model = fit_candidate(evidence, harmonics, model.unknowns, model.blames, tolerance=0.3)
        slack = next((slack for slack in SLACKS if model.chi2_per_dof < FOLLOWS * slack.error_scale**2), SLACKS[-1])
        start = model.unknowns
        if slack is not TIGHT:
            start = fit_candidate(evidence, harmonics, start, model.blames, slack=LOOSE, iterations=8).unknowns
    if len(model.blames) > 1:
        report("asking whether every cause is needed")
        model = _pruned(evidence, harmonics, model)
    return Search(footing, base, model, tuple(stages), evidence, harmonics)


def _finalists(
    evidence: Evidence,
    harmonics: HarmonicResiduals | None,
    thin: tuple[Evidence, HarmonicResiduals | None],
    model: Candidate,
    start: Unknowns,
    slack: Slack,
    scores: list[Score],
    report: Report,
) -> list[Candidate]:
    """The best models with one more cause than `model`, fitted to all evidence, the most probable first."""
    best = [(*model.blames, blame) for blame in shortlist(thin[0], scores)]
    trials = at_the_best_place(*thin, tournament(*thin, start, best, slack, report), scores)
    # Where not even the best follows the data, any may be the first of two.
    largest = np.inf if not trials or trials[0].chi2_per_dof >= FOLLOWS else RIVAL * trials[0].chi2_per_dof
    field = [(trial.unknowns, trial.blames) for trial in trials if trial.chi2_per_dof <= largest]
    if field:
        report(f"refitting {', '.join(blames[-1].key for _, blames in field)} to all evidence")
    finalists = side_by_side(fitted_to_the_end, (evidence, harmonics), field)
    finalists.sort(key=lambda c: -c.log_evidence)
    if finalists:
        begin = partial(with_own_law, evidence, harmonics, slack=TIGHT)
        finalists[0] = refined(evidence, harmonics, finalists[0], begin=begin)
        temper = finalists[0].chi2_per_dof
        finalists.sort(key=lambda c: -c.weight(temper))
    return finalists


def _paying(
    evidence: Evidence, finalists: list[Candidate], model: Candidate, left_behind: float
) -> tuple[Candidate, ...]:
    """The finalists that the data would pay for, beside a model whose causes leave `left_behind` of chi2 anyway.

    One that follows the noise best may yet be too slight to be a cause; the next may not.
    """
    alone = not model.blames
    return tuple(
        finalist for finalist in finalists
        if _pays(evidence, finalist, model, by_strain=alone)
        and (alone or model.solution.chi2 - finalist.solution.chi2 > left_behind)
    )  # fmt: skip


def _anew(evidence: Evidence, harmonics: HarmonicResiduals | None, model: Candidate, start: Unknowns) -> Candidate:
    """The model fitted again as thoroughly as its rivals with a further cause: from where the best of them ended.

    With causes, also from the beginning: they were found beside a base family that had to make up for them.
    """
    best = fit_candidate(evidence, harmonics, start, model.blames, tolerance=0.3)
    if not model.blames:
        return best
    unknowns, blames = starting_unknowns(evidence, extension=extension_of(evidence, model.blames)), model.blames
    for slack in reversed(SLACKS):
        trial = fit_candidate(evidence, harmonics, unknowns, blames, slack=slack, tolerance=0.3)
        unknowns, blames = trial.unknowns, trial.blames
    trial = fitted_to_the_end(evidence, harmonics, unknowns, blames)
    return max(best, trial, key=lambda candidate: candidate.log_evidence)


def _reduced_anew(
    evidence: Evidence, harmonics: HarmonicResiduals | None, model: Candidate
) -> tuple[Evidence, HarmonicResiduals | None]:
    """Broadband runs binned, and the force's own harmonics carried to the channels, with the model found so far."""
    extension = extension_of(evidence, model.blames)
    if evidence.broadband:
        evidence = rebinned(evidence, extension, model.unknowns)
    if harmonics is not None:
        # What local nonlinear forces add is the prediction's matter.
        harmonics = harmonic_residuals(Predictor(evidence, replace(extension, nonlinear=())), model.unknowns)
    return evidence, harmonics


def _pruned(evidence: Evidence, harmonics: HarmonicResiduals | None, model: Candidate) -> Candidate:
    """Drop causes that the others have made superfluous, the earliest first: it was found when least was known."""
    for blame in model.blames:
        rest = tuple(b for b in model.blames if b is not blame and b.key != blame.key)
        if len(model.blames) < 2:
            break
        without = fit_candidate(evidence, harmonics, model.unknowns, rest, tolerance=0.3)
        if not _pays(evidence, model, without, blame):
            model = without
    return model


def _pays(
    evidence: Evidence, candidate: Candidate, model: Candidate, blame: Blame | None = None, *, by_strain: bool = True
) -> bool:
    """Whether a cause, the last one by default, is worth its parameters beside the model without it.

    What the base family can follow only by unlikely values, such as one mode's damping, costs no chi2.  A new cause may
    pay `by_strain` alone, not beside another: the base family also makes up for what the other's model has wrong.
    """
    blame = blame or candidate.blames[-1]
    temper = candidate.chi2_per_dof
    gain = candidate.weight(temper) - model.weight(temper)
    relief = 0.5 * (model.solution.penalty - candidate.solution.penalty)
    strained = by_strain and relief > LEAST_GAIN and _clear(evidence, blame)
    enough = (
        strained
        or candidate.solution.chi2 < (1 - LEAST_SHARE) * model.solution.chi2
        or candidate.chi2_of("harmonics") < (1 - LEAST_SHARE_OF_HARMONICS) * model.chi2_of("harmonics")
    )
    # While neither follows the data, how far either strains the base family says little beside the share it explains.
    far = candidate.chi2_per_dof > FOLLOWS and candidate.solution.cost < FALSE * model.solution.cost
    return (gain > LEAST_GAIN or far) and enough and not _negligible(evidence, blame)


def _left_behind(evidence: Evidence, blame: Blame, gain: float) -> float:
    """Chi2 that a cause whose model is wrong by a known share leaves of its own effect: no sign of a further cause."""
    errors = [p.model_error for p in blame.cause.parameters(evidence, blame.label)]
    return min(max(errors, default=0.0), OWN_ERROR) ** 2 * max(gain, 0.0)


def _count(evidence: Evidence) -> int:
    """Measured responses."""
    return sum(data.H.size for data in evidence.broadband) + evidence.steps.response[:, :, :1].size


def _clear(evidence: Evidence, blame: Blame) -> bool:
    """Whether a cause's strength is known to be there: one that only takes strain off the base family must be."""
    main = main_strength(blame.cause.parameters(evidence, blame.label))
    return main is None or abs(blame.values[main.name] - main.null) > CLEAR * blame.std[main.name]


def _negligible(evidence: Evidence, blame: Blame) -> bool:
    strengths = [p for p in blame.cause.parameters(evidence, blame.label) if not p.places]
    return bool(strengths) and all(abs(blame.values[p.name] - p.null) < p.negligible * p.scale for p in strengths)
