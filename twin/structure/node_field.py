"""The nodes of a part given by matrices as a field to search: along the directions in which the part extends.

A cause's place is searched continuously.  Between nodes the displacement is interpolated linearly over the triangles
(or tetrahedra) of a Delaunay mesh of the nodes, so that a fit has slopes to follow; what is reported is a node.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import Delaunay

from twin.arrays import Array
from twin.structure.limits import LIMITS


@dataclass(frozen=True, eq=False)
class NodeField:
    """Nodes by their coordinates along a part's principal directions."""

    nodes: Array
    """Their numbers, (n,); of those that lie one above the other in a thin part the outermost."""
    coordinates: Array
    """Along the d directions in which the part extends, from the least node on, m, (n, d)."""
    across: tuple[tuple[float, float, float], ...]
    """Unit vectors in which something that pushes may push, (3,): across a thin part, else along the axes."""

    @staticmethod
    def of(nodes: Array, points_m: Array, *, moving: tuple[bool, bool, bool] = (True, True, True)) -> NodeField:
        """The field of nodes at points (n, 3) that have displacements along x, y and z as far as `moving` says."""
        centred = points_m - points_m.mean(axis=0)
        axes = np.linalg.svd(centred, full_matrices=False)[2]
        # In a fixed sense, whichever one the decomposition takes.
        axes = axes * np.where(axes[np.arange(len(axes)), np.argmax(np.abs(axes), axis=1)] < 0, -1.0, 1.0)[:, None]
        along = centred @ axes.T
        extent = np.ptp(along, axis=0)
        wide = extent > LIMITS.node_field_thin * extent.max()
        field = along[:, wide] - along[:, wide].min(axis=0)
        kept = np.arange(len(nodes))
        if not wide.all():
            height = along[:, ~wide].sum(axis=1)
            cell = np.round(field / (LIMITS.node_field_apart * extent.max())).astype(np.int64)
            order = np.lexsort((-height, *cell.T))
            first = np.any(np.diff(cell[order], axis=0, prepend=cell[order][:1] - 1) != 0, axis=1)
            kept = np.sort(order[first])
        thin = np.flatnonzero(~wide)
        directions = axes[thin] if len(thin) == 1 else np.eye(3)[list(moving)]
        if np.linalg.norm(directions[0] * moving) < 1 - LIMITS.node_field_across:
            directions = np.eye(3)[list(moving)]
        across = tuple((float(x), float(y), float(z)) for x, y, z in directions)
        return NodeField(nodes[kept], field[kept], across)

    @property
    def extent(self) -> Array:
        """Along each direction, m."""
        return np.asarray(self.coordinates.max(axis=0))

    @cached_property
    def _mesh(self) -> Delaunay | None:
        return Delaunay(self.coordinates) if self.coordinates.shape[1] > 1 else None

    def nearest(self, position_m: Array) -> int:
        """Number of the node nearest to a position (d,)."""
        return int(self.nodes[np.argmin(np.linalg.norm(self.coordinates - position_m, axis=1))])

    def position(self, node: int) -> Array:
        """Coordinates (d,) of a node; ValueError if the field has no such node."""
        found = np.flatnonzero(self.nodes == node)
        if not len(found):
            raise ValueError(f"there is no node {node}")
        return np.asarray(self.coordinates[found[0]])

    def weights(self, position_m: Array) -> tuple[tuple[int, float], ...]:
        """Nodes around a position (d,) with their shares in the displacement there; beyond all nodes the nearest."""
        if self._mesh is None:
            order = np.argsort(self.coordinates[:, 0])
            x, at = self.coordinates[order, 0], float(position_m[0])
            k = int(np.clip(np.searchsorted(x, at), 1, len(x) - 1))
            share = float(np.clip((at - x[k - 1]) / (x[k] - x[k - 1]), 0.0, 1.0))
            return ((int(self.nodes[order[k - 1]]), 1.0 - share), (int(self.nodes[order[k]]), share))
        simplex = int(self._mesh.find_simplex(np.asarray(position_m)))
        if simplex < 0:
            return ((self.nearest(position_m), 1.0),)
        transform = self._mesh.transform[simplex]
        share = transform[:-1] @ (np.asarray(position_m) - transform[-1])
        shares = np.append(share, 1.0 - share.sum())
        return tuple(
            (int(self.nodes[corner]), float(value))
            for corner, value in zip(self._mesh.simplices[simplex], shares, strict=True)
        )

    def within(self, position_m: Array, std_m: Array, quantile: float) -> tuple[int, ...]:
        """Numbers of the nodes inside the ellipsoid of this quantile of chi2 about a position; at least the nearest."""
        distance = np.sum(
            ((self.coordinates - position_m) / np.maximum(std_m, LIMITS.node_field_apart * self.extent.max())) ** 2,
            axis=1,
        )
        inside = {int(node) for node in self.nodes[distance <= quantile]} | {self.nearest(position_m)}
        return tuple(sorted(inside))
