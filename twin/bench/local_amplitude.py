"""What functions g1, g2 of a sensor's amplitude X are to the bench, whose laws see the layer's own opening and slip.

The opening at an amplitude X is not that of linear mode 1 times X: a layer that has lost half of its E' opens twice as
far, and one whose loss modulus is several times its G' slips less.  And where the file means E'(X) for the layer as a
whole, the bench has one force on each group's rms opening, in the shape of linear mode 1.  So at each X the mode of the
structure as the file means it is found, and then the moduli on the bench's own coordinates that give the same complex
frequency; their mode tells opening and slip at X.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.linalg import qr, solve

from twin.structure import normal_modes

if TYPE_CHECKING:
    from twin.bench.plan import Matrices

__all__ = ["LayerRows", "LocalLaw", "local_law"]

Matrix = NDArray[np.float64]
Complex = NDArray[Any]

POINTS = 40
"""Amplitudes at which modes are found; between them opening and slip per amplitude are smooth."""
KEPT_MODES = 10
TURNS, TOLERANCE = 30, 1e-12


@dataclass(frozen=True)
class LayerRows:
    """The bench's coordinates: openings as (row, weight) by group, and the slip's row and weight, padded."""

    openings: list[tuple[Matrix, float]]
    slip: Matrix
    slip_weight: float


@dataclass(frozen=True)
class LocalLaw:
    """Softening and loss moduli (N/m2) on the bench's own coordinates, over the rms opening and slip (m) at which."""

    opening_m: Matrix
    slip_m: Matrix
    softening: Matrix
    loss: Matrix


def local_law(
    matrices: Matrices, layer: LayerRows, *, E: float, G: float, tip: Matrix,
    amplitude_m: Matrix, softening: Matrix, loss: Matrix,
) -> LocalLaw:  # fmt: skip
    """Translate g1, g2 over X into the bench's coordinates.

    Parameters
    ----------
    matrices
        With all effects in them.
    layer
        The coordinates.
    E, G
        Moduli of the linear layer, N/m2.
    tip
        Row of the deflection whose amplitude X is.
    amplitude_m, softening, loss : ndarray, (k,)
        The file's table.

    Raises
    ------
    ValueError
        If at some amplitude the structure has no mode near its first, or opening and slip do not grow with X.
    """
    s = matrices.structure
    plain = normal_modes(s.M, s.stiffness(E, G), 1).omega[0]
    reduced = _Reduced.of(matrices, layer, E=E, G=G, tip=tip)
    g1, g2 = PchipInterpolator(amplitude_m, softening), PchipInterpolator(amplitude_m, loss)
    X = np.linspace(amplitude_m[0], amplitude_m[-1], POINTS)
    per_m, moduli = np.zeros((2, len(X))), np.zeros((2, len(X)))
    state = reduced.start
    for k, x in enumerate(X):
        state = reduced.at(float(g1(x)), float(g2(x)), state)
        # X is the acceleration's amplitude over the square of the file's first natural frequency.
        factor = plain**2 / abs(state.value)
        per_m[:, k] = factor * state.opening, factor * state.slip
        moduli[:, k] = state.moduli
    knots = np.asarray(amplitude_m, float)
    opening, slip = (PchipInterpolator(X, row)(knots) * knots for row in per_m)
    # Ratios of the moduli are smooth where the functions themselves may have corners.
    given = g1(X), g2(X)
    ratios = (
        np.divide(m, g, out=np.ones_like(m), where=np.abs(g) > 1e-6 * np.max(np.abs(g), initial=1.0))
        for m, g in zip(moduli, given, strict=True)
    )
    h1, h2 = (
        PchipInterpolator(X, ratio)(knots) * np.asarray(g) for ratio, g in zip(ratios, (softening, loss), strict=True)
    )
    if np.any(np.diff(opening) <= 0) or np.any(np.diff(slip) <= 0):
        raise ValueError("joint.law: the layer's opening and slip do not grow with the amplitude")
    return LocalLaw(opening, slip, h1, h2)


@dataclass(frozen=True)
class _State:
    """A mode: its eigenvalue omega^2, and the moduli (softening, loss) on the bench's coordinates that give it."""

    value: complex
    shape: Complex
    moduli: tuple[float, float]
    opening: float
    slip: float


@dataclass(frozen=True)
class _Reduced:
    """The structure in few coordinates: its lowest modes, and the statics of forces on the layer."""

    M: Matrix
    K: Matrix
    K_E: Matrix
    K_G: Matrix
    by_softening: Matrix
    by_loss: Matrix
    opening_rows: Matrix
    opening_weights: Matrix
    slip_row: Matrix
    tip: Matrix
    start: _State

    @staticmethod
    def of(matrices: Matrices, layer: LayerRows, *, E: float, G: float, tip: Matrix) -> _Reduced:
        K = matrices.K_beam + E * matrices.K_E + G * matrices.K_G
        modes = normal_modes(matrices.M, K, KEPT_MODES)
        forces = np.vstack([*map(matrices.pad, matrices.structure.B_E), *map(matrices.pad, matrices.structure.B_G)])
        basis = qr(np.hstack([modes.Phi, solve(K, forces.T, assume_a="pos")]), mode="economic", pivoting=True)
        V = basis[0][:, np.abs(np.diag(basis[1])) > 1e-12 * abs(basis[1][0, 0])]
        M, K, K_E, K_G = (V.T @ A @ V for A in (matrices.M, K, matrices.K_E, matrices.K_G))
        rows = np.array([row for row, _ in layer.openings]) @ V
        weights = np.array([weight for _, weight in layer.openings])
        slip = layer.slip @ V
        first = V.T @ modes.Phi[:, 0]
        value = complex(modes.omega[0] ** 2)
        return _Reduced(
            M, K, K_E, K_G, (rows.T * weights) @ rows, layer.slip_weight * np.outer(slip, slip), rows, weights, slip,
            tip @ V, _State(value, np.linalg.solve(V.T @ V, first) + 0j, (0.0, 0.0), 0.0, 0.0),
        )  # fmt: skip

    def at(self, softening: float, loss: float, near: _State) -> _State:
        """The mode where the layer as a whole has these moduli, and its likeness on the bench's coordinates."""
        meant = self.K - softening * self.K_E + 1j * loss * self.K_G
        value, _ = self._mode(meant, near.value, near.shape)
        h1, h2 = (softening, loss) if near.moduli == (0.0, 0.0) else near.moduli
        shape, found = near.shape, near.value
        for _ in range(TURNS):
            found, shape = self._mode(self.K - h1 * self.by_softening + 1j * h2 * self.by_loss, found, shape)
            miss = value - found
            mass = shape @ self.M @ shape
            by_h1 = -(shape @ self.by_softening @ shape) / mass
            by_h2 = 1j * (shape @ self.by_loss @ shape) / mass
            if abs(miss) < TOLERANCE * abs(value):
                break
            step = np.linalg.solve([[by_h1.real, by_h2.real], [by_h1.imag, by_h2.imag]], [miss.real, miss.imag])
            h1, h2 = h1 + float(step[0]), h2 + float(step[1])
        else:
            raise ValueError("joint.law: no law on the layer's opening and slip is like this one")
        amplitude = abs(self.tip @ shape)
        squares = np.abs(self.opening_rows @ shape) ** 2
        opening = float(np.sqrt(squares @ self.opening_weights / self.opening_weights.sum()) / amplitude)
        return _State(found, shape, (h1, h2), opening, float(abs(self.slip_row @ shape) / amplitude))

    def _mode(self, K: Complex, value: complex, shape: Complex) -> tuple[complex, Complex]:
        """The eigenvalue nearest to a guess, by Rayleigh quotients."""
        for _ in range(TURNS):
            shape = np.linalg.solve(K - value * (1 + 1e-13) * self.M, self.M @ shape)
            shape = shape / np.linalg.norm(shape)
            new = complex(shape @ K @ shape / (shape @ self.M @ shape))
            if abs(new - value) < 0.1 * TOLERANCE * abs(value):
                return new, shape
            value = new
        raise ValueError("joint.law: the structure has no mode near its first at some amplitude")
