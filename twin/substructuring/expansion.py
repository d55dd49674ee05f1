"""Responses measured at a few points of a part, expanded on its model: rotations and places that nobody measured.

System equivalent model mixing (Klaassen, van der Seijs and de Klerk, Mechanical Systems and Signal Processing 105,
2018), with the model itself removed at the measured points::

    Y = Y_model + T (Y_measured - Y_model,bb) T',      T = Y_model,gb Y_model,bb^-1

At the measured points b the result is what was measured; elsewhere the model says how the part moves between them, and
lends what the points cannot show of the flexibility there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.arrays import Array


@dataclass(frozen=True, eq=False)
class Expansion:
    """How receptances of points become those of ports, Y = rest + T Y_points T'."""

    rest: Array
    """What of the ports' receptance is the model's alone, complex (f, g, g)."""
    transform: Array
    """Motion of the ports for a unit motion of each point, T, complex (f, g, p)."""

    @staticmethod
    def by_model(Y: Array, points: Array) -> Expansion:
        """By a model's receptances (f, g, g) of all ports, of which `points` (p,) are measured."""
        own = Y[:, points[:, None], points]
        transform = np.swapaxes(np.linalg.solve(own, Y[:, points]), 1, 2)
        return Expansion(Y - transform @ Y[:, points], transform)

    @staticmethod
    def of_points(lines: int, points: int) -> Expansion:
        """Ports that are the measured points themselves."""
        shape = (lines, points, points)
        return Expansion(np.zeros(shape, complex), np.broadcast_to(np.eye(points, dtype=complex), shape))

    def receptance(self, measured: Array) -> Array:
        """Of the ports (f, g, g), from that of the points (f, p, p)."""
        return np.asarray(self.rest + self.transform @ measured @ np.swapaxes(self.transform, 1, 2))
