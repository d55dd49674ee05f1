"""Elements of beams in space, put together from plane ones: bending in two planes, stretching and torsion.

Degrees of freedom: (u, v, w, phi, psi, theta) of the first node, then of the second: displacements along axis, normal
and across both, and rotations about them.  Bending along the normal goes with theta = v', across it with psi = -w'.
"""

import numpy as np

from twin.arrays import Array

AXIAL, TWIST = [0, 6], [3, 9]
BENT, BENT_ACROSS = [1, 5, 7, 11], [2, 4, 8, 10]
"""Places of (v1, theta1, v2, theta2) and of (w1, psi1, w2, psi2)."""
AGAINST = np.array([1.0, -1.0, 1.0, -1.0])
"""A rotation psi is minus the slope."""
PLANE = [0, 1, 5, 6, 7, 11]
"""Places of a plane element's degrees of freedom, along axis and normal."""
_BENDING = np.array([1, 2, 4, 5])


def space_element(plane: Array, across: Array, twist: Array) -> Array:
    """A matrix of elements in space, (..., 12, 12).

    Parameters
    ----------
    plane, across : ndarray, (..., 6, 6)
        Of plane elements that bend along the normal, and across it; the stretching is that of the first.
    twist : ndarray, (..., 2, 2)
        Between the rotations about the axis.
    """
    whole = np.zeros((*plane.shape[:-2], 12, 12))
    mirrored = across[..., _BENDING[:, None], _BENDING] * np.outer(AGAINST, AGAINST)
    for dofs, own in ((PLANE, plane), (BENT_ACROSS, mirrored), (TWIST, twist)):
        whole[..., np.array(dofs)[:, None], np.array(dofs)] = own
    return whole
