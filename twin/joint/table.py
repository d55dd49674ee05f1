"""A hyperelastic law made from its own describing function, by an Abel inversion.

N(A) = (4 / (pi A^2)) integral_0^A f(e) e / sqrt(A^2 - e^2) de  is an Abel integral, and its inverse is

    f(x) = (x/2) integral_0^{pi/2} [3 sin^3 p N(x sin p) + x sin^4 p N'(x sin p)] dp,

so any measured stiffness curve N becomes the one odd, single-valued force that has it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twin.arrays import Array
from twin.joint.kinds import TABLE
from twin.joint.limits import LIMITS


@dataclass(frozen=True, eq=False)
class ForceTable:
    """A single-valued force given at equal steps from -`limit_m` to `limit_m`; beyond it goes on along its tangents."""

    kind: ClassVar[int] = TABLE
    states: ClassVar[int] = 0
    limit_m: float
    force: Array

    @classmethod
    def of(cls, force: Callable[[Array], Array], *, limit_m: float) -> ForceTable:
        """Tabulate a single-valued force."""
        return cls(limit_m, force(np.linspace(-limit_m, limit_m, LIMITS.table_points)))

    @property
    def parameters(self) -> Array:
        """[n, limit, f(-limit), ..., f(limit)]."""
        return np.concatenate([[len(self.force), self.limit_m], self.force])

    @property
    def tangent(self) -> Array:
        """Slope of each interval."""
        return np.diff(self.force) * (len(self.force) - 1) / (2 * self.limit_m)

    def force_history(self, e: Array) -> Array:
        """Force along a path."""
        inside = np.clip(e, -self.limit_m, self.limit_m)
        slope = np.where(e > 0, self.tangent[-1], self.tangent[0])
        grid = np.linspace(-self.limit_m, self.limit_m, len(self.force))
        return np.interp(inside, grid, self.force) + slope * (e - inside)

    def describing_function(self, amplitude: Array) -> Array:
        """Equivalent stiffness, by quadrature over half a period."""
        A = np.asarray(amplitude, float)
        nodes, weights = np.polynomial.legendre.leggauss(800)
        theta = nodes * np.pi / 2
        force = self.force_history(A[..., None] * np.sin(theta))
        return np.sum(weights * force * np.sin(theta), axis=-1) / A + 0j


def table_from_stiffness(
    stiffness: Callable[[Array], Array], slope: Callable[[Array], Array], *, limit_m: float
) -> ForceTable:
    """The hyperelastic law whose describing function is a given real curve.

    Parameters
    ----------
    stiffness, slope
        N(A) and dN/dA, vectorised, defined from 0 to `limit_m`.
    """
    x = np.linspace(0.0, limit_m, LIMITS.table_points // 2 + 1)
    nodes, weights = np.polynomial.legendre.leggauss(200)
    sine = np.sin((nodes + 1) * np.pi / 4)
    A = x[:, None] * sine
    integrand = 3.0 * sine**3 * stiffness(A) + x[:, None] * sine**4 * slope(A)
    half = x / 2.0 * (integrand @ weights) * np.pi / 4
    return ForceTable(limit_m, np.concatenate([-half[:0:-1], half]))
