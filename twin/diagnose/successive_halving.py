"""Rivals for a cause, fitted side by side with less and less discrepancy, the better ones staying."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from twin.diagnose.cause import main_strength
from twin.diagnose.fitted_model import CauseHypothesis, FittedModel, fit_model, modification_of
from twin.diagnose.parallel_map import parallel_map
from twin.diagnose.score import Score
from twin.identify.base_fit import law_from_steps, starting_baseline
from twin.identify.baseline_parameters import LOOSE, STIFF, TIGHT, BaselineParameters, DiscrepancyLevel
from twin.identify.linear_model import nominal_parameters
from twin.identify.measured_data import MeasuredData
from twin.identify.residual_model import ResidualModel
from twin.identify.resonances import by_resonance
from twin.identify.whitening import HarmonicResiduals

__all__ = [
    "DISCREPANCY_LEVELS",
    "LEAST_GAIN",
    "LEAST_SCORE",
    "Report",
    "at_the_best_place",
    "best_of_each",
    "fitted_to_the_end",
    "successive_halving",
    "with_own_law",
]

FINALISTS = 3
FAVOURITES = 2
"""Causes with the best scores that are fitted to the end, whatever becomes of them on the way."""
LEAST_SCORE = 8.0
"""First-order gain of chi2 below which a cause is not tried."""
DISCREPANCY_LEVELS = tuple(
    replace(discrepancy, law_bend=STIFF.law_bend)
    for discrepancy in (
        TIGHT,
        DiscrepancyLevel(2e-4, 4.0),
        DiscrepancyLevel(7e-4, 20.0),
        DiscrepancyLevel(3e-3, 20.0, 0.1),
        DiscrepancyLevel(1e-2, 40.0, 0.03),
        LOOSE,
    )
)
"""Least to most discrepancy while causes are sought: each step turns a part of the frequency discrepancies, through
which a fit follows the resonances, into whatever physical parameters explain them.  Larger steps overshoot
into false minima."""
FITTED_ANEW = 4
"""Times that a fit is begun again from the law beside it."""
LEAST_GAIN = 8.0
"""Least rise of the log evidence for a cause: one in some forty candidates, at odds of a hundred to one."""
SIFTED = 2
"""Place of the discrepancy from which on rivals are compared; with more, those that fit best are not yet the right
ones."""
ASTRAY = 100.0
"""Mean square of a beginning's residuals beyond which a tight fit does not find back to the resonances."""
TRIED_DETUNINGS = np.linspace(-0.06, 0.06, 121)
"""Of a swept mode whose resonance a rival has moved away from the data; a step is a fifth of its width or so."""
HOPELESS = 20.0
"""Chi2 over the best rival's beyond which one is dropped early."""
Report = Callable[[str], None]


def successive_halving(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    hypotheses: list[tuple[CauseHypothesis, ...]],
    discrepancy: DiscrepancyLevel,
    report: Report,
) -> list[FittedModel]:
    """Fit rival models, the best scored first, with less and less discrepancy; at each turn the better ones stay.

    `FINALISTS` are left at the end.
    """
    # Where the base family fits tightly, so do the rivals; else their causes may still be far off, and need it all.
    loosest = 0 if discrepancy in (TIGHT, STIFF) else len(DISCREPANCY_LEVELS) - 1
    field = [(_beginning(evidence, start, rival), rival) for rival in hypotheses]
    report(f"comparing {len(field)} models at discrepancy level {loosest}")
    if loosest == 0:
        field = parallel_map(_through_discrepancy, (evidence, harmonics), field)
    for level in range(loosest, -1, -1):
        if level < loosest:
            report(f"comparing {len(field)} models at discrepancy level {level}")
        tolerance = 4.0 if level else 2.0
        # While frequency discrepancies explain nearly everything, a place would stray from where the scores saw it.
        held = "position_m" if level > SIFTED + 1 else ""
        fit = partial(_less_discrepancy, discrepancy=DISCREPANCY_LEVELS[level], tolerance=tolerance, held=held)
        trials = parallel_map(fit, (evidence, harmonics), field)
        trials.sort(key=lambda c: -c.log_evidence)
        # With all discrepancy a rival may still be on its way; after that, one that does not follow at all never will.
        stay = len(trials)
        if level <= SIFTED:
            stay = len(trials) // 2
        elif level < len(DISCREPANCY_LEVELS) - 1:
            stay = sum(trial.chi2_per_dof < HOPELESS * trials[0].chi2_per_dof for trial in trials)
        # Nor do fits of one cause from its several beginnings differ by more than chance before that.
        siblings = 2 if level <= SIFTED else len(trials)
        best = best_of_each(trials, siblings)
        field = [(c.baseline, c.hypotheses) for c in _with_favourites(best, max(stay, FINALISTS), hypotheses)]
    finalists = [(c.baseline, c.hypotheses) for c in _with_favourites(best_of_each(trials), 2 * FINALISTS, hypotheses)]
    ended = parallel_map(partial(fitted_to_the_end, tolerance=2.0), (evidence, harmonics), finalists)
    return sorted(ended, key=lambda c: -c.log_evidence)[:FINALISTS]


def _beginning(
    evidence: MeasuredData, start: BaselineParameters, rival: tuple[CauseHypothesis, ...]
) -> BaselineParameters:
    """Where to fit a rival from: one without a strength is all or nothing, and what was fitted without it astray."""
    if main_strength(rival[-1].cause.parameters(evidence, rival[-1].label)) is not None:
        return start
    return starting_baseline(evidence, modification=modification_of(evidence, rival))


def at_the_best_place(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, trials: list[FittedModel], scores: list[Score]
) -> list[FittedModel]:
    """The best models, after every other cause has been tried where the best one is.

    One that came to rest in a false minimum along the structure is not beaten fairly: a resonator tuned far above the
    band is a mass.
    """
    if not trials or "position_m" not in trials[0].hypotheses[-1].values:
        return trials
    *before, best = trials[0].hypotheses
    place = best.values["position_m"]
    nearest: dict[str, Score] = {}
    for score in scores:
        values, key = score.hypothesis.values, score.hypothesis.key
        if "position_m" in values and key != best.key and score.gain > LEAST_SCORE:
            rival = nearest.setdefault(key, score)
            if abs(values["position_m"] - place) < abs(rival.hypothesis.values["position_m"] - place):
                nearest[key] = score
    moved = [
        replace(score.hypothesis, values={**score.hypothesis.values, "position_m": place}) for score in nearest.values()
    ]
    field = [(trials[0].baseline, (*before, hypothesis)) for hypothesis in moved]
    fit = partial(_less_discrepancy, discrepancy=STIFF, tolerance=2.0)
    there = sorted([*trials, *parallel_map(fit, (evidence, harmonics), field)], key=lambda c: -c.log_evidence)
    chosen = {trial.hypotheses[-1].key for trial in trials}
    return [c for rank, c in enumerate(best_of_each(there)) if rank < FINALISTS or c.hypotheses[-1].key in chosen]


def with_own_law(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    rival: tuple[CauseHypothesis, ...],
    discrepancy: DiscrepancyLevel,
) -> BaselineParameters:
    """Parameters to begin from: with the law that the steps ask for beside this rival, where that fits better.

    Sharp resonances make a law that was found beside another model a trap.
    """
    if not len(evidence.steps):
        return start
    modification = modification_of(evidence, rival)
    residual_model = ResidualModel(evidence, modification, harmonics, discrepancy=discrepancy)
    anew = law_from_steps(residual_model, start.base)
    now, then = (residual_model.evaluate(u, sensitivities=False).chi2 for u in (start, anew))
    return anew if then < now else start


def fitted_to_the_end(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    rival: tuple[CauseHypothesis, ...],
    *,
    tolerance: float = 0.3,
) -> FittedModel:
    """A rival fitted again and again from the law that the steps ask for beside it, while that helps.

    Where moduli, cause and law make up for each other a single fit creeps, and stops where its creeping seems an end.
    """
    best = fit_model(evidence, harmonics, start, rival, tolerance=tolerance)
    for _ in range(FITTED_ANEW):
        begin = with_own_law(evidence, harmonics, best.baseline, best.hypotheses, TIGHT)
        anew = fit_model(evidence, harmonics, begin, best.hypotheses, tolerance=tolerance)
        creeping = anew.log_evidence > best.log_evidence + LEAST_GAIN
        best = max(best, anew, key=lambda fitted_model: fitted_model.log_evidence)
        if not creeping:
            break
    return best


def _less_discrepancy(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    rival: tuple[CauseHypothesis, ...],
    *,
    discrepancy: DiscrepancyLevel,
    tolerance: float,
    held: str = "",
) -> FittedModel:
    """A rival fitted roughly with this discrepancy, from its own law."""
    begin = with_own_law(evidence, harmonics, start, rival, discrepancy)
    # With all discrepancy the resonances, and with them the layer's motion, may still be far from what was measured.
    iterations = 15 if discrepancy == DISCREPANCY_LEVELS[-1] else 6
    return fit_model(
        evidence,
        harmonics,
        begin,
        rival,
        discrepancy=discrepancy,
        iterations=iterations,
        tolerance=tolerance,
        held=held,
    )


def _through_discrepancy(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    rival: tuple[CauseHypothesis, ...],
) -> tuple[BaselineParameters, tuple[CauseHypothesis, ...]]:
    """Where a cause that acts by its amplitude comes to rest as discrepancy is taken away; another stays as it is.

    Its thresholds have false minima even beside a base family that follows the data.  So has any cause that begins so
    strong that the resonances are elsewhere: where only one of them was measured, moduli may make up for all of it.
    """
    if rival[-1].cause.tried_at_full_size:
        # What a base family made of such an effect leads nowhere: it begins from what is assumed, with all discrepancy.
        residual_model = ResidualModel(evidence, modification_of(evidence, rival), harmonics)
        start = law_from_steps(residual_model, nominal_parameters(evidence.rig, evidence.preload))
        for discrepancy in (LOOSE, DISCREPANCY_LEVELS[SIFTED]):
            trial = fit_model(evidence, harmonics, start, rival, discrepancy=discrepancy, iterations=10, tolerance=4.0)
            start, rival = trial.baseline, trial.hypotheses
        return start, rival
    if rival[-1].nonlinear(evidence):
        loosest = SIFTED
    elif _astray(evidence, harmonics, start, rival):
        start, loosest = _on_the_resonances(evidence, start, rival), len(DISCREPANCY_LEVELS) - 1
    else:
        return start, rival
    for level in range(loosest, 0, -1):
        trial = _less_discrepancy(
            evidence, harmonics, start, rival, discrepancy=DISCREPANCY_LEVELS[level], tolerance=4.0
        )
        start, rival = trial.baseline, trial.hypotheses
    return start, rival


def _astray(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    rival: tuple[CauseHypothesis, ...],
) -> bool:
    begin = with_own_law(evidence, harmonics, start, rival, TIGHT)
    residual_model = ResidualModel(evidence, modification_of(evidence, rival), harmonics, discrepancy=TIGHT)
    found = residual_model.evaluate(begin, sensitivities=False)
    return found.chi2 > ASTRAY * len(found.residual)


def _on_the_resonances(
    evidence: MeasuredData, start: BaselineParameters, rival: tuple[CauseHypothesis, ...]
) -> BaselineParameters:
    """The start with its natural frequencies moved to where the sweeps fit best, by trial: no slope leads there."""
    residual_model = ResidualModel(evidence, modification_of(evidence, rival), discrepancy=LOOSE)
    held = residual_model.linearisation(start)
    if held is None:
        return start
    residual_model = ResidualModel(evidence, modification_of(evidence, rival), discrepancy=LOOSE, held=held)
    natural = residual_model.model.basis.omega[: len(start.base.frequency_discrepancy)]
    for rows in by_resonance(evidence.steps.omega):
        mode = int(np.argmin(np.abs(np.log(natural / np.median(evidence.steps.omega[rows])))))
        trials = []
        for frequency_discrepancy in TRIED_DETUNINGS:
            moved = start.base.frequency_discrepancy.copy()
            moved[mode] = frequency_discrepancy
            trial = replace(start, base=replace(start.base, frequency_discrepancy=moved))
            trials.append((residual_model.evaluate(trial, sensitivities=False).chi2, trial))
        start = min(trials, key=lambda trial: trial[0])[1]
    return start


def _with_favourites(
    trials: list[FittedModel], count: int, hypotheses: list[tuple[CauseHypothesis, ...]]
) -> list[FittedModel]:
    """The first `count` trials, and those of the causes that were scored best.

    Near sharp resonances a rough fit of the right one may be the worst of all.
    """
    favourites = list(dict.fromkeys(rival[-1].key for rival in hypotheses))[:FAVOURITES]
    return [c for rank, c in enumerate(trials) if rank < count or c.hypotheses[-1].key in favourites]


def best_of_each(trials: list[FittedModel], count: int = 1) -> list[FittedModel]:
    """The first `count` fits of each cause and label."""
    seen: Counter[str] = Counter()
    kept = []
    for trial in trials:
        seen[trial.hypotheses[-1].key] += 1
        if seen[trial.hypotheses[-1].key] <= count:
            kept.append(trial)
    return kept
