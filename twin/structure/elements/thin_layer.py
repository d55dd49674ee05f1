"""The thin-layer element between two overlapping beams.

The layer has height h (neutral axis to neutral axis) and width t, and resists opening and sliding only (2011 paper,
equations 1 and 2, with the kinematics of the beams that it joins)::

    x' K x = integral (t/h) [ E' dv^2 + G' (du + (h_top/2) v_top' + (h_bottom/2) v_bottom')^2 ] dx,   d. = top - bottom

with u linear and v cubic along the element, as in the beams.  Each Gauss point contributes one row to the strain
operators B_E and B_G, so that K = E' B_E' B_E + G' B_G' B_G: affine in the moduli and of low rank.
"""

from dataclasses import dataclass

import numpy as np

from twin.arrays import Array
from twin.structure.elements.beam import deflection_shape, gauss
from twin.structure.elements.space_beam import AGAINST, AXIAL, BENT, BENT_ACROSS, TWIST
from twin.structure.limits import LIMITS


@dataclass(frozen=True)
class ThinLayerElement:
    """Strain operators of one element, weighted so that K = E' B_E' B_E + G' B_G' B_G.

    DOFs: (u1, v1, theta1, u2, v2, theta2) of the bottom beam's element, then of the top beam's.
    """

    B_E: Array
    """Rows sqrt(weight t / h) times the opening dv, (4, 12)."""
    B_G: Array
    """Rows sqrt(weight t / h) times the slip, (3, 12)."""
    normal_weight: Array
    shear_weight: Array
    """The factors sqrt(weight t / h) themselves: a row divided by its factor is the opening or slip in metres."""
    normal_at: Array
    shear_at: Array
    """Where along the element each row is taken, 0..1."""
    shear_direction: Array | None = None
    """Which way each row of B_G slips: 0 along the beams, 1 across them; None of plane beams, which slip along only."""


def thin_layer(
    *, length: float, height: float, width: float, bottom_thickness: float, top_thickness: float
) -> ThinLayerElement:
    """Build one element; all lengths in metres."""
    bottom_u, bottom_v = np.array([0, 3]), np.array([1, 2, 4, 5])
    (normal_at, normal), (shear_at, shear) = gauss(LIMITS.normal_points), gauss(LIMITS.shear_points)
    normal_weight, shear_weight = (np.sqrt(weight * length * width / height) for weight in (normal, shear))
    opening, slip = np.zeros((len(normal), 12)), np.zeros((len(shear), 12))
    for row, xi in zip(opening, normal_at, strict=True):
        row[bottom_v], row[6 + bottom_v] = -deflection_shape(xi, length), deflection_shape(xi, length)
    for row, xi in zip(slip, shear_at, strict=True):
        row[bottom_u], row[6 + bottom_u] = [-(1 - xi), -xi], [1 - xi, xi]
        row[bottom_v] = bottom_thickness / 2 * deflection_shape(xi, length, 1)
        row[6 + bottom_v] = top_thickness / 2 * deflection_shape(xi, length, 1)
    opening, slip = normal_weight[:, None] * opening, shear_weight[:, None] * slip
    return ThinLayerElement(opening, slip, normal_weight, shear_weight, normal_at, shear_at)


def space_thin_layer(
    *, length: float, height: float, width: float, bottom_thickness: float, top_thickness: float
) -> ThinLayerElement:
    """The same between beams in space, whose sections are rigid; it opens unevenly across its width as they twist.

    DOFs: (u, v, w, phi, psi, theta) of both nodes of the bottom beam's element, then of the top beam's, as in
    :mod:`twin.structure.elements.space_beam`.  B_E is (8, 24), B_G (16, 24).
    """
    opening, slip, weights, at = [], [], [], []
    for xi, weight in zip(*gauss(LIMITS.normal_points), strict=True):
        for across in (-width / np.sqrt(12), width / np.sqrt(12)):
            top = _surface_motion(xi, length, height=-top_thickness / 2, across=across)
            bottom = _surface_motion(xi, length, height=bottom_thickness / 2, across=across)
            factor = np.sqrt(weight * length * width / height / 2)
            along, apart, sideways = factor * np.hstack([-bottom, top])
            opening.append(apart)
            slip += [along, sideways]
            weights.append(factor)
            at.append(xi)
    each = np.array(weights), np.repeat(weights, 2), np.array(at), np.repeat(at, 2)
    return ThinLayerElement(np.array(opening), np.array(slip), *each, np.tile([0, 1], len(weights)))


def _surface_motion(xi: float, length: float, *, height: float, across: float) -> Array:
    """Rows (3, 12) of the motion along axis, normal and across of a section's point, so far off the axis."""
    rows, linear = np.zeros((3, 12)), np.array([1 - xi, xi])
    rows[0, AXIAL], rows[0, BENT] = linear, -height * deflection_shape(xi, length, 1)
    rows[0, BENT_ACROSS] = -across * deflection_shape(xi, length, 1) * AGAINST
    rows[1, BENT], rows[1, TWIST] = deflection_shape(xi, length), -across * linear
    rows[2, BENT_ACROSS], rows[2, TWIST] = deflection_shape(xi, length) * AGAINST, height * linear
    return rows
