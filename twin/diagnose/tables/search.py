"""Which cause natural frequencies ask for: each is added in turn, refitted, and weighed by its evidence."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from twin.diagnose.cause import Parameter
from twin.diagnose.tables.fit import Fit, Problem
from twin.diagnose.tables.limits import LIMITS
from twin.diagnose.tables.model import Active, Change
from twin.identify.rms import rms

Array = NDArray[np.float64]
Report = Callable[[str], None]

PLAUSIBLE = {"stiffness-loss": 0.01}
"""Causes less probable beforehand than others: a specimen is rarely damaged, models always leave something out."""


@dataclass(frozen=True)
class Found:
    """A cause on trial beside those accepted before: the best of its labels, and the evidence over all of them.

    Its log evidence holds `prior`, the logarithm of what is assumed of the cause and its labels beforehand.
    """

    cause: str
    fit: Fit
    log_evidence: float
    prior: float


@dataclass(frozen=True)
class FrequencyStage:
    """What was tried beside `before`, the best first, and whether its first was accepted.

    `left_out` are relative errors of each frequency predicted from all others with the first trial; None if its
    evidence was too small to ask.
    """

    before: Fit
    trials: tuple[Found, ...]
    accepted: bool
    left_out: Array | None


@dataclass(frozen=True)
class FrequencySearch:
    """The moduli alone with their left-out errors, and the stages; the last one may not have been accepted."""

    base: Fit
    base_left_out: Array
    stages: tuple[FrequencyStage, ...]

    @property
    def accepted(self) -> tuple[FrequencyStage, ...]:
        """Stages whose first trial is in the model."""
        return tuple(stage for stage in self.stages if stage.accepted)


def search(problem: Problem, *, most: int = 2, report: Report = lambda text: None) -> FrequencySearch:
    """The moduli alone, then causes one by one while the evidence and left-out frequencies pay for them."""
    report("fitting the moduli")
    base = current = moduli_alone(problem)
    base_left_out = left_out = leave_one_out(problem, base)
    stages: list[FrequencyStage] = []
    while len(stages) < most:
        trials = _trials(problem, current, report, all_causes=not stages)
        if not trials:
            break
        best, after = trials[0], None
        if best.log_evidence - current.log_evidence >= least_gain(problem, current):
            report(f"predicting left-out frequencies with {best.cause}")
            after = leave_one_out(problem, best.fit)
        accepted = after is not None and rms(after) < rms(left_out)
        stages.append(FrequencyStage(current, tuple(trials), accepted, after))
        if after is None or not accepted:
            break
        current, left_out = best.fit, after
    return FrequencySearch(base, base_left_out, tuple(stages))


def moduli_alone(problem: Problem) -> Fit:
    """The best fit of the moduli, searched from several values of each.

    Another mode veers through the measured ones as a joint's modulus grows, and every crossing makes a narrow minimum.
    """
    best = problem.fit((), iterations=60, tolerance=LIMITS.search_fine)
    if len(best.moduli) == 1:
        return best
    for name in best.moduli:
        nominal = next(b.nominal for b in problem.model.base if b.name == name)
        fits = [
            problem.fit((), start={**best.moduli, name: nominal * factor}, iterations=25, tolerance=LIMITS.search_fine)
            for factor in LIMITS.search_factors
        ]
        best = _best([best, *fits])
    return best


def least_gain(problem: Problem, current: Fit) -> float:
    """Log evidence that a cause beside `current` must gain."""
    return LIMITS.needed_gain if current.chi2_per_dof > problem.threshold(current.dof) else LIMITS.least_gain


def leave_one_out(problem: Problem, fit: Fit) -> Array:
    """Relative error of each frequency as the same model predicts it from all others."""
    place = next((p for change, _ in fit.active[-1:] for p in change.parameters if p.is_location), None)
    starts = [fit.active]
    if place is not None:
        # Begun at the place that all frequencies give alone, a fit might not leave it, which would not be leaving out.
        change, values = fit.active[-1]
        starts += [(*fit.active[:-1], (change, {**values, place.name: x})) for x in place.starts[1::4]]
    errors, index = [], 0
    for item in problem.measured:
        for number, measured in zip(item.number, item.frequency_Hz, strict=True):
            rest = problem.without(index)
            parts = [rest.fit(start, start=fit.moduli, scale=fit.scale, iterations=10) for start in starts]
            part = max(parts, key=lambda part: part.log_evidence)
            predicted = problem.frequencies(part, {item.condition: np.array([number])})[item.condition][0]
            errors.append(measured / predicted - 1)
            index += 1
    return np.array(errors)


def _trials(problem: Problem, current: Fit, report: Report, *, all_causes: bool) -> list[Found]:
    """Causes beside those of `current`, the best first; only those that a score favours unless `all_causes`."""
    by_cause: dict[str, list[tuple[Fit, float]]] = {}
    for change in problem.model.changes:
        if change.key in current.keys:
            continue
        report(f"trying {change.key}")
        tried = _try(problem, current, change, always=all_causes)
        # A model that leaves nothing free explains everything and says nothing.
        if tried is not None and tried[0].dof >= LIMITS.least_freedom:
            by_cause.setdefault(change.cause, []).append(tried)
    found = []
    for cause, labelled in by_cause.items():
        labelled.sort(key=lambda pair: -pair[1])
        labels = sum(change.cause == cause for change in problem.model.changes)
        values = [value for _, value in labelled]
        prior = float(logsumexp(values)) - values[0] - np.log(labels) + np.log(PLAUSIBLE.get(cause, 1.0))
        found.append(Found(cause, labelled[0][0], values[0] + prior, float(prior)))
    return sorted(found, key=lambda trial: -trial.log_evidence)


def probabilities(stage: FrequencyStage) -> Array:
    """Of the trials: causes together are as probable beforehand as what was accepted before being enough."""
    total = sum(PLAUSIBLE.get(trial.cause, 1.0) for trial in stage.trials)
    values = np.array([trial.log_evidence - np.log(total) for trial in stage.trials] + [stage.before.log_evidence])
    return np.asarray(np.clip(np.exp(values - logsumexp(values))[:-1], 0.0, 0.999))


def rivals_of(stage: FrequencyStage) -> tuple[str, ...]:
    """Other causes whose log evidence comes near the best one's."""
    best = stage.trials[0].log_evidence
    return tuple(trial.cause for trial in stage.trials[1:] if best - trial.log_evidence < LIMITS.rival_log_evidence)


def _try(problem: Problem, current: Fit, change: Change, *, always: bool) -> tuple[Fit, float] | None:
    """The best fit with one more change, and its log evidence; a place is searched along its range."""
    first = {p.name: p.starts[0] if p.starts else p.null for p in change.parameters}
    nothing = {p.name: p.null for p in change.parameters if not p.is_location}
    place = next((p for p in change.parameters if p.is_location), None)
    choices = [first] if place is None else [{**first, place.name: x} for x in place.starts]
    held = frozenset() if place is None else frozenset([place.name])

    def begun(values: dict[str, float]) -> Active:
        return (*current.active, (change, values))

    scores = np.array([problem.score(begun({**values, **nothing}), current.moduli, held) for values in choices])
    if not always and scores.max() <= current.log_evidence:
        return None
    # The moduli of a wrong model may be far off: each fit begins from them, and from what is assumed of them.
    origins: tuple[dict[str, float], ...] = (current.moduli, {})
    if place is None:
        best = _best(
            [problem.fit(begun(first), start=moduli, iterations=40, tolerance=LIMITS.search_fine) for moduli in origins]
        )
        return _checked(best, best.log_evidence)
    # A large effect is far from linear: a few steps at every place tell which are worth following.
    scale = float(np.sqrt(max(current.scale, 1.0)))
    looked = [
        _best([problem.fit(begun(v), start=m, held=held, iterations=4, scale=scale) for m in origins]) for v in choices
    ]
    likely = np.argsort([-fit.log_evidence if np.isfinite(fit.log_evidence) else np.inf for fit in looked])[
        : LIMITS.search_places
    ]
    tried = [problem.fit(looked[k].active, start=looked[k].moduli, held=held, iterations=15) for k in likely]
    evidence = np.array([fit.log_evidence if np.isfinite(fit.log_evidence) else -np.inf for fit in tried])
    best = _best(
        [
            problem.fit(tried[k].active, start=tried[k].moduli, iterations=40, tolerance=LIMITS.search_fine)
            for k in np.argsort(-evidence)[:3]
        ]
    )
    best = _best([best, *_beside(problem, best, place)])
    return _checked(*_along(problem, best, place, [*looked, *tried]))


def _along(problem: Problem, best: Fit, place: Parameter, others: Sequence[Fit]) -> tuple[Fit, float]:
    """The best fit with its place's standard deviation, and its log evidence integrated over the place.

    The place may lie on a curved ridge with the effect's strength, or in several spots: Laplace's form about the best
    one would be off by some units.
    """
    change, values = best.active[-1]
    centre, held = values[place.name], frozenset([place.name])
    points = {other.active[-1][1][place.name]: other.log_evidence for other in others}
    for away in LIMITS.search_along:
        x = float(np.clip(centre + away * best.std[-1][place.name], place.lower, place.upper))
        fit = problem.fit(
            (*best.active[:-1], (change, {**values, place.name: x})), start=best.moduli, held=held, iterations=12
        )
        points[x] = fit.log_evidence
    places = np.array(sorted(points))
    evidence = np.nan_to_num([points[x] for x in places], nan=-np.inf, neginf=-np.inf)
    top = float(evidence.max())
    density = np.exp(evidence - top)
    mass = float(np.trapezoid(density, places))
    spread = float(np.sqrt(np.trapezoid(density * (places - centre) ** 2, places) / mass))
    std = {**best.std[-1], place.name: min(max(best.std[-1][place.name], spread), place.upper - place.lower)}
    return replace(best, std=(*best.std[:-1], std)), top + float(np.log(mass / (place.upper - place.lower)))


def _beside(problem: Problem, fit: Fit, place: Parameter) -> list[Fit]:
    """Fits begun half a spacing to either side: curvature jumps between elements, and may hold a place there."""
    change, values = fit.active[-1]
    half = float(np.abs(np.diff(place.starts)).max()) / 2
    places = [float(np.clip(values[place.name] + side * half, place.lower, place.upper)) for side in (-1, 1)]
    return [
        problem.fit(
            (*fit.active[:-1], (change, {**values, place.name: x})),
            start=fit.moduli,
            iterations=40,
            tolerance=LIMITS.search_fine,
        )
        for x in places
    ]


def _best(fits: Sequence[Fit]) -> Fit:
    """The one with the highest log evidence; the first where none has any."""
    return max(fits, key=lambda fit: fit.log_evidence if np.isfinite(fit.log_evidence) else -np.inf)


def _checked(fit: Fit, evidence: float) -> tuple[Fit, float] | None:
    return (fit, evidence) if np.isfinite(evidence) and np.isfinite(fit.chi2) else None
