"""Beam elements on the neutral axis, Euler-Bernoulli's and Timoshenko's: three degrees of freedom a node (u, v, theta).

With phi = 12 EI s / (EA L^2) and s = E / (kappa G), deflection and section rotation are rational in phi alone,
(a(xi) + phi b(xi)) / (1 + phi).  Polynomials as in Przemieniecki, Theory of Matrix Structural Analysis (1968),
chapter 11; a is Hermite's cubics, and the deflection without shear.
"""

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
HERMITE = [
    [(2.0, -3.0, 0.0, 1.0), (1.0, -2.0, 1.0, 0.0), (-2.0, 3.0, 0.0, 0.0), (1.0, -1.0, 0.0, 0.0)],
    [(0.0, 6.0, -6.0, 0.0), (0.0, 3.0, -4.0, 1.0), (0.0, -6.0, 6.0, 0.0), (0.0, 3.0, -2.0, 0.0)],
    [(0.0, 0.0, 12.0, -6.0), (0.0, 0.0, 6.0, -4.0), (0.0, 0.0, -12.0, 6.0), (0.0, 0.0, 6.0, -2.0)],
]
"""Coefficients of xi^3 to 1 in the deflection by (v1, theta1 L, v2, theta2 L), and in its derivatives by xi."""
Cubics = list[tuple[float, float, float, float]]


def _of_phi(one: Cubics, two: Cubics) -> tuple[Array, Array, Array]:
    """Integrals of N' N over the element for N = one + phi two: what goes with 1, phi and phi^2."""
    xi, weight = gauss(4)  # exact for squares of cubics
    a, b = (np.array([np.polyval(cubic, xi) for cubic in N]) * np.sqrt(weight) for N in (one, two))
    return a @ a.T, a @ b.T + b @ a.T, b @ b.T


@cache
def gauss(points: int) -> tuple[Array, Array]:
    """Abscissae and weights of Gauss-Legendre quadrature on 0..1."""
    x, w = np.polynomial.legendre.leggauss(points)
    return (x + 1) / 2, w / 2


DEFLECTION = _of_phi(HERMITE[0], [(0, 0, -1, 1), (0, -0.5, 0.5, 0), (0, 0, 1, 0), (0, 0.5, -0.5, 0)])
ROTATION = _of_phi(HERMITE[1], [(0, 0, 0, 0), (0, 0, -1, 1), (0, 0, 0, 0), (0, 0, 1, 0)])
"""Of deflection and section rotation in (v1, theta1 L, v2, theta2 L)."""


def per_length(length: ArrayLike) -> Array:
    """Factors of the bending entries, (..., 4, 4): a rotation counts as an end's deflection over the length."""
    L = np.asarray(length, float)
    d = np.stack([np.ones_like(L), L, np.ones_like(L), L], axis=-1)
    return np.asarray(d[..., :, None] * d[..., None, :])


def shear_parameter(*, radius2: float, shear_ratio: float, length: Array) -> Array:
    """The element's phi, from the section's I/A (`radius2`, m2), s = E/(kappa G) and the element's length (m)."""
    return np.asarray(12.0 * radius2 * shear_ratio / length**2)


def rod_stiffness(rate: float, length: ArrayLike) -> Array:
    """Stiffness (..., 2, 2) between the ends of what is stretched or twisted, of EA (N) or GJ (N m2), length m."""
    return rate / np.asarray(length, float)[..., None, None] * np.array([[1.0, -1], [-1, 1]])


def rod_mass(per_length: float, length: ArrayLike) -> Array:
    """The same of the mass, kg/m, or the inertia about the axis, kg m."""
    return per_length * np.asarray(length, float)[..., None, None] * np.array([[2.0, 1], [1, 2]]) / 6


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
    phi = shear_parameter(radius2=EI / EA, shear_ratio=shear_ratio, length=L)
    K = np.zeros((*np.shape(length), 6, 6))
    K[AXIAL] = rod_stiffness(EA, length)
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
    K[AXIAL] = rod_stiffness(EA, powers[0])
    K[BENDING] = apart.T @ np.linalg.solve(flexibility, apart)
    return K


def beam_mass(*, mass_per_length: float, length: ArrayLike, radius2: float = 0.0, shear_ratio: float = 0.0) -> Array:
    """Consistent mass (..., 6, 6) of beam elements, DOFs (u1, v1, theta1, u2, v2, theta2).

    Parameters
    ----------
    mass_per_length
        kg/m.
    length : float or ndarray
        Of the element or elements, m.
    radius2
        I/A of the section, m2, for rotary inertia; left out, the element is Euler-Bernoulli's.
    shear_ratio
        E / (kappa G); zero leaves Rayleigh's beam: no shear deformation, but rotary inertia.
    """
    L = np.asarray(length, float)[..., None, None]
    phi = shear_parameter(radius2=radius2, shear_ratio=shear_ratio, length=L)
    M = np.zeros((*np.shape(length), 6, 6))
    M[AXIAL] = rod_mass(mass_per_length, length)
    integral = sum(
        factor * (one + phi * mixed + phi**2 * two)
        for factor, (one, mixed, two) in ((1.0, DEFLECTION), (radius2 / L**2, ROTATION))
    )
    M[BENDING] = mass_per_length * L * integral / (1 + phi) ** 2 * per_length(length)
    return M


def deflection_shape(xi: float, length: float, derivative: int = 0) -> Array:
    """Functions of (v1, theta1, v2, theta2) for the deflection v at `xi` in 0..1, or for v' or v'' (`derivative`)."""
    v1, turn1, v2, turn2 = [((a * xi + b) * xi + c) * xi + d for a, b, c, d in HERMITE[derivative]]
    return np.array([v1, length * turn1, v2, length * turn2]) / length**derivative


def rotation_rate_shape(xi: float, length: float, shear: float) -> Array:
    """Functions of (v1, theta1, v2, theta2) for the derivative of the section's rotation at `xi` in 0..1.

    Parameters
    ----------
    shear
        12 E I / (kappa G A length^2) of the element; zero gives the curvature.
    """
    turned = np.array([0.0, -shear, 0.0, shear]) / length
    return np.asarray((deflection_shape(xi, length, 2) + turned) / (1.0 + shear))
