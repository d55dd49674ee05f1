"""Rivals for a cause, fitted side by side with less and less slack, the better ones staying."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from twin.diagnose.candidate import Blame, Candidate, extension_of, fit_candidate
from twin.diagnose.cause import main_strength
from twin.diagnose.score import Score
from twin.diagnose.side_by_side import side_by_side
from twin.identify.base_fit import law_from_steps, starting_unknowns
from twin.identify.evidence import Evidence
from twin.identify.linear_model import believed_parameters
from twin.identify.prediction import Predictor
from twin.identify.resonances import by_resonance
from twin.identify.unknowns import LOOSE, STIFF, TIGHT, Slack, Unknowns
from twin.identify.whitening import HarmonicResiduals

__all__ = [
    "LEAST_GAIN",
    "LEAST_SCORE",
    "SLACKS",
    "Report",
    "at_the_best_place",
    "best_of_each",
    "fitted_to_the_end",
    "tournament",
    "with_own_law",
]

FINALISTS = 3
FAVOURITES = 2
"""Causes with the best scores that are fitted to the end, whatever becomes of them on the way."""
LEAST_SCORE = 8.0
"""First-order gain of chi2 below which a cause is not tried."""
SLACKS = tuple(
    replace(slack, law_bend=STIFF.law_bend)
    for slack in (TIGHT, Slack(2e-4, 4.0), Slack(7e-4, 20.0), Slack(3e-3, 20.0, 0.1), Slack(1e-2, 40.0, 0.03), LOOSE)
)
"""Least to most slack while causes are sought: each step turns a part of the detunings, through which a fit follows the
resonances, into whatever physical parameters explain them.  Larger steps overshoot into false minima."""
FITTED_ANEW = 4
"""Times that a fit is begun again from the law beside it."""
LEAST_GAIN = 8.0
"""Least rise of the log evidence for a cause: one in some forty candidates, at odds of a hundred to one."""
SIFTED = 2
"""Place of the slack from which on rivals are compared; with more, those that fit best are not yet the right ones."""
ASTRAY = 100.0
"""Mean square of a beginning's residuals beyond which a tight fit does not find back to the resonances."""
TRIED_DETUNINGS = np.linspace(-0.06, 0.06, 121)
"""Of a swept mode whose resonance a rival has moved away from the data; a step is a fifth of its width or so."""
HOPELESS = 20.0
"""Chi2 over the best rival's beyond which one is dropped early."""
Report = Callable[[str], None]


def tournament(
    evidence: Evidence,
    harmonics: HarmonicResiduals | None,
    start: Unknowns,
    blames: list[tuple[Blame, ...]],
    slack: Slack,
    report: Report,
) -> list[Candidate]:
    """Fit rival models, the best scored first, with less and less slack; at each turn the better ones stay.

    `FINALISTS` are left at the end.
    """
    # Where the base family fits tightly, so do the rivals; else their causes may still be far off, and need it all.
    loosest = 0 if slack in (TIGHT, STIFF) else len(SLACKS) - 1
    field = [(_beginning(evidence, start, rival), rival) for rival in blames]
    report(f"comparing {len(field)} models, {SLACKS[loosest].detuning_std:g} of natural frequencies left open")
    if loosest == 0:
        field = side_by_side(_through_slack, (evidence, harmonics), field)
    for level in range(loosest, -1, -1):
        if level < loosest:
            report(f"comparing {len(field)} models, {SLACKS[level].detuning_std:g} of natural frequencies left open")
        tolerance = 4.0 if level else 2.0
        # While detunings explain nearly everything, a place would stray from where the scores saw it.
        held = "position_m" if level > SIFTED + 1 else ""
        fit = partial(_less_slack, slack=SLACKS[level], tolerance=tolerance, held=held)
        trials = side_by_side(fit, (evidence, harmonics), field)
        trials.sort(key=lambda c: -c.log_evidence)
        # With all slack a rival may still be on its way; after that, one that does not follow at all never will.
        stay = len(trials)
        if level <= SIFTED:
            stay = len(trials) // 2
        elif level < len(SLACKS) - 1:
            stay = sum(trial.chi2_per_dof < HOPELESS * trials[0].chi2_per_dof for trial in trials)
        # Nor do fits of one cause from its several beginnings differ by more than chance before that.
        siblings = 2 if level <= SIFTED else len(trials)
        best = best_of_each(trials, siblings)
        field = [(c.unknowns, c.blames) for c in _with_favourites(best, max(stay, FINALISTS), blames)]
    finalists = [(c.unknowns, c.blames) for c in _with_favourites(best_of_each(trials), 2 * FINALISTS, blames)]
    ended = side_by_side(partial(fitted_to_the_end, tolerance=2.0), (evidence, harmonics), finalists)
    return sorted(ended, key=lambda c: -c.log_evidence)[:FINALISTS]


def _beginning(evidence: Evidence, start: Unknowns, rival: tuple[Blame, ...]) -> Unknowns:
    """Where to fit a rival from: one without a strength is all or nothing, and what was fitted without it astray."""
    if main_strength(rival[-1].cause.parameters(evidence, rival[-1].label)) is not None:
        return start
    return starting_unknowns(evidence, extension=extension_of(evidence, rival))


def at_the_best_place(
    evidence: Evidence, harmonics: HarmonicResiduals | None, trials: list[Candidate], scores: list[Score]
) -> list[Candidate]:
    """The best models, after every other cause has been tried where the best one is.

    One that came to rest in a false minimum along the structure is not beaten fairly: a resonator tuned far above the
    band is a mass.
    """
    if not trials or "position_m" not in trials[0].blames[-1].values:
        return trials
    *before, best = trials[0].blames
    place = best.values["position_m"]
    nearest: dict[str, Score] = {}
    for score in scores:
        values, key = score.blame.values, score.blame.key
        if "position_m" in values and key != best.key and score.gain > LEAST_SCORE:
            rival = nearest.setdefault(key, score)
            if abs(values["position_m"] - place) < abs(rival.blame.values["position_m"] - place):
                nearest[key] = score
    moved = [replace(score.blame, values={**score.blame.values, "position_m": place}) for score in nearest.values()]
    field = [(trials[0].unknowns, (*before, blame)) for blame in moved]
    fit = partial(_less_slack, slack=STIFF, tolerance=2.0)
    there = sorted([*trials, *side_by_side(fit, (evidence, harmonics), field)], key=lambda c: -c.log_evidence)
    chosen = {trial.blames[-1].key for trial in trials}
    return [c for rank, c in enumerate(best_of_each(there)) if rank < FINALISTS or c.blames[-1].key in chosen]


def with_own_law(
    evidence: Evidence, harmonics: HarmonicResiduals | None, start: Unknowns, rival: tuple[Blame, ...], slack: Slack
) -> Unknowns:
    """Unknowns to begin from: with the law that the steps ask for beside this rival, where that fits better.

    Sharp resonances make a law that was found beside another model a trap.
    """
    if not len(evidence.steps):
        return start
    extension = extension_of(evidence, rival)
    predictor = Predictor(evidence, extension, harmonics, slack=slack)
    anew = law_from_steps(predictor, start.base)
    now, then = (predictor.evaluate(u, sensitivities=False).chi2 for u in (start, anew))
    return anew if then < now else start


def fitted_to_the_end(
    evidence: Evidence,
    harmonics: HarmonicResiduals | None,
    start: Unknowns,
    rival: tuple[Blame, ...],
    *,
    tolerance: float = 0.3,
) -> Candidate:
    """A rival fitted again and again from the law that the steps ask for beside it, while that helps.

    Where moduli, cause and law make up for each other a single fit creeps, and stops where its creeping seems an end.
    """
    best = fit_candidate(evidence, harmonics, start, rival, tolerance=tolerance)
    for _ in range(FITTED_ANEW):
        begin = with_own_law(evidence, harmonics, best.unknowns, best.blames, TIGHT)
        anew = fit_candidate(evidence, harmonics, begin, best.blames, tolerance=tolerance)
        creeping = anew.log_evidence > best.log_evidence + LEAST_GAIN
        best = max(best, anew, key=lambda candidate: candidate.log_evidence)
        if not creeping:
            break
    return best


def _less_slack(
    evidence: Evidence,
    harmonics: HarmonicResiduals | None,
    start: Unknowns,
    rival: tuple[Blame, ...],
    *,
    slack: Slack,
    tolerance: float,
    held: str = "",
) -> Candidate:
    """A rival fitted roughly with this slack, from its own law."""
    begin = with_own_law(evidence, harmonics, start, rival, slack)
    # With all slack the resonances, and with them the layer's motion, may still be far from what was measured.
    iterations = 15 if slack == SLACKS[-1] else 6
    return fit_candidate(
        evidence, harmonics, begin, rival, slack=slack, iterations=iterations, tolerance=tolerance, held=held
    )


def _through_slack(
    evidence: Evidence, harmonics: HarmonicResiduals | None, start: Unknowns, rival: tuple[Blame, ...]
) -> tuple[Unknowns, tuple[Blame, ...]]:
    """Where a cause that acts by its amplitude comes to rest as slack is taken away; another stays as it is.

    Its thresholds have false minima even beside a base family that follows the data.  So has any cause that begins so
    strong that the resonances are elsewhere: where only one of them was measured, moduli may make up for all of it.
    """
    if rival[-1].cause.tried_at_full_size:
        # What a base family made of such an effect leads nowhere: it begins from what is believed, with all slack.
        predictor = Predictor(evidence, extension_of(evidence, rival), harmonics)
        start = law_from_steps(predictor, believed_parameters(evidence.rig, evidence.preload))
        for slack in (LOOSE, SLACKS[SIFTED]):
            trial = fit_candidate(evidence, harmonics, start, rival, slack=slack, iterations=10, tolerance=4.0)
            start, rival = trial.unknowns, trial.blames
        return start, rival
    if rival[-1].nonlinear(evidence):
        loosest = SIFTED
    elif _astray(evidence, harmonics, start, rival):
        start, loosest = _on_the_resonances(evidence, start, rival), len(SLACKS) - 1
    else:
        return start, rival
    for level in range(loosest, 0, -1):
        trial = _less_slack(evidence, harmonics, start, rival, slack=SLACKS[level], tolerance=4.0)
        start, rival = trial.unknowns, trial.blames
    return start, rival


def _astray(evidence: Evidence, harmonics: HarmonicResiduals | None, start: Unknowns, rival: tuple[Blame, ...]) -> bool:
    begin = with_own_law(evidence, harmonics, start, rival, TIGHT)
    predictor = Predictor(evidence, extension_of(evidence, rival), harmonics, slack=TIGHT)
    found = predictor.evaluate(begin, sensitivities=False)
    return found.chi2 > ASTRAY * len(found.residual)


def _on_the_resonances(evidence: Evidence, start: Unknowns, rival: tuple[Blame, ...]) -> Unknowns:
    """The start with its natural frequencies moved to where the sweeps fit best, by trial: no slope leads there."""
    predictor = Predictor(evidence, extension_of(evidence, rival), slack=LOOSE)
    held = predictor.linearisation(start)
    if held is None:
        return start
    predictor = Predictor(evidence, extension_of(evidence, rival), slack=LOOSE, held=held)
    natural = predictor.model.basis.omega[: len(start.base.detuning)]
    for rows in by_resonance(evidence.steps.omega):
        mode = int(np.argmin(np.abs(np.log(natural / np.median(evidence.steps.omega[rows])))))
        trials = []
        for detuning in TRIED_DETUNINGS:
            moved = start.base.detuning.copy()
            moved[mode] = detuning
            trial = replace(start, base=replace(start.base, detuning=moved))
            trials.append((predictor.evaluate(trial, sensitivities=False).chi2, trial))
        start = min(trials, key=lambda trial: trial[0])[1]
    return start


def _with_favourites(trials: list[Candidate], count: int, blames: list[tuple[Blame, ...]]) -> list[Candidate]:
    """The first `count` trials, and those of the causes that were scored best.

    Near sharp resonances a rough fit of the right one may be the worst of all.
    """
    favourites = list(dict.fromkeys(rival[-1].key for rival in blames))[:FAVOURITES]
    return [c for rank, c in enumerate(trials) if rank < count or c.blames[-1].key in favourites]


def best_of_each(trials: list[Candidate], count: int = 1) -> list[Candidate]:
    """The first `count` fits of each cause and label."""
    seen: Counter[str] = Counter()
    kept = []
    for trial in trials:
        seen[trial.blames[-1].key] += 1
        if seen[trial.blames[-1].key] <= count:
            kept.append(trial)
    return kept
