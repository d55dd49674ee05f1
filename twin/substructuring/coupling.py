"""Frequency-based substructuring: receptances of substructures coupled by joints.

Forces at the interface are Lagrange multipliers (LM-FBS: de Klerk, Rixen and Voormeeren, General framework for dynamic
substructuring, AIAA Journal 46, 2008), with a joint's dynamic flexibility F beside the substructures' own there::

    Y_coupled = Y - Y B' (B Y B' + F)^-1 B Y

Y is block-diagonal, B the signed matrix of the gaps that the interface closes.  F = 0 is rigid, 1 / (k (1 + i eta)) a
spring with a loss factor, 1 / (i omega c) a damper.  With -Y of a residual structure, such as a fixture, among the
blocks and F = 0 the same decouples it.
"""

from dataclasses import dataclass

import numpy as np

from twin.arrays import Array


@dataclass(frozen=True, eq=False)
class Coupled:
    """What the coupled structure does."""

    receptance: Array
    """Displacement of each port for a unit force at each port, complex (f, p, p)."""
    forces: Array
    """Interface forces for the same, complex (f, c, p): what holds the gaps together."""
    loads: Array
    """All that acts on the ports of the uncoupled substructures for the same, I - B' forces, complex (f, p, p).  As Y
    is symmetric, a change dY of the substructures changes the receptance by loads' dY loads, and a change dF of the
    joints' flexibility by forces' dF forces."""


def couple(Y: Array, B: Array, flexibility: Array) -> Coupled:
    """Couple substructures.

    ValueError if the interface is singular at a frequency: a gap is closed twice, or at a port that does not move.

    Parameters
    ----------
    Y : ndarray of complex, (f, p, p)
        Receptances of all substructures, block-diagonal and symmetric, m/N (per N m and in rad for rotations).
    B : ndarray, (c, p)
        Each row is a gap: the motion of one end less that of the other.
    flexibility : ndarray of complex, (f, c)
        Of the joint in each gap, m/N or rad/(N m).
    """
    gap = B @ Y
    interface = gap @ B.T + flexibility[:, :, None] * np.eye(len(B))
    try:
        forces = np.linalg.solve(interface, gap)
    except np.linalg.LinAlgError:
        forces = np.full(gap.shape, np.nan + 0j)
    if not np.isfinite(forces).all():
        raise ValueError("the interface is singular: a gap is closed twice, or where nothing moves")
    return Coupled(Y - Y @ B.T @ forces, forces, np.eye(Y.shape[1]) - B.T @ forces)
