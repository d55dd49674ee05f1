"""Gauss-Newton with Levenberg damping and a Gaussian prior: bounded, and every accepted step lowers the cost."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, Protocol, Self

import numpy as np

from twin.arrays import Array
from twin.identify.cholesky import Cholesky
from twin.identify.limits import LIMITS
from twin.identify.time_limit import time_is_up

Ending = Literal["settled", "stuck", "out of iterations", "out of time", "not finite"]


@dataclass(frozen=True)
class Solution:
    """A minimum of chi2 + prior."""

    x: Array
    """Parameters."""
    chi2: float
    """Sum of squared residuals at `x`."""
    penalty: float
    """The prior's part of the cost."""
    information: Array
    """J'J + prior precision: the inverse of the parameters' covariance."""
    residual: Array
    jacobian: Array
    history: tuple[float, ...]
    """Cost after each iteration."""
    ended: Ending = "settled"
    """``settled`` where nothing is left to gain; else why it stopped: ``stuck`` where a step promises more than any
    that was tried gains, ``out of iterations`` or ``out of time``, or ``not finite`` where the residual is not at the
    start."""

    @property
    def settled(self) -> bool:
        """Whether it is a minimum, as far as was asked."""
        return self.ended == "settled"

    @property
    def cost(self) -> float:
        """Chi2 plus penalty."""
        return self.chi2 + self.penalty

    def gained_little(self, tolerance: float) -> bool:
        """Whether all iterations together gained less than this, in units of the cost per degree of freedom."""
        return self.history[0] - self.history[-1] < tolerance * max(1.0, self.cost / max(1, len(self.residual)))

    @property
    def covariance(self) -> Array:
        """Of the parameters, to first order."""
        return Cholesky.of(self.information).inverse

    @property
    def determined(self) -> int:
        """How many parameters the data determine rather than the prior, rounded; none where it could not begin."""
        if self.ended == "not finite":
            return 0
        return round(float(np.trace(Cholesky.of(self.information).solve(self.jacobian.T @ self.jacobian))))


@dataclass(frozen=True, kw_only=True)
class StepRule:
    """Where the steps of a search may lead, and along what."""

    bounds: tuple[Array, Array] | None = None
    """Lower and upper limits; the start and all steps are cut to stay inside."""
    largest: Array | None = None
    """Largest change of each parameter in one iteration."""
    moved: Callable[[Array, Array], Array] = np.add
    """Parameters after a step, to first order their sum: along a curve that bends as the residual does."""
    residual_alone: Callable[[Array], Array] | None = None
    """Returns the residual only.  With it steps follow the residual's curvature (geodesic acceleration: Transtrum and
    Sethna 2012): where parameters make up for each other the valley bends, and straight steps must be tiny.  Once a
    step has failed, derivatives are computed only where the residual alone says that the cost is lower."""


def not_held_back(x: Array, pull: Array, lower: Array, upper: Array) -> Array:
    """Which parameters are free to follow `pull`, the direction of descent: all but those at a limit it points past."""
    return np.asarray(~(((x <= lower) & (pull < 0)) | ((x >= upper) & (pull > 0))))


@np.errstate(all="ignore")  # a step may lead anywhere, and what is not finite is a failed one
def minimise(
    evaluate: Callable[[Array], tuple[Array, Array]],
    start: Array,
    *,
    mean: Array,
    precision: Array,
    iterations: int = 30,
    tolerance: float = 0.03,
    steps: StepRule = StepRule(),
) -> Solution:
    """Minimise |r(x)|^2 + (x - mean)' precision (x - mean).

    Parameters
    ----------
    evaluate
        Returns the residual (measured minus predicted) and d(predicted)/dx.  A residual with entries that are not
        finite counts as a failed step; at the start it ends the search there, which the solution tells.
    precision : ndarray, (n, n)
        Inverse covariance of the prior; positive on the whole diagonal, which also scales the damping.
    tolerance
        Stops where an undamped step promises less than this, in units of the cost per degree of freedom, or where an
        iteration gains less though it promised more.
    """
    moved, residual_alone = steps.moved, steps.residual_alone
    lower, upper = steps.bounds or (np.full(len(start), -np.inf), np.full(len(start), np.inf))
    # Limits may have moved since the start was found, as a law's do with E'; a step is tried inside them alone.
    x = np.clip(np.asarray(start, float), lower, upper)
    residual, J = evaluate(x)
    chi2, penalty = float(residual @ residual), float((x - mean) @ precision @ (x - mean))
    history = [chi2 + penalty]
    if not (np.isfinite(residual).all() and np.isfinite(J).all()):
        return Solution(x, chi2, penalty, J.T @ J + precision, residual, J, tuple(history), "not finite")
    damping, bends, gained_little = 1e-3, False, False
    ended: Ending = "out of iterations"
    for _ in range(iterations):
        if time_is_up():
            ended = "out of time"
            break
        A = J.T @ J + precision
        gradient = J.T @ residual - precision @ (x - mean)
        # A parameter that its limit holds back takes no part: the others' steps would else count on its moving.
        free = not_held_back(x, gradient, lower, upper)
        small = tolerance * max(1.0, (chi2 + penalty) / max(1, len(residual)))
        room = lower - x, upper - x
        newton = _step_inside(A, gradient, room, steps.largest)
        promised = float(newton @ (2 * gradient - A @ newton))
        here: Ending = "settled" if promised < small else "stuck"
        if promised < LIMITS.gauss_newton_left * small or gained_little:
            ended = here
            break
        accepted = at_once = False
        for trial_number in range(LIMITS.gauss_newton_trials):
            scaled = A + damping * np.diag(np.diag(A))
            step = _step_inside(scaled, gradient, room, steps.largest)
            if not np.isfinite(step).all():
                damping *= 8.0
                continue
            step *= _shorter(step, steps.largest)
            trial = np.clip(moved(x, step), lower, upper)
            probe = residual_alone if bends else None
            if probe is not None:
                ahead = probe(np.clip(moved(x, LIMITS.gauss_newton_probed * step), lower, upper))
                turn = _turn(step, free, scaled, J, (ahead - residual) / LIMITS.gauss_newton_probed + J @ step)
                trial = np.clip(moved(x, step + turn), lower, upper)
            p = float((trial - mean) @ precision @ (trial - mean))
            promising = probe is None or _square(probe(trial)) + p < chi2 + penalty
            if promising:
                r, Jr = evaluate(trial)
                c = _square(r)
                if c + p < chi2 + penalty and np.isfinite(Jr).all():
                    accepted, at_once = True, trial_number == 0
                    break
            damping *= 8.0
            bends = True
        if not accepted:
            ended = here
            break
        # Where damping alone kept the step short, the next one is longer.
        expected = chi2 + penalty - _square(residual - J @ (trial - x)) - p
        gained_little = chi2 + penalty - c - p < small and (expected >= small or not at_once)
        x, residual, J, chi2, penalty = trial, r, Jr, c, p
        damping = max(damping / 8.0, 1e-14)
        history.append(chi2 + penalty)
    return Solution(x, chi2, penalty, J.T @ J + precision, residual, J, tuple(history), ended)


class Round(Protocol):
    """A search that holds what it found where it begins: its weights, and what of the model is costly to follow."""

    @property
    def x(self) -> Array:
        """Where it begins."""

    def begun_at(self, x: Array) -> Self:
        """The next one."""

    def solve(self, *, iterations: int) -> Solution:
        """:func:`minimise` from there."""

    def cost_at(self, there: Self) -> float:
        """The cost where another round begins, with what that holds of the model and this one's weights."""


def minimise_reweighted(begun: Round, *, rounds: int, tolerance: float, iterations: int) -> Solution:
    """Minimise a cost in rounds that each hold what was found where the last one ended (iterative reweighting).

    What is held may lead too far: of each round as much is taken as lowers the cost once it is found anew, whole or
    halved until it does.  Weights have no part in that, for large ones are no worse than small ones.

    Parameters
    ----------
    rounds
        At most.
    tolerance
        A round that gains less ends the search, see :meth:`Solution.gained_little`.
    """
    solution = begun.solve(iterations=iterations)
    for left in reversed(range(rounds)):
        if solution.ended == "not finite" or solution.gained_little(tolerance):
            break
        ahead = _next(begun, solution)
        if ahead is None:
            return replace(begun.solve(iterations=0), ended="stuck")
        begun, solution = ahead, ahead.solve(iterations=iterations if left else 0)
    return solution


def _next(begun: Round, solution: Solution) -> Round | None:
    """The round that begins where one ended, or on the way there."""
    for halved in range(LIMITS.gauss_newton_halved):
        ahead = begun.begun_at(begun.x + (solution.x - begun.x) / 2**halved)
        if begun.cost_at(ahead) < solution.history[0]:
            return ahead
    return None


def _shorter(step: Array, largest: Array | None) -> float:
    """Share of a step that moves no parameter farther than it may."""
    return 1.0 if largest is None else min(1.0, 1.0 / max(float(np.max(np.abs(step) / largest)), 1e-300))


def _square(r: Array) -> float:
    """Sum of squares; NaN, so that it is below no limit, where an entry is not finite."""
    return float(r @ r) if np.isfinite(r).all() else np.nan


def _step_inside(A: Array, b: Array, room: tuple[Array, Array], largest: Array | None) -> Array:
    """The step inside its limits with the least step' A step - 2 b' step.

    The primal-dual active set method (Hintermueller, Ito and Kunisch 2002).  Where parameters hang together, such as a
    smooth curve's values, a step that is merely cut off at its limits may lead uphill.  A step that will be shortened
    anyway may not come to any limit.
    """
    lower, upper = (room[0] >= 0) & (b < 0), (room[1] <= 0) & (b > 0)
    step = np.zeros(len(b))
    for _ in range(LIMITS.gauss_newton_active_sets):
        step, free = np.where(lower, room[0], np.where(upper, room[1], 0.0)), ~(lower | upper)
        step[free] = _solved(A[np.ix_(free, free)], b[free] - A[np.ix_(free, ~free)] @ step[~free])
        if _shorter(step, largest) < 1:
            break
        pull = b - A @ step
        below = (free & (step < room[0])) | (lower & (pull < 0))
        above = (free & (step > room[1])) | (upper & (pull > 0))
        if (below == lower).all() and (above == upper).all():
            break
        lower, upper = below, above
    else:
        return np.clip(step, *room)
    return step


def _solved(A: Array, b: Array) -> Array:
    """Nothing finite where A is not positive definite: such a step fails, and more damping mends it."""
    try:
        return Cholesky.of(A).solve(b)
    except np.linalg.LinAlgError:
        return np.full(len(b), np.nan)


def _turn(step: Array, free: Array, scaled: Array, J: Array, missed: Array) -> Array:
    """What the curvature of the residual adds to a step; nothing where it would add too much to be assumed.

    Parameters
    ----------
    scaled : ndarray, (n, n)
        The damped normal matrix.
    missed : ndarray, (r,)
        Change of the residual beyond the linear one along a part of the step, over that part.
    """
    turn = np.zeros(len(step))
    if not np.isfinite(missed).all():
        return turn
    turn[free] = _solved(scaled[np.ix_(free, free)], (J.T @ missed)[free]) / LIMITS.gauss_newton_probed
    size = np.sqrt(np.diag(scaled))
    return (
        turn
        if 4 * np.linalg.norm(turn * size) < LIMITS.gauss_newton_sharpest * np.linalg.norm(step * size)
        else np.zeros(len(step))
    )
