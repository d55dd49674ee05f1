"""Timoshenko's beam element: exact static shape functions and consistent mass.

With phi = 12 EI s / (EA L^2) and s = E / (kappa G), deflection and section rotation are rational in phi alone,
(a(xi) + phi b(xi)) / (1 + phi).  Polynomials as in Przemieniecki, Theory of Matrix Structural Analysis (1968),
chapter 11.
"""

import numpy as np
from numpy.typing import ArrayLike

from twin.arrays import Array
from twin.structure.elements.beam import BENDING, beam_mass, gauss, per_length


def shear_parameter(*, radius2: float, shear_ratio: float, length: Array) -> Array:
    """The element's phi, from the section's I/A (`radius2`, m2), s = E/(kappa G) and the element's length (m)."""
    return np.asarray(12.0 * radius2 * shear_ratio / length**2)


def timoshenko_mass(*, mass_per_length: float, radius2: float, length: ArrayLike, shear_ratio: float) -> Array:
    """Consistent mass (..., 6, 6) with rotary inertia, DOFs (u1, v1, theta1, u2, v2, theta2).

    Parameters
    ----------
    mass_per_length
        kg/m.
    radius2
        I/A of the section, m2.
    length : float or ndarray
        Of the element or elements, m.
    shear_ratio
        E / (kappa G); zero leaves Rayleigh's beam: no shear deformation, but rotary inertia.
    """
    L = np.asarray(length, float)[..., None, None]
    phi = shear_parameter(radius2=radius2, shear_ratio=shear_ratio, length=L)
    M = beam_mass(mass_per_length=mass_per_length, length=length)
    integral = sum(
        factor * (one + phi * mixed + phi**2 * two)
        for factor, (one, mixed, two) in ((1.0, DEFLECTION), (radius2 / L**2, ROTATION))
    )
    M[BENDING] = mass_per_length * L * integral / (1 + phi) ** 2 * per_length(length)
    return M


def _of_phi(a: list[Array], b: list[Array]) -> tuple[Array, Array, Array]:
    """Integrals of N' N over the element for N = a + phi b: what goes with 1, phi and phi^2."""
    one, two = np.stack(a, axis=1), np.stack(b, axis=1)
    mixed = (one.T * _WEIGHT) @ two
    return (one.T * _WEIGHT) @ one, mixed + mixed.T, (two.T * _WEIGHT) @ two


# Of deflection and section rotation in (v1, theta1 L, v2, theta2 L); four Gauss points are exact for squares of cubics.
_XI, _WEIGHT = gauss(4)
DEFLECTION = _of_phi(
    [1 - 3 * _XI**2 + 2 * _XI**3, _XI - 2 * _XI**2 + _XI**3, 3 * _XI**2 - 2 * _XI**3, _XI**3 - _XI**2],
    [1 - _XI, (_XI - _XI**2) / 2, _XI, (_XI**2 - _XI) / 2],
)
ROTATION = _of_phi(
    [6 * (_XI**2 - _XI), 1 - 4 * _XI + 3 * _XI**2, 6 * (_XI - _XI**2), 3 * _XI**2 - 2 * _XI],
    [0 * _XI, 1 - _XI, 0 * _XI, _XI],
)
