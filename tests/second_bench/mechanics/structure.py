"""From a specimen to its modes: the joint at rest is in them; what its law changes acts at a few local elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from tests.second_bench.mechanics.beams import DOFS, meshed
from tests.second_bench.mechanics.laws import PARAMETERS, Kind
from tests.second_bench.mechanics.specimen import Layer, Specimen

Array = NDArray[np.float64]

MODES = 16
"""Kept with their inertia, up to some 10 kHz, ten times the recordings' band; the others yield as springs do."""


@dataclass(frozen=True, eq=False)
class Modes:
    """A specimen in n mass-normalised modes, with e local elements.

    Attributes
    ----------
    omega, damping : ndarray, (n,)
        rad/s, and ratios.
    drive : ndarray, (n,)
        Shapes at the drive.
    sensors : ndarray, (s, n)
        Shapes at the sensors.
    elements : ndarray, (e, n)
        Shapes in the motion of the elements.
    residual : ndarray, (e, e)
        Flexibility among elements that the modes left out have, m/N; none for an element of velocity.
    kinds : ndarray of int, (e,)
    parameters : ndarray, (e, PARAMETERS)
    """

    omega: Array
    damping: Array
    drive: Array
    sensors: Array
    elements: Array
    residual: Array
    kinds: NDArray[np.int64]
    parameters: Array

    def receptance(self, frequency_Hz: Array) -> Array:
        """Linear response of the sensors per force, m/N, (f, s)."""
        w = 2 * np.pi * np.asarray(frequency_Hz)[:, None]
        modal = 1.0 / (self.omega**2 - w**2 + 2j * self.damping * self.omega * w)
        return np.asarray((modal * self.drive) @ self.sensors.T)


@dataclass(frozen=True, eq=False)
class _Element:
    row: Array
    kind: Kind
    parameters: tuple[float, ...]


def modes_of(specimen: Specimen, count: int = MODES) -> Modes:
    """Assemble a specimen and solve for its modes."""
    lower = meshed(specimen.lower, specimen.elements[0], specimen.weak)
    upper = meshed(specimen.upper, specimen.elements[1])
    n, split = lower.size + upper.size, lower.size
    M, K = np.zeros((n, n)), np.zeros((n, n))
    M[:split, :split], K[:split, :split] = lower.matrices()
    M[split:, split:], K[split:, split:] = upper.matrices()

    def motion(x: float) -> Array:
        """Rows of u and v at a place, which is on the lower beam as far as that reaches, (2, n)."""
        rows = np.zeros((2, n))
        if x <= specimen.lower.length:
            rows[:, :split] = lower.rows(x)[:2]
        else:
            rows[:, split:] = upper.rows(min(x, specimen.length))[:2]
        return rows

    def deflection(x: float) -> Array:
        return motion(x)[1]

    elements = []
    for x, area in _points(specimen.layer):
        opening, slip = np.zeros(n), np.zeros(n)
        (u1, v1, slope1), (u2, v2, slope2) = lower.rows(x), upper.rows(x)
        opening[:split], opening[split:] = -v1, v2
        slip[:split] = -u1 + specimen.lower.thickness / 2 * slope1
        slip[split:] = u2 + specimen.upper.thickness / 2 * slope2
        elements += _at_point(specimen.layer, area, opening, slip)
    for element in elements:
        K += _at_rest(element) * np.outer(element.row, element.row)
    for point, stiffness, force in specimen.layer.sliders:
        slip = [element for element in elements if element.kind == Kind.RIDING_FRICTION][point].row
        elements.append(_Element(slip, Kind.SLIDER, (stiffness, force)))
    for mass_at, mass in specimen.masses:
        rows = motion(mass_at)
        M += mass * rows.T @ rows
    elements += [_Element(deflection(g.position), g.kind, g.parameters) for g in specimen.ground]
    rows = np.array([element.row for element in elements])
    kinds = np.array([element.kind for element in elements], dtype=np.int64)
    free = np.arange(DOFS, n)  # the clamp holds all of the first node
    M, K, rows = M[np.ix_(free, free)], K[np.ix_(free, free)], rows[:, free]
    square, shapes = _lowest(M, K, count)
    modal = rows @ shapes
    residual = rows @ np.linalg.solve(K, rows.T) - (modal / square) @ modal.T
    resists = np.array([Kind(kind).of_velocity for kind in kinds])
    residual[resists, :], residual[:, resists] = 0.0, 0.0
    ratios = np.array(specimen.modal_ratio)
    return Modes(
        omega=np.sqrt(square),
        damping=ratios[np.minimum(np.arange(count), len(ratios) - 1)],
        drive=deflection(specimen.drive_position)[free] @ shapes,
        sensors=np.array([deflection(x)[free] @ shapes for x in specimen.sensors.values()]),
        elements=modal,
        residual=residual,
        kinds=kinds,
        parameters=np.array([[*e.parameters, *[0.0] * (PARAMETERS - len(e.parameters))] for e in elements]),
    )


def _lowest(M: Array, K: Array, count: int) -> tuple[Array, Array]:
    """Squares of the lowest natural frequencies and mass-normalised shapes, (count,) and (n, count).

    The lowest of K are the highest of M in the scale of K, where no fast motion of a short element spoils their digits.
    """
    scale = 1 / np.sqrt(np.diag(K))
    inverse, shapes = eigh(
        scale[:, None] * M * scale, scale[:, None] * K * scale, subset_by_index=(len(M) - count, len(M) - 1)
    )
    inverse, shapes = inverse[::-1], scale[:, None] * shapes[:, ::-1]
    return 1 / inverse, shapes / np.sqrt(inverse)


def _points(layer: Layer) -> list[tuple[float, float]]:
    """(place in m, area over height in m) of the layer's points."""
    x, weight = np.polynomial.legendre.leggauss(layer.points)
    half = (layer.end - layer.begin) / 2
    return [
        (layer.begin + half * (1 + xi), half * w * layer.width / layer.height)
        for xi, w in zip(x.tolist(), weight.tolist(), strict=True)
    ]


def _at_point(layer: Layer, area: float, opening: Array, slip: Array) -> list[_Element]:
    normal, shear = layer.normal_modulus * area, layer.shear_modulus * area
    return [
        _Element(opening, Kind.SOFTENING, (
            normal, layer.softening, layer.opening_m, layer.early, layer.gap_m, layer.slap_factor, normal,
        )),
        _Element(slip, Kind.RIDING_FRICTION, (shear, layer.friction * area, layer.slip_m, layer.travel_m, shear)),
    ]  # fmt: skip


def _at_rest(element: _Element) -> float:
    """Stiffness of a layer's element that belongs to the linear structure, N/m."""
    return element.parameters[-1]
