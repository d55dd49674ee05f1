"""Rival models with one more cause: which of them are fitted, where their fits begin, and how they race."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from twin.diagnose.cause import strengths_of
from twin.diagnose.fit_problem import CauseHypothesis, modification_of
from twin.diagnose.fitted_model import FitOptions, FittedModel, fit_model
from twin.diagnose.limits import LIMITS
from twin.diagnose.model_evidence import likeliest
from twin.diagnose.parallel_map import parallel_map
from twin.diagnose.posterior import least_gain, log_weight
from twin.diagnose.selection.profile import threshold_of
from twin.diagnose.selection.racing import Begun, Effort, Race
from twin.diagnose.selection.score_test import Score
from twin.identify.base_fit import baseline_bounds, law_from_steps
from twin.identify.linear.linear_fit import largest_step
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.error_model import continuation
from twin.identify.residuals.likelihood import nominal_base, residual_model, sound_errors
from twin.identify.residuals.natural_frequencies import MeasuredFrequencies
from twin.identify.residuals.whitening import HarmonicResiduals
from twin.identify.time_limit import time_is_up

Report = Callable[[str], None]
"""Told what is being done."""


def fitted_rivals(
    race: Race,
    model: FittedModel,
    before: FittedModel,
    scores: Sequence[Score],
    if_sound: Callable[[], Sequence[Score]],
    report: Report,
) -> tuple[FittedModel, ...]:
    """The models with one more cause, of those that the scores promise, the most probable first.

    They begin at `model`; `before` is the same with the errors that it needs beside what sound rigs have.  Where the
    likeliest is not as exact as sound rigs' models are, those follow that score `if_sound` errors alone are allowed.
    What the law imitates may lead a fit astray: such causes begin beside no law, too, in the same race; all of them
    where the likeliest is still not exact, as does a leading one that explains less than the model it contains, short
    of its maximum.
    """
    evidence, effort = race.evidence, race.effort
    scored, imitated = _promising(evidence, scores, effort), _imitated(scores)
    of_frequencies = isinstance(evidence, MeasuredFrequencies)

    def anew(promising: Sequence[Score]) -> list[CauseHypothesis]:
        # Frequencies alone have several minima: the best without a cause may lead to another.
        if of_frequencies:
            return [score.hypothesis for score in promising]
        # Where the law has taken in what a cause does, the scores no longer tell which of its labels it is.
        names = {score.hypothesis.cause.name for score in promising}
        return [rival for rival in imitated if rival.cause.name in names]

    begun_anew = anew(scored)
    fits = _raced(race, model, scored, begun_anew, report)

    def exact() -> bool:
        return likeliest(fits or [before]).errors.as_small_as(sound_errors(evidence))

    if not exact() and not time_is_up():
        report("scoring causes with a sound rig's errors")
        known = {score.hypothesis.key for score in scored}
        asked = [score for score in _promising(evidence, if_sound(), effort) if score.hypothesis.key not in known]
        others = [rival for rival in anew(asked) if rival not in begun_anew]
        fits += _raced(race, model, asked, others, report)
        scored, begun_anew = scored + asked, begun_anew + others
    last: list[CauseHypothesis] = []
    if fits and not of_frequencies and (leading := likeliest(fits)).log_evidence < before.log_evidence:
        last += [score.hypothesis for score in scored if score.hypothesis.key == leading.hypotheses[-1].key]
    if not exact():
        last += [rival for rival in imitated[: effort.rivals] if rival not in last]
    fits += _raced(race, model, (), [rival for rival in last if rival not in begun_anew], report)
    best: dict[str, FittedModel] = {}
    for fit in sorted(fits, key=lambda fit: -fit.log_evidence):
        best.setdefault(fit.hypotheses[-1].key, fit)
    return tuple(sorted(best.values(), key=lambda fit: -log_weight(evidence, fit)))


def _raced(
    race: Race, model: FittedModel, beside: Sequence[Score], anew: Sequence[CauseHypothesis], report: Report
) -> list[FittedModel]:
    """Fits with one more cause, begun beside the law that was fitted without it, and `anew` beside no law."""
    if not (beside or anew) or time_is_up():
        return []
    begun = [_beside_the_law(race.evidence, model, score) for score in beside]
    report(f"fitting {', '.join(dict.fromkeys(one.key for one in (*(score.hypothesis for score in beside), *anew)))}")
    work = [(_at_full_size(race.evidence, rival),) for rival in anew]
    begun += parallel_map(_beside_no_law, (race.evidence, race.harmonics, model), work) if work else []
    return race.run(begun)


def _promising(evidence: MeasuredData, scores: Sequence[Score], effort: Effort) -> list[Score]:
    """The best scored causes, each at its best places; none where no cause promises to be more probable than none."""
    best = max((score.log_bayes for score in scores), default=0.0)
    least = max(effort.of_needed * least_gain(evidence), effort.worth_a_fit * best if effort.of_needed > 0 else -np.inf)
    found: dict[str, list[Score]] = {}
    for score in scores:
        key = score.hypothesis.key
        alike = sum(each[0].hypothesis.cause is score.hypothesis.cause for each in found.values())
        # A cause with many labels, such as a listed mass, must leave room for others.
        if score.log_bayes > least and (key in found or (len(found) - alike < effort.rivals and alike < effort.labels)):
            found.setdefault(key, []).append(score)
    return [score for each in found.values() for score in _spread(evidence, each, effort.beginnings)]


def _spread(evidence: MeasuredData, each: list[Score], count: int) -> list[Score]:
    """The first, and those farthest from what was chosen before: neighbours would come to the same maximum."""
    first = each[0].hypothesis
    parameters = first.cause.parameters(evidence, first.label)
    places = [p for p in parameters if p.is_location and not (p.is_known or p.is_threshold)]
    all_values = [score.hypothesis.values for score in each]
    at = np.array([[(values[p.name] - p.lower) / (p.upper - p.lower) for p in places] for values in all_values])
    chosen = [0]
    while len(chosen) < min(count, len(each)):
        away = np.min(np.abs(at[:, None] - at[chosen]).sum(axis=2), axis=1)
        if not np.max(away) > 0:
            break
        chosen.append(int(np.argmax(away)))
    return [each[k] for k in chosen]


def _imitated(scores: Sequence[Score]) -> list[CauseHypothesis]:
    """Causes that the law imitates at first, whatever they promise beside it: each label at its best place."""
    best: dict[str, CauseHypothesis] = {}
    for score in scores:
        if score.hypothesis.cause.tried_at_full_size:
            best.setdefault(score.hypothesis.key, score.hypothesis)
    return list(best.values())


def _at_full_size(evidence: MeasuredData, hypothesis: CauseHypothesis) -> CauseHypothesis:
    """The same with the strength and the threshold that such an effect usually has, if it is to be."""
    if not hypothesis.cause.tried_at_full_size:
        return hypothesis
    parameters = hypothesis.cause.parameters(evidence, hypothesis.label)
    values = dict(hypothesis.values) | {p.name: p.starts[0] for p in parameters if p.is_threshold}
    for main in strengths_of(parameters)[:1]:
        full = main.null + np.copysign(main.scale, values[main.name] - main.null)
        values[main.name] = float(np.clip(full, main.lower, main.upper))
    return replace(hypothesis, values=values)


def _beside_the_law(evidence: MeasuredData, model: FittedModel, score: Score) -> Begun:
    """The model with one more cause, from what was fitted without it; all but law and shifts moved by first order.

    Model errors begin at what that model needs, of stiffness or of ratios; a threshold asks for larger ones.
    """
    sound, hypothesis, needed = sound_errors(evidence), score.hypothesis, model.errors.steps
    stiffness = needed.stiffness
    if threshold_of(evidence, hypothesis):
        stiffness = max(stiffness, LIMITS.search_follows)
    levels = [
        level
        for level in continuation(sound)
        if level.steps.stiffness <= stiffness or level.steps.ratio <= needed.ratio
    ]
    baseline, moved = model.baseline, model.baseline.vector
    # No farther than a fit goes in one step: where the model does not follow the data, first order goes anywhere.
    largest = largest_step(baseline.base)
    moved[: len(largest)] += np.clip(score.change[: len(largest)], -largest, largest)
    moved = np.clip(moved, *(baseline_bounds(baseline, side) for side in (0, 1)))
    return Begun(baseline.with_vector(moved), (*model.hypotheses, hypothesis), tuple(levels) or (sound,))


def _beside_no_law(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, model: FittedModel, hypothesis: CauseHypothesis
) -> Begun:
    """The same from nominal moduli and the law that the steps ask for beside the cause, whose size is held at first.

    What base family and law were without the cause may lead nowhere.
    """
    hypotheses = (*model.hypotheses, hypothesis)
    begun = residual_model(evidence, modification_of(evidence, hypotheses), harmonics)
    levels, linear = continuation(sound_errors(evidence)), nominal_base(evidence)
    for level in levels[: LIMITS.held_levels]:
        start = law_from_steps(begun, linear)
        fit = fit_model(
            evidence, harmonics, start, hypotheses, errors=level,
            options=FitOptions(iterations=8, tolerance=2.0, rounds=0, frozen=True),
        )  # fmt: skip
        linear = fit.baseline.base
    return Begun(fit.baseline, hypotheses, levels[LIMITS.held_levels :] or levels[-1:])
