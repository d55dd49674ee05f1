"""Beam elements on the neutral axis: three degrees of freedom a node (u, v, theta)."""

from functools import cache
from types import EllipsisType

import numpy as np
from numpy.typing import ArrayLike

from twin.arrays import Array

Block = tuple[EllipsisType, Array, Array]


def _block(dofs: list[int]) -> Block:
    return (..., np.array(dofs)[:, None], np.array(dofs)[None, :])


AXIAL, BENDING = _block([0, 3]), _block([1, 2, 4, 5])
"""Places of (u1, u2) and of (v1, theta1, v2, theta2) in an element's matrices."""
SLENDER = np.array([[12.0, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
THICK = np.array([[0.0, 0, 0, 0], [0, 1, 0, -1], [0, 0, 0, 0], [0, -1, 0, 1]])
_MASS = np.array([[156.0, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420
_STRETCH, _AXIAL_MASS = np.array([[1.0, -1], [-1, 1]]), np.array([[2.0, 1], [1, 2]]) / 6


def per_length(length: ArrayLike) -> Array:
    """Factors of the bending entries, (..., 4, 4): a rotation counts as an end's deflection over the length."""
    L = np.asarray(length, float)
    d = np.stack([np.ones_like(L), L, np.ones_like(L), L], axis=-1)
    return np.asarray(d[..., :, None] * d[..., None, :])


def beam_stiffness(*, EA: float, EI: float, length: ArrayLike, shear_ratio: float = 0.0) -> Array:
    """Stiffness (..., 6, 6) of beam elements, DOFs (u1, v1, theta1, u2, v2, theta2).

    Parameters
    ----------
    EA, EI
        Axial (N) and bending (N m2) stiffness of the section.
    length : float or ndarray
        Of the element or elements, m.
    shear_ratio
        E / (kappa G).  Zero is Euler-Bernoulli, otherwise Timoshenko with the exact static shape functions.
    """
    L = np.asarray(length, float)[..., None, None]
    phi = 12.0 * EI / EA * shear_ratio / L**2
    K = np.zeros((*np.shape(length), 6, 6))
    K[AXIAL] = EA / L * _STRETCH
    K[BENDING] = EI / (1.0 + phi) / L**3 * (SLENDER + phi * THICK) * per_length(length)
    return K


def weakened_stiffness(
    *, EA: float, EI: float, length: float, weak: tuple[float, float], factor: float, shear_ratio: float = 0.0
) -> Array:
    """Stiffness (6, 6) of one beam element of which a stretch is weaker, DOFs as in :func:`beam_stiffness`.

    Exact: the flexibilities of the stretches add under the linear moment of an element without loads.

    Parameters
    ----------
    EA, EI, length, shear_ratio
        Of the sound element, as in :func:`beam_stiffness`.
    weak
        Where the stretch begins and ends, m from the first node.
    factor
        What it has left of both stiffnesses, above zero.
    """
    # Under a force and a moment at the second node, the first held: the moment at x is M + V (L - x).
    far, near = length - weak[0], length - weak[1]
    more = 1.0 / factor - 1.0
    powers = [(length**n + more * (far**n - near**n)) / n for n in (1, 2, 3)]
    flexibility = np.array([[powers[2] / EI + shear_ratio * powers[0] / EA, powers[1] / EI], [0.0, powers[0] / EI]])
    flexibility[1, 0] = flexibility[0, 1]
    apart = np.array([[-1.0, -length, 1.0, 0.0], [0.0, -1.0, 0.0, 1.0]])
    K = np.zeros((6, 6))
    K[AXIAL] = EA / powers[0] * _STRETCH
    K[BENDING] = apart.T @ np.linalg.solve(flexibility, apart)
    return K


def beam_mass(*, mass_per_length: float, length: ArrayLike) -> Array:
    """Consistent mass (..., 6, 6) of beam elements, DOFs (u1, v1, theta1, u2, v2, theta2).

    Parameters
    ----------
    mass_per_length
        kg/m.
    length : float or ndarray
        Of the element or elements, m.
    """
    L = np.asarray(length, float)[..., None, None]
    M = np.zeros((*np.shape(length), 6, 6))
    M[AXIAL] = mass_per_length * L * _AXIAL_MASS
    M[BENDING] = mass_per_length * L * _MASS * per_length(length)
    return M


def deflection_shape(xi: float, length: float) -> Array:
    """Hermite functions of (v1, theta1, v2, theta2) for the deflection v at `xi` in 0..1."""
    return np.array(
        [1 - 3 * xi**2 + 2 * xi**3, length * (xi - 2 * xi**2 + xi**3), 3 * xi**2 - 2 * xi**3, length * (xi**3 - xi**2)]
    )


def slope_shape(xi: float, length: float) -> Array:
    """Derivative of :func:`deflection_shape` with respect to x: the slope v' at `xi` in 0..1."""
    return np.array(
        [(6 * xi**2 - 6 * xi) / length, 1 - 4 * xi + 3 * xi**2, (6 * xi - 6 * xi**2) / length, 3 * xi**2 - 2 * xi]
    )


def curvature_shape(xi: float, length: float) -> Array:
    """Second derivative of :func:`deflection_shape` with respect to x: the curvature v'' at `xi` in 0..1."""
    return np.array(
        [(12 * xi - 6) / length**2, (6 * xi - 4) / length, (6 - 12 * xi) / length**2, (6 * xi - 2) / length]
    )


def rotation_rate_shape(xi: float, length: float, shear: float) -> Array:
    """Functions of (v1, theta1, v2, theta2) for the derivative of the section's rotation at `xi` in 0..1.

    Parameters
    ----------
    shear
        12 E I / (kappa G A length^2) of the element; zero gives :func:`curvature_shape`.
    """
    turned = np.array([0.0, -shear, 0.0, shear]) / length
    return np.asarray((curvature_shape(xi, length) + turned) / (1.0 + shear))


@cache
def gauss(points: int) -> tuple[Array, Array]:
    """Abscissae and weights of Gauss-Legendre quadrature on 0..1."""
    x, w = np.polynomial.legendre.leggauss(points)
    return (x + 1) / 2, w / 2
