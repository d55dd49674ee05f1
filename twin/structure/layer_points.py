"""The layer's points: one opening and one slip for each layer element, in metres.

What a joint's law goes by is the motion of the joint itself.  The linear layer is integrated exactly; what its law adds
is integrated at one point for each layer element that the rig file asks for, at the mean of the element's opening and
of its slip.  A modulus E' there holds the energy E' w o^2 / 2, with the weight w = integral of (t/h) dx.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.structure.assembly import Structure

__all__ = ["LayerPoints", "layer_points"]

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class LayerPoints:
    """Operators of a joint's p points over n degrees of freedom.

    Attributes
    ----------
    opening, slip : ndarray, (p, n)
        Rows whose products with the displacements are the opening and the slip, m.
    opening_weight, slip_weight : ndarray, (p,)
        Area over height, m: a modulus times its weight is a stiffness.
    """

    opening: Matrix
    slip: Matrix
    opening_weight: Matrix
    slip_weight: Matrix

    @property
    def rows(self) -> Matrix:
        """Openings, then slips, (2 p, n)."""
        return np.vstack([self.opening, self.slip])

    @property
    def weights(self) -> Matrix:
        """Of :attr:`rows`, (2 p,)."""
        return np.concatenate([self.opening_weight, self.slip_weight])

    def __len__(self) -> int:
        return len(self.opening)


def layer_points(structure: Structure, count: int) -> LayerPoints:
    """Divide the layer of `structure`, however fine its mesh, into `count` equal elements.

    Where the moduli vary along the overlap, so do the weights: a law takes the same share off each of them.
    """
    ends = structure.layer_ends
    opening, opening_weight = _means(structure.B_E, structure.normal_weight, structure.layer_x, ends, count)
    slip, slip_weight = _means(structure.B_G, structure.shear_weight, structure.shear_x, ends, count)
    return LayerPoints(opening, slip, opening_weight, slip_weight)


def _means(B: Matrix, weight: Matrix, x: Matrix, ends: tuple[float, float], count: int) -> tuple[Matrix, Matrix]:
    """Mean rows (count, n) of each element's Gauss points, and sums of their weights (count,)."""
    element = np.clip(((x - ends[0]) / (ends[1] - ends[0]) * count).astype(int), 0, count - 1)
    total = np.asarray(np.bincount(element, weight**2, count), float)
    rows = np.zeros((count, B.shape[1]))
    np.add.at(rows, element, weight[:, None] * B)
    return rows / total[:, None], total
