"""The layer's points: one opening and one slip for each layer element, in metres.

What a joint's law goes by is the motion of the joint itself.  The linear layer is integrated exactly; what its law adds
is integrated at one point for each layer element that the rig file asks for, at the mean of the element's opening and
of its slip.  A modulus E' there holds the energy E' w o^2 / 2, with the weight w = integral of (t/h) dx.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from twin.arrays import Array
from twin.structure.elements.thin_layer import LayerRows
from twin.structure.structure import Structure

KEPT = 32
"""Most layers whose points are kept: every residual asks for those of its structure."""


@dataclass(frozen=True)
class LayerPoints:
    """Operators of p points, of one joint or of several one after the other, over n coordinates."""

    opening: Array
    slip: Array
    """Rows whose products with the displacements are the opening and the slip, m, (p, n)."""
    opening_weight: Array
    slip_weight: Array
    """Area over height, m, (p,): a modulus times its weight is a stiffness."""
    joint: Array
    """Number of the joint that each belongs to, (p,)."""

    @property
    def rows(self) -> Array:
        """Openings, then slips, (2 p, n)."""
        return np.vstack([self.opening, self.slip])

    @property
    def weights(self) -> Array:
        """Of :attr:`rows`, (2 p,)."""
        return np.concatenate([self.opening_weight, self.slip_weight])

    def __len__(self) -> int:
        return len(self.opening)


@lru_cache(maxsize=KEPT)
def layer_points(structure: Structure, count: int, *, joint: int = 0, towards_middle: float = 0.0) -> LayerPoints:
    """Divide a joint's layer, however fine its mesh, into `count` equal elements.

    Where the moduli vary along the layer, so do the weights: a law takes the same share off each of them.  A layer that
    slips in two directions has two points an element, each with one of the slips and half of the opening's weight.

    Parameters
    ----------
    towards_middle
        How far an element's opening is, from its mean (0) towards the one in its middle (1).
    """
    operators = structure.joints[joint]
    opening, opening_weight = _means(operators.normal, operators.ends, count, towards_middle)
    ways = (operators.shear.direction == way for way in np.unique(operators.shear.direction))
    slips = [_means(operators.shear.chosen(way), operators.ends, count) for way in ways]
    # An element without any row has no area, and there is nothing that it could do.
    held = opening_weight > 0
    rows = np.vstack([opening[held]] * len(slips))
    weights = np.concatenate([opening_weight[held] / len(slips)] * len(slips))
    return LayerPoints(
        rows, np.vstack([s[held] for s, _ in slips]), weights, np.concatenate([w[held] for _, w in slips]),
        np.full(len(rows), joint),
    )  # fmt: skip


def points_of_joints(structure: Structure, counts: Sequence[int], towards_middle: Sequence[float]) -> LayerPoints:
    """Those of all joints, each layer in so many elements."""
    each = [
        layer_points(structure, count, joint=joint, towards_middle=towards)
        for joint, (count, towards) in enumerate(zip(counts, towards_middle, strict=True))
    ]
    rows, none = np.zeros((0, structure.size)), np.zeros(0)
    nothing = LayerPoints(rows, rows, none, none, none.astype(np.int64))
    fields = zip(*(vars(points).values() for points in (nothing, *each)), strict=True)
    return LayerPoints(*(np.concatenate(values) for values in fields))


def _means(rows: LayerRows, ends: tuple[float, float], count: int, towards_middle: float = 0.0) -> tuple[Array, Array]:
    """Mean rows (count, n) of each element's Gauss points, and sums of their weights (count,).

    A weight of 1 - 5/2 P2 over an element, in place of 1, makes a parabola's mean its value in the middle.
    """
    along = (rows.at - ends[0]) / (ends[1] - ends[0]) * count
    element = np.clip(along.astype(int), 0, count - 1)
    total = np.asarray(np.bincount(element, rows.weight**2, count), float)
    P2 = 1.5 * (2 * (along - element) - 1) ** 2 - 0.5
    mean = np.zeros((count, rows.B.shape[1]))
    np.add.at(mean, element, (rows.weight * (1 - 2.5 * towards_middle * P2))[:, None] * rows.B)
    return mean / np.where(total > 0, total, 1.0)[:, None], total
