"""Nodes of two beams that overlap: the lower one clamped at x = 0, the upper one reaching the tip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.rigs import Rig

__all__ = ["LapJointMesh", "mesh_rig"]


@dataclass(frozen=True)
class LapJointMesh:
    """Node positions of both beams, m; their overlap is meshed alike.

    Node numbers run along the lower beam, then along the upper; node n has DOFs 3n (u), 3n+1 (v), 3n+2 (theta).
    """

    lower_x: NDArray[np.float64]
    upper_x: NDArray[np.float64]
    layer_elements: int

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return len(self.lower_x) + len(self.upper_x)

    @property
    def layer_nodes(self) -> list[tuple[int, int]]:
        """Pairs (lower, upper) of facing nodes along the overlap."""
        first = len(self.lower_x) - 1 - self.layer_elements
        return [(first + i, len(self.lower_x) + i) for i in range(self.layer_elements + 1)]


def mesh_rig(rig: Rig, *, beam_elements: int | None = None, layer_elements: int | None = None) -> LapJointMesh:
    """Mesh `rig` as its file says, or with other numbers of elements."""
    layer = layer_elements or rig.joint.layer_elements
    outside = (beam_elements or rig.mesh.beam_elements) - 2 * layer
    lower_free = rig.lower.length - rig.joint.overlap
    upper_free = rig.upper.length - rig.joint.overlap
    n_lower = min(max(1, int(outside * lower_free / (lower_free + upper_free))), outside - 1)
    overlap = np.linspace(lower_free, rig.lower.length, layer + 1)
    lower = np.concatenate([np.linspace(0.0, lower_free, n_lower + 1)[:-1], overlap])
    upper = np.concatenate([overlap, np.linspace(rig.lower.length, rig.length, outside - n_lower + 1)[1:]])
    return LapJointMesh(lower, upper, layer)
