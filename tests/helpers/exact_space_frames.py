"""Exact natural frequencies of frames in space: each bar bends in two planes, stretches and twists.

The dynamic stiffness of :mod:`exact_frames` in both planes, and that of a twisted shaft, which is a bar's in length.
Nothing of the package is used here.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from exact_frames import Bar, ExactFrame, clamped_count, dynamic_stiffness

__all__ = ["ExactSpaceFrame", "SpaceBar"]

MOTIONS = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True)
class SpaceBar(Bar):
    """A bar whose thickness is measured along `up`, with its torsional stiffness GJ (N m2)."""

    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    GJ: float = 0.0

    @property
    def on_edge(self) -> Bar:
        """The same as it bends along its width."""
        return replace(self, width=self.thickness, thickness=self.width)

    @property
    def shaft(self) -> Bar:
        """A bar that is as long, and stretches as this one twists."""
        polar = self.density * self.width * self.thickness * (self.width**2 + self.thickness**2) / 12
        return Bar("", "", width=1.0, thickness=1.0, youngs_modulus=self.GJ, density=polar)


@dataclass(frozen=True)
class ExactSpaceFrame(ExactFrame):
    """As :class:`ExactFrame`, with x, y and z of the corners and six motions at each."""

    corners: dict[str, tuple[float, float, float]]
    bars: list[SpaceBar]
    held: set[tuple[str, str]] = field(default_factory=set)

    def count(self, omega: float) -> int:
        """How many natural frequencies lie below."""
        names = list(self.corners)
        D, clamped = np.zeros((6 * len(names), 6 * len(names))), 0
        for bar in self.bars:
            along = np.subtract(self.corners[bar.end], self.corners[bar.begin])
            length = float(np.linalg.norm(along))
            axis = along / length
            up = bar.up - (bar.up @ axis) * axis
            side = np.cross(axis, up / np.linalg.norm(up))
            turn = np.kron(np.eye(4), [axis, up / np.linalg.norm(up), side])
            own = np.zeros((12, 12))
            flat, edge = (dynamic_stiffness(b, length, omega) for b in (bar, bar.on_edge))
            twist = dynamic_stiffness(bar.shaft, length, omega)[np.ix_([0, 3], [0, 3])]
            own[np.ix_([0, 1, 5, 6, 7, 11], [0, 1, 5, 6, 7, 11])] = flat
            mirror = np.diag([1.0, -1.0, 1.0, -1.0])
            own[np.ix_([2, 4, 8, 10], [2, 4, 8, 10])] = mirror @ edge[np.ix_([1, 2, 4, 5], [1, 2, 4, 5])] @ mirror
            own[np.ix_([3, 9], [3, 9])] = twist
            dofs = np.concatenate([6 * names.index(corner) + np.arange(6) for corner in (bar.begin, bar.end)])
            D[np.ix_(dofs, dofs)] += turn.T @ own @ turn
            stretched = int(length * omega * np.sqrt(bar.mass_per_length / bar.EA) / np.pi)
            twisted = int(length * omega * np.sqrt(bar.shaft.density / bar.GJ) / np.pi)
            clamped += sum(clamped_count(b, length, omega) for b in (bar, bar.on_edge)) - stretched + twisted
        motions = [(name, motion) for name in names for motion in MOTIONS]
        free = [number for number, motion in enumerate(motions) if motion not in self.held]
        return clamped + int(np.sum(np.linalg.eigvalsh(D[np.ix_(free, free)]) < 0))
