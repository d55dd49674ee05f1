"""What functions g1, g2 of a sensor's amplitude X are to the bench, whose laws see the layer's own opening and slip.

The opening at an amplitude X is not that of linear mode 1 times X: a layer that has lost half of its E' opens twice as
far, and one whose loss modulus is several times its G' slips less.  And where the file means E'(X) and G'(X) for the
layer as a whole, the bench has one force on each group's rms opening and one on its slip, in the shapes of linear
mode 1.  So at each X the softening and the loss on the bench's own coordinates are found that give the first mode the
same frequency and damping; that mode tells opening and slip at X.  A loss modulus many times G' hinders the slip that
it lives on: where more of it hardly damps more, the one coordinate cannot follow the whole layer any further.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.linalg import qr, solve

from twin.bench.opening_harmonics import ORDERS
from twin.structure import normal_modes

if TYPE_CHECKING:
    from twin.bench.plan import Matrices

__all__ = ["LayerRows", "LocalLaw", "local_law"]

Matrix = NDArray[np.float64]
Complex = NDArray[Any]

POINTS = 40
"""Amplitudes at which modes are found; between them opening and slip per amplitude are smooth."""
KEPT_MODES = 10
TURNS, TOLERANCE = 12, 1e-7
SATURATED = 0.25
"""Below this damping by more loss modulus, over that in a layer that hardly loses, its share stays what it was."""


@dataclass(frozen=True)
class LayerRows:
    """The bench's coordinates: openings as (row, weight) by group, and the slip's row and weight, padded."""

    openings: list[tuple[Matrix, float]]
    slip: Matrix
    slip_weight: float


@dataclass(frozen=True)
class LocalLaw:
    """Softening and loss moduli (N/m2) on the bench's own coordinates, over the rms opening and slip (m) at which.

    `flexibility` is the rms opening that a force makes at ORDERS times the first frequency, m2/N: over a modulus.
    """

    opening_m: Matrix
    slip_m: Matrix
    softening: Matrix
    loss: Matrix
    flexibility: Complex


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
    g1, g2 = (PchipInterpolator(amplitude_m, function) for function in (softening, loss))
    X = np.linspace(amplitude_m[0], amplitude_m[-1], POINTS)
    per_m, more, share = np.zeros((2, len(X))), np.zeros(len(X)), np.zeros(len(X))
    state = reduced.start
    for k, x in enumerate(X):
        state = reduced.at(float(g1(x)), float(g2(x)), state)
        # X is the acceleration's amplitude over the square of the file's first natural frequency.
        factor = plain**2 / abs(state.value)
        per_m[:, k] = factor * state.opening, factor * state.slip
        more[k], share[k] = state.softening_more, state.loss_share
    knots = np.asarray(amplitude_m, float)
    opening, slip = (PchipInterpolator(X, row)(knots) * knots for row in per_m)
    # What differs is smooth where the functions themselves may have corners.
    own_softening = np.asarray(softening) + PchipInterpolator(X, more)(knots)
    own_loss = np.asarray(loss) * PchipInterpolator(X, share)(knots)
    if np.any(np.diff(opening) <= 0) or np.any(np.diff(slip) <= 0):
        raise ValueError("joint.law: the layer's opening and slip do not grow with the amplitude")
    return LocalLaw(opening, slip, own_softening, own_loss, reduced.flexibility(np.array(ORDERS) * plain))


@dataclass(frozen=True)
class _State:
    """A mode: its eigenvalue omega^2, and the bench's softening less the layer's, and its loss over the layer's.

    Any loss moves the frequency a little, whatever the softening is, which may be none.
    """

    value: complex
    shape: Complex
    softening_more: float
    loss_share: float
    opening: float
    slip: float


@dataclass(frozen=True)
class _Reduced:
    """The structure in few coordinates: its lowest modes, and the statics of forces on the layer."""

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
        pad = matrices.pad
        K = matrices.K_beam + E * matrices.K_E + G * matrices.K_G
        modes = normal_modes(matrices.M, K, KEPT_MODES)
        forces = np.vstack([*map(pad, matrices.structure.B_E), *map(pad, matrices.structure.B_G)])
        basis = qr(np.hstack([modes.Phi, solve(K, forces.T, assume_a="pos")]), mode="economic", pivoting=True)
        V = basis[0][:, np.abs(np.diag(basis[1])) > 1e-12 * abs(basis[1][0, 0])]
        # In modes of the reduced structure, and from factors: mode 1 feels a minute part of the layer's stiffness.
        own = normal_modes(V.T @ matrices.M @ V, V.T @ K @ V)
        V = V @ own.Phi
        B_E, B_G = (np.array([*map(pad, B)]) @ V for B in (matrices.structure.B_E, matrices.structure.B_G))
        rows = np.array([row for row, _ in layer.openings]) @ V
        weights = np.array([weight for _, weight in layer.openings])
        slip = layer.slip @ V
        start = _State(complex(own.omega[0] ** 2), np.eye(len(V.T))[0] + 0j, 0.0, 1.0, 0.0, 0.0)
        return _Reduced(
            np.diag(own.omega**2), B_E.T @ B_E, B_G.T @ B_G, (rows.T * weights) @ rows,
            layer.slip_weight * np.outer(slip, slip), rows, weights, slip, tip @ V, start,
        )  # fmt: skip

    def at(self, softening: float, loss: float, near: _State) -> _State:
        """The mode with the bench's softening and loss that is as fast and as damped as with those of the layer."""
        meant, shape = self._mode(self.K - softening * self.K_E + 1j * loss * self.K_G, near.value, near.shape)
        own = np.array([softening + near.softening_more, near.loss_share * loss])
        damps = (near.shape @ self.by_loss @ near.shape) / (self.start.shape @ self.by_loss @ self.start.shape)
        free = [0] if damps.real < SATURATED else [0, 1]
        for _ in range(TURNS):
            value, shape = self._mode(self.K - own[0] * self.by_softening + 1j * own[1] * self.by_loss, meant, shape)
            slopes = np.array([-(shape @ self.by_softening @ shape), 1j * (shape @ self.by_loss @ shape)])
            miss = meant - value
            both = np.array([slopes.real, slopes.imag])[free][:, free]
            step = np.linalg.solve(both, np.array([miss.real, miss.imag])[free])
            own[free] += step
            if np.all(np.abs(step) <= TOLERANCE * np.abs(own[free])):
                break
        if not 0.1 < abs(value) / abs(near.value) < 10.0:
            raise ValueError("joint.law: the structure has no mode near its first at some amplitude")
        amplitude = abs(self.tip @ shape)
        squares = np.abs(self.opening_rows @ shape) ** 2
        opening = float(np.sqrt(squares @ self.opening_weights / self.opening_weights.sum()) / amplitude)
        slip = float(abs(self.slip_row @ shape) / amplitude)
        loss_share = float(own[1] / loss) if loss else 1.0
        return _State(value, shape, float(own[0]) - softening, loss_share, opening, slip)

    def flexibility(self, omega: Matrix) -> Matrix:
        """Rms opening, in the shape of the linear mode, per unit of a generalised force in that shape; (f,)."""
        shape = self.opening_weights * (self.opening_rows @ self.start.shape.real)
        row = shape @ self.opening_rows
        # A force f on the rms opening is one of f weight times the shape, whose own rms is one.
        rms = np.sqrt(np.sum(shape**2 / self.opening_weights) / self.opening_weights.sum())
        squares = row**2 / (rms**2 * self.opening_weights.sum())
        return np.array([np.sum(squares / (np.diag(self.K) - w**2)) for w in omega])

    def _mode(self, K: Complex, value: complex, shape: Complex) -> tuple[complex, Complex]:
        """The eigenvalue nearest to a guess, by Rayleigh quotients, in coordinates whose mass is one."""
        for _ in range(TURNS):
            shape = np.linalg.solve(K - value * (1 + 1e-12) * np.eye(len(K)), shape)
            shape = shape / np.sqrt(shape @ shape)
            before, value = value, complex(shape @ K @ shape)
            if abs(value - before) < TOLERANCE * abs(value):
                break
        return value, shape
