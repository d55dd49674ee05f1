"""Nodes of two parts that face each other across a joint, with the area that each pair stands for."""

import numpy as np
from scipy.spatial import Delaunay, KDTree, QhullError

from twin.arrays import Array
from twin.rigs.imported.part import ImportedPart
from twin.rigs.imported.units import usual_spacing
from twin.rigs.limits import LIMITS
from twin.rigs.matrix_files import PAIR_LIMIT, NodePairs


def facing_pairs(a: ImportedPart, b: ImportedPart) -> NodePairs | None:
    """Nearest nodes of two parts, each the other's, with the area of a flat patch; None where the parts do not meet.

    ValueError if they meet in a line or a point, which has no area, or in more pairs than a joint may have.
    """
    place_a, place_b = a.matrices.coordinates, b.matrices.coordinates
    if min(len(place_a), len(place_b)) < 2:
        return None
    spacing = min(usual_spacing(place_a), usual_spacing(place_b))
    away, to_b = KDTree(place_b).query(place_a)
    back = KDTree(place_a).query(place_b)[1]
    mutual = np.flatnonzero((away <= LIMITS.facing_gap * spacing) & (back[to_b] == np.arange(len(place_a))))
    if not len(mutual):
        return None
    if len(mutual) > PAIR_LIMIT:
        raise ValueError(f"{len(mutual)} nodes of {a.name} and {b.name} face each other; {PAIR_LIMIT} are allowed")
    ends = place_b[to_b[mutual]]
    points = (place_a[mutual] + ends) / 2
    shares, normal = _areas(points)
    gap = ends - place_a[mutual]
    across = gap.mean(axis=0) if np.linalg.norm(gap, axis=1).mean() > 1e-9 else place_b.mean(0) - place_a.mean(0)
    normal = normal if normal @ across >= 0 else -normal
    used = shares > 0
    return NodePairs(
        a.matrices.nodes[mutual][used], b.matrices.nodes[to_b[mutual]][used], shares[used],
        np.tile(normal, (int(np.count_nonzero(used)), 1)),
    )  # fmt: skip


def _areas(points: Array) -> tuple[Array, Array]:
    """A third of the triangles about each point of a flat patch, (m,), m2, and its unit normal (3,)."""
    centred = points - points.mean(axis=0)
    size, axes = np.linalg.svd(centred, full_matrices=False)[1:]
    if len(points) < 3 or size[1] < 1e-6 * size[0]:
        raise ValueError(f"{len(points)} facing nodes lie on a line: no area to join")
    flat = centred @ axes[:2].T
    try:
        corners = Delaunay(flat).simplices
    except QhullError as error:
        raise ValueError("the facing nodes span no area") from error
    edges = np.linalg.norm(flat[corners] - flat[np.roll(corners, 1, axis=1)], axis=2).max(axis=1)
    kept = corners[edges <= LIMITS.facing_edge * np.median(edges)]
    u, v = flat[kept[:, 1]] - flat[kept[:, 0]], flat[kept[:, 2]] - flat[kept[:, 0]]
    area = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
    shares = np.bincount(kept.ravel(), np.repeat(area / 3, 3), len(points))
    return np.asarray(shares, float), np.asarray(axes[2])
