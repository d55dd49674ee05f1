"""A part's receptances synthesised from its measured ones: reciprocal, of one rank for each mode, almost free of noise.

Coupling inverts receptances of the interface.  Those of a part that hangs free are almost alike at low frequencies, and
their differences, which are the flexibility, drown in a noise of a tenth of a per cent.  All lines together say more
than each (poles by maximum likelihood as in :mod:`twin.identify.modes`, then rank and reciprocity of the residues)::

    Y = - G G' (w0 / w)^2 + sum_r [ psi psi' / (i w - p) + conj ] + sum_n R_n (i w / w1)^n,    n = 0 ... 5

w0 and w1 are the first and the last line; G holds the motions below all lines, rigid ones among them, and the R_n are
what remains of modes above: real, as those of every structure that moves in time, so that damping which does not vanish
at rest (a constant loss factor) is followed only nearly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from twin.arrays import Array
from twin.identify.linear.blocks import Blocks
from twin.identify.modes import ModalFit, fit_modes
from twin.substructuring.limits import LIMITS


@dataclass(frozen=True, eq=False)
class Synthesis:
    """A part's receptances between its p points at any frequency of its band."""

    vector: Array
    """Its parameters, see :attr:`blocks`, (n,)."""
    modes: int
    rigid: int
    points: int
    """Numbers m of poles, k of motions below all lines, p of points."""
    band: tuple[float, float]
    """First and last line w0 and w1, rad/s."""
    information: Array
    """Inverse of the parameters' covariance, (n, n)."""
    chi2_per_dof: float = 0.0
    """Of the measured responses about it; where above one the covariance is widened by it."""

    @cached_property
    def blocks(self) -> Blocks:
        """Order and sizes of the parameters; R_n by the pairs j <= k of points."""
        p, m, rest = self.points, self.modes, LIMITS.remainders * self.points * (self.points + 1) // 2
        shapes = (("omega", m), ("zeta", m), ("psi_re", p * m), ("psi_im", p * m), ("G", p * self.rigid))
        return Blocks((*shapes, ("rest", rest)))

    @cached_property
    def _part(self) -> dict[str, Array]:
        return self.blocks.unpack(self.vector)

    @cached_property
    def _poles(self) -> tuple[Array, Array]:
        """Poles (m,), and their derivatives by the logarithms of the damping ratios."""
        natural, zeta = np.exp(self._part["omega"]), np.exp(self._part["zeta"])
        root = np.sqrt(1 - zeta**2)
        return natural * (-zeta + 1j * root), natural * zeta * (-1 - 1j * zeta / root)

    @cached_property
    def _shapes(self) -> tuple[Array, Array]:
        """Psi (p, m) and G (p, k)."""
        psi = self._part["psi_re"] + 1j * self._part["psi_im"]
        return psi.reshape(self.points, self.modes), self._part["G"].reshape(self.points, self.rigid)

    def remainders(self, omega: Array) -> Array:
        """Courses of the remainders, (f, 6)."""
        return np.asarray((1j * omega[:, None] / self.band[1]) ** np.arange(LIMITS.remainders))

    def receptance(self, omega: Array) -> Array:
        """Receptances (f, p, p), m/N, at `omega` (f,), rad/s."""
        (poles, _), (psi, G), s = self._poles, self._shapes, 1j * omega[:, None]
        ranks = np.einsum("jr,kr->rjk", psi, psi).reshape(self.modes, -1)
        rest = _square(self._part["rest"].reshape(-1, LIMITS.remainders), self.points)
        found = (1 / (s - poles)) @ ranks + (1 / (s - poles.conj())) @ ranks.conj()
        found -= (self.band[0] / omega[:, None]) ** 2 * (G @ G.T).ravel()
        found += self.remainders(omega) @ rest.reshape(-1, LIMITS.remainders).T
        return np.asarray(found.reshape(-1, self.points, self.points))

    def derivatives(self, omega: Array, left: Array, right: Array) -> Array:
        """Of left Y right, with `left` (f, o, p) and `right` (f, p), by all parameters: (f, o, n)."""
        (poles, by_zeta), (psi, G), s = self._poles, self._shapes, 1j * omega[:, None]
        plus, minus = (1 / (s - poles))[:, None], (1 / (s - poles.conj()))[:, None]
        a, a_conj = left @ psi, left @ psi.conj()
        b, b_conj = (right @ psi)[:, None], (right @ psi.conj())[:, None]
        by_pole = [a * b * d * plus**2 + a_conj * b_conj * d.conj() * minus**2 for d in (poles, by_zeta)]

        def by_shape(one: Array, other: Array) -> Array:
            """Of (left shape)(shape' right), these two given, by the entries of the shape."""
            return left[..., None] * other[:, :, None] + one[:, :, None] * right[:, None, :, None]

        ahead, behind = by_shape(a, b) * plus[:, :, None], by_shape(a_conj, b_conj) * minus[:, :, None]
        low = (self.band[0] / omega[:, None, None, None]) ** 2
        rigid = -low * by_shape(left @ G, (right @ G)[:, None])
        j, k = np.triu_indices(self.points)
        pairs = left[..., j] * right[:, None, k] + (j != k) * left[..., k] * right[:, None, j]
        rest = pairs[..., None] * self.remainders(omega)[:, None, None]
        flat = [each.reshape(*left.shape[:2], -1) for each in (ahead + behind, 1j * (ahead - behind), rigid, rest)]
        return np.concatenate([*by_pole, *flat], axis=2)


def synthesise(frequency_Hz: Array, Y: Array, std: Array) -> Synthesis:
    """Fit a synthesis to measured receptances by maximum likelihood.

    Remainders are projected out at each step, as in :mod:`twin.identify.modes.refinement`.  ValueError if there are too
    few lines, or no mode is found.

    Parameters
    ----------
    frequency_Hz : ndarray, (f,)
    Y : ndarray of complex, (f, p, p)
        Symmetric, m/N.
    std : ndarray, (f, p, p)
        Root of the complex variance of each.
    """
    j, k = np.triu_indices(Y.shape[1])
    fit = fit_modes(frequency_Hz, Y[:, j, k], std[:, j, k])
    omega, weight = 2 * np.pi * frequency_Hz, np.sqrt(2) / std
    here = _Projected.at(_beginning(fit, frequency_Hz, std), omega, Y, weight)
    damping = LIMITS.damping
    for _ in range(LIMITS.rounds):
        scale = np.sqrt(np.diag(here.normal))
        damped = here.normal / np.outer(scale, scale) + damping * np.eye(len(scale))
        step = np.linalg.solve(damped, here.gradient / scale) / scale
        ahead = here.synthesis.vector.copy()
        ahead[: len(step)] += step
        trial = _Projected.at(replace(here.synthesis, vector=ahead), omega, Y, weight)
        gain = here.chi2 - trial.chi2
        damping = max(damping / 8, LIMITS.ridge) if gain > 0 else 64 * damping
        here = trial if gain > 0 else here
        if 0 < gain < LIMITS.settled * here.chi2 or damping > 1:
            break
    found = here.synthesis
    information = np.zeros((len(found.vector), len(found.vector)))
    for one, other, _, w in _pairs(found, omega, Y, weight):
        J = w[:, None] * found.derivatives(omega, one, other)[:, 0]
        information += (J.conj().T @ J).real
    information += LIMITS.ridge * np.diag(np.diag(information))
    factor = here.chi2 / max(1, 2 * len(omega) * len(j) - len(found.vector))
    return replace(found, information=information / max(1.0, factor), chi2_per_dof=factor)


def _beginning(fit: ModalFit, frequency_Hz: Array, std: Array) -> Synthesis:
    """Residues and remainders of a fit of all pairs by itself, cut to their ranks."""
    found, points = fit.fit, std.shape[1]
    shapes = []
    for residues in found.residues.T:
        square = _square(residues, points)
        leading = np.linalg.svd(square)[0][:, 0]
        shapes.append(leading * np.sqrt(leading.conj() @ square @ leading.conj()))
    psi = np.array(shapes).T
    size, motion = np.linalg.eigh(-_square(found.remainders[:, 1].real, points))
    low = (frequency_Hz[0] / frequency_Hz[:, None, None]) ** 2
    shown = 2 * np.sum(np.abs(low * motion[:, -1:] * motion[:, -1] * size[-1] / std) ** 2)
    least = LIMITS.rigid * size[-1] if shown > points * np.log(2 * std.size) else np.inf
    G = motion[:, size > least] * np.sqrt(size[size > least])
    empty = Synthesis(np.zeros(0), len(found.omega), G.shape[1], points, found.band, np.zeros((0, 0)))
    return replace(empty, vector=empty.blocks.pack({
        "omega": np.log(found.omega), "zeta": np.log(found.zeta), "psi_re": psi.real.ravel(),
        "psi_im": psi.imag.ravel(), "G": G.ravel(), "rest": 0.0,
    }))  # fmt: skip


def _square(values: Array, points: int) -> Array:
    """Symmetric (p, p, ...) from the values (p (p + 1) / 2, ...) of its pairs j <= k."""
    matrix = np.zeros((points, points, *values.shape[1:]), values.dtype)
    j, k = np.triu_indices(points)
    matrix[j, k] = matrix[k, j] = values
    return matrix


def _pairs(synthesis: Synthesis, omega: Array, Y: Array, weight: Array) -> Iterator[tuple[Array, Array, Array, Array]]:
    """Of each pair of points: the rows (f, 1, p) and (f, p) that choose it, what is left of it, and its weight (f,)."""
    left, unit = Y - synthesis.receptance(omega), np.eye(synthesis.points)
    for j, k in zip(*np.triu_indices(synthesis.points), strict=True):
        one, other = (np.broadcast_to(unit[x], (len(omega), synthesis.points)) for x in (j, k))
        yield one[:, None], other, left[:, j, k], weight[:, j, k]


@dataclass(frozen=True, eq=False)
class _Projected:
    """A synthesis with the remainders at their best, and the normal equations of all else."""

    synthesis: Synthesis
    chi2: float
    normal: Array
    gradient: Array

    @staticmethod
    def at(synthesis: Synthesis, omega: Array, Y: Array, weight: Array) -> _Projected:
        where = synthesis.blocks["rest"]
        n, chi2, rest = where.start, 0.0, []
        normal, gradient = np.zeros((n, n)), np.zeros(n)
        for one, other, left, w in _pairs(synthesis, omega, Y, weight):
            Q, R = np.linalg.qr(_stacked(w[:, None] * synthesis.remainders(omega)))
            J, r = (_stacked(each * w[:, None]) for each in (
                synthesis.derivatives(omega, one, other)[:, 0, :n], left[:, None],
            ))  # fmt: skip
            rest.append(np.linalg.solve(R, Q.T @ r)[:, 0])
            J, r = J - Q @ (Q.T @ J), r - Q @ (Q.T @ r)
            chi2 += float(np.sum(r**2))
            normal += J.T @ J
            gradient += (J.T @ r)[:, 0]
        vector = synthesis.vector.copy()
        vector[where] += np.concatenate(rest)
        return _Projected(replace(synthesis, vector=vector), chi2, normal, gradient)


def _stacked(values: Array) -> Array:
    """Real parts above imaginary parts."""
    return np.vstack([values.real, values.imag])
