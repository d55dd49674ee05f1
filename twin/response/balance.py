"""Multi-harmonic balance of the rig in its local coordinates, with pseudo-arclength continuation over frequency.

For harmonic k of local coordinate y:  R_k = Y_k - G_yf(j k w) F_k(Y) - G_yu(j k w) U_k, with the transfer functions G
from the poles and F from the alternation between frequency and time.  The unknowns are a handful per harmonic, however
fine the elements; Newton's matrix is exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from twin.bench.build import Built
from twin.bench.linear import to_poles
from twin.response.alternation import alternate, alternate_numpy, fourier_basis

__all__ = ["HarmonicBalance", "PeriodicSolution"]

Matrix = NDArray[np.float64]
Complex = NDArray[np.complex128]

MODEL_RATE_Hz = 51200.0
"""Selects the modes where no rate is asked for: all that the bench ever keeps."""


@dataclass(frozen=True)
class PeriodicSolution:
    """One steady state.

    Attributes
    ----------
    frequency_Hz
        Fundamental.
    unknowns : ndarray, (locals (2 H + 1),)
        Coefficients of the local coordinates, one after the other.
    channels : ndarray, (channels, H + 1)
        Complex harmonics: a channel is the real part of sum channels[k] exp(j k w t).
    iterations
        Newton steps it took.
    """

    frequency_Hz: float
    unknowns: Matrix
    channels: Complex
    iterations: int


class HarmonicBalance:
    """Steady states of a reduced rig under a sine of given amplitude.

    Parameters
    ----------
    built
        From :attr:`twin.bench.Bench.built`.
    harmonics
        H.
    samples
        A period in the alternation.
    internal_rate_Hz
        Of the bench whose modes it shall have.
    kernel
        Compiled, or the plain numpy twin.
    """

    def __init__(
        self,
        built: Built,
        *,
        harmonics: int = 7,
        samples: int = 256,
        internal_rate_Hz: float = MODEL_RATE_Hz,
        kernel: Literal["numba", "numpy"] = "numba",
    ) -> None:
        self._poles = to_poles(built.rig(0.0, internal_rate_Hz))
        self._locals, self._skip = built.locals, built.locals + built.auxiliaries
        self._elements = built.elements()
        self._H = harmonics
        self._n = 2 * harmonics + 1
        self._basis = fourier_basis(harmonics, samples)
        self._alternate = alternate if kernel == "numba" else alternate_numpy

    def solve(
        self, frequency_Hz: float, amplitude: float, *, start: Matrix | None = None, tolerance: float = 1e-9
    ) -> PeriodicSolution:
        """The steady state at one frequency, from a neighbour's unknowns or from the linear response.

        Parameters
        ----------
        amplitude
            Peak of the generator's sine: V, or N where the bench has no shaker.

        Raises
        ------
        ArithmeticError
            If Newton does not converge.
        """
        w = 2 * np.pi * frequency_Hz
        x = self._linear(w, amplitude) if start is None else start.copy()
        residual, J, _ = self._residual(x, w, amplitude)
        for iteration in range(60):
            if np.linalg.norm(residual) <= tolerance * np.linalg.norm(x):
                return self._solution(x, w, amplitude, iteration)
            step = np.linalg.solve(J, residual)
            length = 1.0
            while True:
                trial = x - length * step
                new, J_new, _ = self._residual(trial, w, amplitude)
                if np.linalg.norm(new) < (1 - 0.1 * length) * np.linalg.norm(residual) or length < 0.05:
                    break
                length /= 2
            x, residual, J = trial, new, J_new
        raise ArithmeticError(f"harmonic balance did not converge at {frequency_Hz:.4f} Hz")

    def sweep(self, frequencies_Hz: Sequence[float], amplitude: float) -> list[PeriodicSolution]:
        """Solutions along given frequencies, each from the one before."""
        found: list[PeriodicSolution] = []
        for frequency in frequencies_Hz:
            start = found[-1].unknowns if found else None
            found.append(self.solve(frequency, amplitude, start=start))
        return found

    def branch(
        self, start_Hz: float, stop_Hz: float, amplitude: float, *, step: float = 0.05, most: int = 2000
    ) -> list[PeriodicSolution]:
        """The branch from one frequency to another, through folds, by pseudo-arclength continuation.

        Parameters
        ----------
        start_Hz, stop_Hz
            Ends; the branch may turn between them.
        amplitude
            As in :meth:`solve`.
        step
            Greatest arclength of a step, in relative units of the unknowns and of the span of frequency.
        most
            Points after which it gives up.

        Raises
        ------
        ArithmeticError
            If a step cannot be made small enough, or `most` is reached.
        """
        first = self.solve(start_Hz, amplitude)
        points = [first]
        span = 2 * np.pi * abs(stop_Hz - start_Hz)
        x, w = first.unknowns, 2 * np.pi * start_Hz
        size = float(np.linalg.norm(x))
        heading = np.concatenate([np.zeros(len(x)), [np.sign(stop_Hz - start_Hz)]])
        h = step / 10
        low, high = sorted((2 * np.pi * start_Hz, 2 * np.pi * stop_Hz))
        while len(points) < most:
            _, J, by_w = self._residual(x, w, amplitude)
            system = np.vstack([np.column_stack([J * size, by_w * span]), heading])
            tangent = np.linalg.solve(system, np.concatenate([np.zeros(len(x)), [1.0]]))
            tangent /= np.linalg.norm(tangent)
            corrected = self._correct(x, w, size, span, tangent, h, amplitude)
            if corrected is None:
                h /= 2
                if h < 1e-7 * step:
                    raise ArithmeticError(f"the branch ends at {w / (2 * np.pi):.5f} Hz")
                continue
            x, w, iterations = corrected
            if not low <= w <= high:
                return points
            heading, size = tangent, max(float(np.linalg.norm(x)), 1e-3 * size)
            points.append(self._solution(x, w, amplitude, iterations))
            h = min(step, h * (1.5 if iterations <= 4 else 0.8))
        raise ArithmeticError(f"the branch has more than {most} points")

    def _correct(
        self, x: Matrix, w: float, size: float, span: float, tangent: Matrix, h: float, amplitude: float
    ) -> tuple[Matrix, float, int] | None:
        """Newton onto the branch in the plane across the tangent; None if it does not converge quickly."""
        z = np.concatenate([x / size, [w / span]]) + h * tangent
        target = tangent @ z
        for iteration in range(12):
            residual, J, by_w = self._residual(z[:-1] * size, z[-1] * span, amplitude)
            if np.linalg.norm(residual) < 1e-9 * np.linalg.norm(z[:-1] * size) and iteration:
                return z[:-1] * size, float(z[-1] * span), iteration
            system = np.vstack([np.column_stack([J * size, by_w * span]), tangent])
            z = z - np.linalg.solve(system, np.concatenate([residual, [tangent @ z - target]]))
        return None

    def _transfer(self, w: float, *, derivative: bool = False) -> Complex:
        """(H + 1, outputs, inputs) at the harmonics of w, or its derivative by w."""
        poles = self._poles
        B, C = poles.B, poles.C
        k = 1j * np.arange(self._H + 1)[:, None]
        # y = Re(C w) keeps one pole of each pair; the other half of the pair responds to the same positive frequency.
        plus, minus = k * w - poles.pole, k * w - poles.pole.conj()
        if derivative:
            a, b = -k / plus**2, -k / minus**2
            return 0.5 * (np.einsum("op,kp,pi->koi", C, a, B) + np.einsum("op,kp,pi->koi", C.conj(), b, B.conj()))
        G = 0.5 * (
            np.einsum("op,kp,pi->koi", C, 1 / plus, B) + np.einsum("op,kp,pi->koi", C.conj(), 1 / minus, B.conj())
        )
        return np.asarray(G + poles.D)

    def _forces(self, x: Matrix, w: float) -> tuple[Matrix, Matrix]:
        """Coefficients of the local forces, (locals, n), and their block-diagonal Jacobian, (locals, n, n)."""
        e, n = self._elements, self._n
        F, J = np.zeros((self._locals, n)), np.zeros((self._locals, n, n))
        f, jacobian = np.zeros(n), np.zeros((n, n))
        for i, coordinate in enumerate(e.coordinate):
            c = x[coordinate * n : (coordinate + 1) * n]
            self._alternate(int(e.kind[i]), e.parameters, i, c, self._basis, w, f, jacobian)
            F[coordinate] += e.scale[i] * f
            J[coordinate] += e.scale[i] * jacobian
        return F, J

    def _residual(self, x: Matrix, w: float, amplitude: float) -> tuple[Matrix, Matrix, Matrix]:
        """Residual, its Jacobian by the unknowns and its derivative by w."""
        L, n = self._locals, self._n
        F, dF = self._forces(x, w)
        blocks = [_real_blocks(G[:, :L]) for G in (self._transfer(w), self._transfer(w, derivative=True))]
        drive = np.zeros(n)
        drive[2] = amplitude
        out, J = x.copy(), np.eye(L * n)
        by_w = np.zeros(L * n)
        for a in range(L):
            rows = slice(a * n, (a + 1) * n)
            out[rows] -= blocks[0][a, 0] @ drive
            by_w[rows] -= blocks[1][a, 0] @ drive
            for b in range(L):
                out[rows] -= blocks[0][a, 1 + b] @ F[b]
                by_w[rows] -= blocks[1][a, 1 + b] @ F[b]
                J[rows, b * n : (b + 1) * n] -= blocks[0][a, 1 + b] @ dF[b]
        if (self._elements.auxiliary >= 0).any():
            step = 1e-6 * w
            shifted, _ = self._forces(x, w + step)
            for a in range(L):
                for b in range(L):
                    by_w[a * n : (a + 1) * n] -= blocks[0][a, 1 + b] @ (shifted[b] - F[b]) / step
        return out, J, by_w

    def _linear(self, w: float, amplitude: float) -> Matrix:
        """Unknowns without local forces."""
        drive = np.zeros(self._n)
        drive[2] = amplitude
        blocks = _real_blocks(self._transfer(w)[:, : self._locals, :1])
        return np.concatenate([blocks[a, 0] @ drive for a in range(self._locals)])

    def _solution(self, x: Matrix, w: float, amplitude: float, iterations: int) -> PeriodicSolution:
        F, _ = self._forces(x, w)
        u = np.zeros((self._H + 1, 1 + self._locals), complex)
        u[1, 0] = -1j * amplitude
        u[0, 1:] = F[:, 0]
        u[1:, 1:] = (F[:, 1::2] - 1j * F[:, 2::2]).T
        G = self._transfer(w)[:, self._skip :]
        return PeriodicSolution(w / (2 * np.pi), x, np.einsum("koi,ki->ok", G, u), iterations)


def _real_blocks(G: Complex) -> Matrix:
    """Transfer functions (H + 1, a, b) as real matrices on [constant, cos, sin, ...], (a, b, n, n)."""
    H, a, b = len(G) - 1, G.shape[1], G.shape[2]
    blocks = np.zeros((a, b, 2 * H + 1, 2 * H + 1))
    blocks[..., 0, 0] = G[0].real
    for k in range(1, H + 1):
        i = 2 * k - 1
        blocks[..., i, i] = blocks[..., i + 1, i + 1] = G[k].real
        blocks[..., i, i + 1], blocks[..., i + 1, i] = G[k].imag, -G[k].imag
    return blocks
