"""What natural frequencies can and cannot determine: weak directions and profile likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studies.eigensensitivity import FrequencySet, FrequencyUpdate, Parameter, update_parameters

__all__ = ["Direction", "Profile", "profile_likelihood", "weak_directions"]

CHI2_95 = 3.841
"""95 % point of chi-square with one degree of freedom."""


@dataclass(frozen=True)
class Direction:
    """A combination of log-parameters and the relative standard deviation that the frequencies leave it."""

    singular_value: float
    combination: dict[str, float]

    @property
    def relative_std(self) -> float:
        """1 / singular value: 0.1 is known to ten per cent, above 1 is open."""
        return 1 / self.singular_value if self.singular_value > 0 else float("inf")


@dataclass(frozen=True)
class Profile:
    """Least misfit over all other parameters, as a function of one.

    Attributes
    ----------
    value, chi2 : ndarray, (p,)
        The parameter, and the objective above its least value there.
    lower, upper : float
        95 % interval; 0 or infinity where the objective never rises to the limit within the range that was looked at.
    """

    name: str
    value: NDArray[np.float64]
    chi2: NDArray[np.float64]
    lower: float
    upper: float

    @property
    def determined(self) -> bool:
        """Whether the data bound the parameter on both sides."""
        return self.lower > 0 and np.isfinite(self.upper)


def weak_directions(update: FrequencyUpdate) -> list[Direction]:
    """All directions of an update, the best determined first, each with its larger components only."""
    directions = []
    for value, column in zip(update.singular_values, update.directions.T, strict=True):
        column = column * np.sign(column[np.argmax(np.abs(column))])
        parts = {n: float(c) for n, c in zip(update.names, column, strict=True) if abs(c) > 0.15}
        directions.append(Direction(float(value), parts))
    return directions


def profile_likelihood(
    sets: Sequence[FrequencySet],
    parameters: Sequence[Parameter],
    update: FrequencyUpdate,
    name: str,
    *,
    span: float | None = None,
    points: int = 9,
) -> Profile:
    """Hold one parameter at values around its estimate and refit all others.

    Parameters
    ----------
    sets, parameters, update
        Of the update whose parameter `name` is profiled.
    span
        The parameter is held between estimate / span and estimate x span; None takes four standard deviations, at most
        a factor of 20.
    points
        Odd number of values, spaced evenly in the logarithm; each fit starts from its neighbour's result.
    """
    half = points // 2
    estimate = update.values[name]
    if span is None:
        span = float(np.exp(np.clip(4 * update.std[name] / estimate, 1e-6, np.log(20.0))))
    factors = np.exp(np.linspace(-np.log(span), np.log(span), 2 * half + 1))
    objective = np.full(2 * half + 1, update.objective)
    for side in (range(half - 1, -1, -1), range(half + 1, 2 * half + 1)):
        warm = dict(update.values)
        for i in side:
            held = estimate * factors[i]
            warm[name] = held
            objective[i], warm = _held_objective(sets, parameters, name, warm)
    rise = objective - objective.min()
    lower, upper = 0.0, np.inf
    for i in range(half, 0, -1):
        if rise[i - 1] > CHI2_95 >= rise[i]:
            lower = (
                estimate
                * factors[i] ** _part(rise[i], rise[i - 1])
                * factors[i - 1] ** (1 - _part(rise[i], rise[i - 1]))
            )
            break
    for i in range(half, 2 * half):
        if rise[i + 1] > CHI2_95 >= rise[i]:
            part = _part(rise[i], rise[i + 1])
            upper = estimate * factors[i] ** part * factors[i + 1] ** (1 - part)
            break
    return Profile(name, estimate * factors, rise, float(lower), float(upper))


def _part(inside: float, outside: float) -> float:
    """Weight of the inner point where the root of the misfit, nearly linear, crosses the limit."""
    a, b, limit = np.sqrt([max(inside, 0.0), outside, CHI2_95])
    return float((b - limit) / (b - a))


def _held_objective(
    sets: Sequence[FrequencySet], parameters: Sequence[Parameter], name: str, warm: dict[str, float]
) -> tuple[float, dict[str, float]]:
    """Least objective with `name` held at its value in `warm`, its own prior included, and where it lies."""
    held = warm[name]

    def hold(item: FrequencySet) -> FrequencySet:
        return replace(item, pencil=lambda values: item.pencil({**values, name: held}))

    # Priors are centred on a parameter's start, which therefore must not move for those that have one.
    free = [
        p if np.isfinite(p.prior_log_std) else replace(p, start=float(np.clip(warm[p.name], p.lower, p.upper)))
        for p in parameters
        if p.name != name
    ]
    own = next(p for p in parameters if p.name == name)
    prior = float((np.log(held / own.start) / own.prior_log_std) ** 2)
    update = update_parameters([hold(item) for item in sets], free, max_iterations=60)
    return update.objective + prior, {**update.values, name: held}
