"""The thin-layer element between two overlapping beams.

The layer has height h (neutral axis to neutral axis) and width t, and resists opening and sliding only (2011 paper,
equations 1 and 2, with the kinematics of the beams that it joins)::

    x' K x = integral (t/h) [ E' dv^2 + G' (du + (h_top/2) v_top' + (h_bottom/2) v_bottom')^2 ] dx,   d. = top - bottom

with u linear and v cubic along the element, as in the beams.  Each Gauss point contributes one row to the strain
operators B_E and B_G, so that K = E' B_E' B_E + G' B_G' B_G: affine in the moduli and of low rank.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from twin.arrays import Array
from twin.structure.elements.beam import deflection_shape, gauss
from twin.structure.elements.space_beam import AGAINST, AXIAL, BENT, BENT_ACROSS, TWIST
from twin.structure.limits import LIMITS


@dataclass(frozen=True, eq=False)
class LayerRows:
    """Openings of a layer at its Gauss points, or slips, as strain operators: a modulus E makes K = E B' B."""

    B: Array
    """Rows sqrt(weight t / h) times the motion, (r, n)."""
    weight: Array
    """The factors sqrt(weight t / h) themselves: a row divided by its factor is the motion in metres, (r,)."""
    at: Array
    """Where along an element, 0..1, or along a joint, m, each row is taken, (r,)."""
    direction: Array
    """Which way it moves, (r,): 0, or 1 for a slip across the beams."""

    @staticmethod
    def joined(pieces: Iterable[LayerRows]) -> LayerRows:
        """Those of pieces, one after the other."""
        return LayerRows(
            *(np.concatenate(each) for each in zip(*(vars(piece).values() for piece in pieces), strict=True))
        )

    @property
    def metres(self) -> Array:
        """Rows with the motions themselves, (r, n)."""
        return self.B / self.weight[:, None]

    def chosen(self, which: Array | slice) -> LayerRows:
        """Some of the rows."""
        return LayerRows(self.B[which], self.weight[which], self.at[which], self.direction[which])

    def scaled(self, factor: Array) -> LayerRows:
        """The same where the layer's modulus is `factor` squared of what it is, (r,)."""
        return replace(self, B=factor[:, None] * self.B, weight=factor * self.weight)


class ThinLayerElement(NamedTuple):
    """Rows of one element.

    DOFs: (u1, v1, theta1, u2, v2, theta2) of the bottom beam's element, then of the top beam's.
    """

    normal: LayerRows
    """Of the opening dv, (4, 12)."""
    shear: LayerRows
    """Of the slip, (3, 12)."""


def thin_layer(
    *, length: float, height: float, width: float, bottom_thickness: float, top_thickness: float
) -> ThinLayerElement:
    """Build one element; all lengths in metres."""
    bottom_u, bottom_v = np.array([0, 3]), np.array([1, 2, 4, 5])
    (normal_at, normal), (shear_at, shear) = gauss(LIMITS.normal_points), gauss(LIMITS.shear_points)
    normal_weight, shear_weight = (np.sqrt(weight * length * width / height) for weight in (normal, shear))
    opening, slip = np.zeros((len(normal), 12)), np.zeros((len(shear), 12))
    for row, xi in zip(opening, normal_at, strict=True):
        row[6 + bottom_v] = deflection_shape(xi, length)
        row[bottom_v] = -row[6 + bottom_v]
    for row, xi in zip(slip, shear_at, strict=True):
        row[bottom_u], row[6 + bottom_u] = [-(1 - xi), -xi], [1 - xi, xi]
        slope = deflection_shape(xi, length, 1)
        row[bottom_v], row[6 + bottom_v] = bottom_thickness / 2 * slope, top_thickness / 2 * slope
    return ThinLayerElement(*(
        LayerRows(weight[:, None] * rows, weight, at, np.zeros(len(at), np.int64))
        for rows, weight, at in ((opening, normal_weight, normal_at), (slip, shear_weight, shear_at))
    ))  # fmt: skip


def space_thin_layer(
    *, length: float, height: float, width: float, bottom_thickness: float, top_thickness: float
) -> ThinLayerElement:
    """The same between beams in space, whose sections are rigid; it opens unevenly across its width as they twist.

    DOFs: (u, v, w, phi, psi, theta) of both nodes of the bottom beam's element, then of the top beam's, as in
    :mod:`twin.structure.elements.space_beam`.  There are 8 openings and 16 slips.
    """
    opening, slip, weights, at = [], [], [], []
    for xi, weight in zip(*gauss(LIMITS.normal_points), strict=True):
        for across in (-width / np.sqrt(12), width / np.sqrt(12)):
            factor = np.sqrt(weight * length * width / height / 2)
            along, apart, sideways = factor * _relative(xi, length, bottom_thickness, top_thickness, across)
            opening.append(apart)
            slip += [along, sideways]
            weights.append(factor)
            at.append(xi)
    return ThinLayerElement(
        LayerRows(np.array(opening), np.array(weights), np.array(at), np.zeros(len(at), np.int64)),
        LayerRows(np.array(slip), np.repeat(weights, 2), np.repeat(at, 2), np.tile([0, 1], len(at))),
    )


def _relative(xi: float, length: float, bottom: float, top: float, across: float) -> Array:
    """Rows (3, 24) of the top beam's surface against the bottom's, along axis, normal and across both.

    The beams are so thick, and the point of their sections lies so far across the axes.
    """
    rows, linear = np.zeros((2, 3, 12)), np.array([1 - xi, xi])
    bent, slope = deflection_shape(xi, length), deflection_shape(xi, length, 1)
    for own, side, height in zip(rows, (-1.0, 1.0), (bottom / 2, -top / 2), strict=True):
        own[0, AXIAL], own[0, BENT], own[0, BENT_ACROSS] = linear, -height * slope, -across * slope * AGAINST
        own[1, BENT], own[1, TWIST] = bent, -across * linear
        own[2, BENT_ACROSS], own[2, TWIST] = bent * AGAINST, height * linear
        own *= side
    return np.hstack([*rows])
