"""Backbones that are no points: what Masing and Iwan laws become with ever more sliders, and their closed forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from twin.arrays import Array
from twin.joint import ParallelJenkins, masing_of_points

__all__ = ["iwan_backbone", "masing", "masing_stiffness"]

NODES, WEIGHTS = np.polynomial.legendre.leggauss(400)


def masing(backbone: Callable[[Array], Array], *, limit_m: float, sliders: int = 20) -> ParallelJenkins:
    """The law with a given backbone, straight between so many points.

    Parameters
    ----------
    backbone
        Force on first loading, from F(0) = 0, rising ever less.
    limit_m
        Deflection up to which the backbone is followed; beyond, it goes on with its last slope.
    sliders
        How many, with equal distances between the deflections at which they slip.

    Raises
    ------
    ValueError
        If the backbone is not concave, so that no sliders make it.
    """
    x = np.linspace(0.0, limit_m, sliders + 1)
    return masing_of_points(x, np.asarray(backbone(x)))


def masing_stiffness(amplitude: Array | float, backbone: Callable[[Array], Array]) -> Array:
    """Describing function over a backbone.

    On the loop of amplitude A, e = A sin(theta), the loading branch is -F(A) + 2 F((e + A)/2), which gives the storage
    ``(1/(pi A)) 2 integral f sin(theta)`` over it; the loop encloses ``8 integral_0^A F - 4 A F(A) = pi A^2 Im N``.
    """
    A = np.asarray(amplitude, float)
    theta = NODES * np.pi / 2
    half = A[..., None] * (1.0 + np.sin(theta)) / 2.0
    loading = 2.0 * backbone(half) - backbone(A)[..., None]
    storage = np.sum(WEIGHTS * loading * np.sin(theta), axis=-1) / A
    under = np.sum(WEIGHTS * backbone(A[..., None] * (NODES + 1.0) / 2.0), axis=-1) * A / 2.0
    loss = (8.0 * under - 4.0 * A * backbone(A)) / (np.pi * A**2)
    return np.asarray(storage + 1j * loss, complex)


def iwan_backbone(x: Array, stiffness_N_per_m: float, slip_force_N: float, *, chi: float = 0.0) -> Array:
    """Force on first loading to x >= 0, with infinitely many sliders."""
    x_1 = slip_force_N / stiffness_N_per_m * (chi + 2.0) / (chi + 1.0)
    inside = np.minimum(np.asarray(x, float), x_1)
    return np.asarray(stiffness_N_per_m * inside * (1.0 - (inside / x_1) ** (chi + 1.0) / (chi + 2.0)))
