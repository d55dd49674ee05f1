"""The motion of ports and the stiffness there that goes with it, and what harmonics of the motion add to that."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.limits import LIMITS

LEAST_CHANGE, LARGEST_CHANGE = 1e-16, 7.0
"""Of squares' logarithms: so little is no direction to follow, and no turn goes farther beyond what it found."""


def finite_log(sizes: Array) -> Array:
    """Logarithms of amplitudes or their squares, finite where nothing moves."""
    return np.asarray(np.log(np.maximum(sizes, 1e-300)))


@dataclass(frozen=True)
class Added:
    """What harmonics add at ports: stiffness, to first order in the openings' log amplitudes, and slips' squares."""

    stiffness: Array
    """Complex, N/m, (s, n)."""
    growth: Array
    """The derivative of the openings' stiffness by the logarithms of their amplitudes, (s, p, p)."""
    log_amplitude: Array
    """Where these are so, of m, (s, p)."""
    squares: Array
    """What harmonics add to the running squares of the slips, see
    :func:`~twin.identify.nonlinear.running_amplitude.squares_of`, m2, (s, p, 2)."""

    @staticmethod
    def nothing(shape: tuple[int, ...], points: int) -> Added:
        """At no port of so many steps (s, n)."""
        openings = (*shape[:-1], points)
        growth, squares = np.zeros((*openings, points), complex), np.zeros((*openings, 2))
        return Added(np.zeros(shape, complex), growth, np.zeros(openings), squares)

    def at(self, amplitude: Array) -> Array:
        """The stiffness (s, n) at amplitudes (s, n), m."""
        p, here = self.log_amplitude.shape[-1], self.stiffness.copy()
        here[..., :p] += (self.growth @ (finite_log(amplitude[..., :p]) - self.log_amplitude)[..., None])[..., 0]
        return here

    def of_steps(self, number: int | NDArray[np.intp]) -> Added:
        """One of several steps, each of which may hold many; or some of them."""
        return Added(self.stiffness[number], self.growth[number], self.log_amplitude[number], self.squares[number])

    def of_ports(self, count: int) -> Added:
        """For so many ports, the last of which have none, or are left out."""
        missing = max(0, count - self.stiffness.shape[1])
        return replace(self, stiffness=np.pad(self.stiffness[:, :count], [(0, 0), (0, missing)]))


def accelerated(added: Added, used: Array, before: tuple[Added, Array] | None) -> Added:
    """What a further turn of fundamentals and harmonics begins with: Anderson's acceleration with one turn before.

    Where harmonics meet a resonance, the loss that their own motion sets damps them, and plain turns go to and fro.  Of
    each step the logarithms of the slips' squares are followed to where they would change no more (Walker and Ni 2011,
    with m = 1), and what else harmonics add goes with them.

    Parameters
    ----------
    added, used
        What harmonics add in this turn, and the slips' squares (s, p, 2) that it had begun with.
    before
        The same of the turn before; without it the next one begins with `added`.
    """
    if before is None:
        return added
    (earlier, had), steps = before, len(used)
    log, log_before = finite_log(added.squares), finite_log(earlier.squares)
    change = (log - finite_log(used)).reshape(steps, -1)
    fell = change - (log_before - finite_log(had)).reshape(steps, -1)
    back = -np.sum(fell * change, axis=1) / np.maximum(np.sum(fell**2, axis=1), LEAST_CHANGE)

    def mixed(now: Array, then: Array) -> Array:
        return np.asarray(now + back.reshape(-1, *(1,) * (now.ndim - 1)) * (now - then))

    bounds = log - LARGEST_CHANGE, log + LARGEST_CHANGE
    return Added(
        mixed(added.stiffness, earlier.stiffness), added.growth, mixed(added.log_amplitude, earlier.log_amplitude),
        np.exp(np.clip(mixed(log, log_before), *bounds)),
    )  # fmt: skip


@dataclass(frozen=True)
class Balance:
    """The ports' motion and stiffness where each agrees with the other."""

    motion: Array
    """Complex amplitudes, m, (s, n)."""
    stiffness: Array
    """Complex, N/m, (s, n)."""
    added: Added
    """What harmonics of the motion add."""
    unsettled: Array
    """Norm of the disagreement that was left, over the largest motion, (s,)."""
    ripples: Array | None = None
    """What the nonlinear forces slip into, see :class:`LocalForces`, (s, m, 3)."""

    def of_steps(self, rows: NDArray[np.intp]) -> Balance:
        """At some of the steps."""
        ripples = None if self.ripples is None else self.ripples[rows]
        return Balance(
            self.motion[rows], self.stiffness[rows], self.added.of_steps(rows), self.unsettled[rows], ripples
        )

    def with_steps(self, rows: NDArray[np.intp], other: Balance) -> Balance:
        """The same with others at some of the steps."""
        found = self.of_steps(np.arange(len(self.unsettled)))
        for own, moved in ((found, other), (found.added, other.added)):
            for name, values in vars(moved).items():
                if isinstance(values, np.ndarray):
                    getattr(own, name)[rows] = values
        return found

    @property
    def more(self) -> Array:
        """The part (s, n) of the stiffness that is neither the law's nor the forces', N/m."""
        return self.added.at(np.abs(self.motion))

    @property
    def missed(self) -> Array:
        """Relative error (s,) of what a step shows for its balance was not found: none where it was, at most one."""
        unsettled = np.nan_to_num(self.unsettled, nan=1.0, posinf=1.0)
        return np.where(unsettled > LIMITS.local_settled, np.minimum(unsettled, 1.0), 0.0)
