"""Multi-harmonic balance of the rig in its local coordinates, with pseudo-arclength continuation over frequency.

The unknowns are a handful per harmonic, however fine the elements (see :mod:`twin.response.system`); Newton's matrix is
exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from twin.bench.build import Built
from twin.response import kernel as compiled
from twin.response import kernel_numpy as plain
from twin.response.stability import floquet_multipliers
from twin.response.system import system_of, transfer

__all__ = ["HarmonicBalance", "PeriodicSolution"]

Matrix = NDArray[np.float64]
Complex = NDArray[np.complex128]

MODEL_RATE_Hz = 51200.0
"""Selects the modes where no rate is asked for: all that the bench ever keeps."""
INTERNAL_RATE_Hz = 11264.0
"""Of the march whose stability is asked for: the bench's own."""
TOLERANCE = 1e-9
"""Residual over the size of the unknowns."""
NEUTRAL = 1e-4
"""What a multiplier may exceed one by and count as one: a hundredth of what light damping takes off in a period."""
MOST_ITERATIONS, MOST_CORRECTIONS = 60, 12


@dataclass(frozen=True)
class PeriodicSolution:
    """One steady state.

    Attributes
    ----------
    frequency_Hz
        Fundamental.
    unknowns : ndarray, (locals (2 H + 1),)
        Coefficients of the local coordinates, one after the other.
    inputs : ndarray, (1 + locals, H + 1)
        Complex harmonics of the generator's output and of the local restoring forces.
    channels : ndarray, (channels, H + 1)
        Complex harmonics: a channel is the real part of sum channels[k] exp(j k w t).
    iterations
        Newton steps it took.
    """

    frequency_Hz: float
    unknowns: Matrix
    inputs: Complex
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
        self._poles = built.poles(0.0, internal_rate_Hz)
        self._elements = built.elements()
        self._locals = built.locals
        self._channels = slice(built.locals + built.auxiliaries, None)
        self._H, self._n = harmonics, 2 * harmonics + 1
        self._system = system_of(built, self._poles, harmonics=harmonics, samples=samples)
        self._kernel: Any = compiled if kernel == "numba" else plain

    def solve(
        self, frequency_Hz: float, amplitude: float, *, start: Matrix | None = None, tolerance: float = TOLERANCE
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
        F = np.empty((self._locals, self._n))
        iterations = self._kernel.newton(self._system, x, w, amplitude, tolerance, MOST_ITERATIONS, F)
        if iterations < 0:
            raise ArithmeticError(f"harmonic balance did not converge at {frequency_Hz:.4f} Hz")
        return self._solutions(x[None], np.array([w]), F[None], [iterations], amplitude)[0]

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
        X, W, F = np.empty((most, len(first.unknowns))), np.empty(most), np.empty((most, self._locals, self._n))
        iterations = np.empty(most, np.int64)
        count = self._kernel.follow(
            self._system, first.unknowns, 2 * np.pi * start_Hz, 2 * np.pi * stop_Hz, amplitude, step,
            TOLERANCE, MOST_CORRECTIONS, X, W, F, iterations,
        )  # fmt: skip
        if count < 0:
            end_Hz = W[-count - 2] / (2 * np.pi) if count < -1 else start_Hz
            raise ArithmeticError(f"the branch ends at {end_Hz:.5f} Hz")
        if count + 1 >= most:
            raise ArithmeticError(f"the branch has more than {most} points")
        return [first, *self._solutions(X[:count], W[:count], F[:count], iterations[:count], amplitude)]

    def multipliers(self, solution: PeriodicSolution, *, rate_Hz: float = INTERNAL_RATE_Hz) -> Complex:
        """Floquet multipliers of a steady state on the bench, largest first.

        Parameters
        ----------
        solution
            From this object.
        rate_Hz
            Steps a second of the march, at least.
        """
        rows, H = slice(0, self._channels.start), self._H
        w = np.array([2 * np.pi * solution.frequency_Hz])
        outputs = np.einsum("koi,ik->ok", transfer(self._poles, rows, w, H)[0], solution.inputs)
        return floquet_multipliers(
            self._poles, self._elements, locals_=self._locals, frequency_Hz=solution.frequency_Hz, rate_Hz=rate_Hz,
            outputs=outputs, inputs=solution.inputs,
        )  # fmt: skip

    def stable(self, solution: PeriodicSolution) -> bool:
        """Whether the bench stays on a steady state: no multiplier exceeds one.

        A slider that never slips keeps its force for ever, which is a multiplier of one and no instability.
        """
        return bool(abs(self.multipliers(solution)[0]) < 1.0 + NEUTRAL)

    def _linear(self, w: float, amplitude: float) -> Matrix:
        """Unknowns without local forces."""
        G = transfer(self._poles, slice(0, self._locals), np.array([w]), 1)[0, 1, :, 0]
        x = np.zeros((self._locals, self._n))
        x[:, 1], x[:, 2] = G.imag * amplitude, G.real * amplitude
        return x.ravel()

    def _solutions(
        self, X: Matrix, W: Matrix, F: Matrix, iterations: Sequence[int] | NDArray[np.int64], amplitude: float
    ) -> list[PeriodicSolution]:
        """All that goes with unknowns (m, N), frequencies (m,) in rad/s and forces (m, locals, n)."""
        if not len(W):
            return []
        u = np.zeros((len(W), 1 + self._locals, self._H + 1), complex)
        u[:, 0, 1] = -1j * amplitude
        u[:, 1:, 0] = F[:, :, 0]
        u[:, 1:, 1:] = F[:, :, 1::2] - 1j * F[:, :, 2::2]
        G = transfer(self._poles, self._channels, W, self._H)
        channels = np.matmul(G, u.transpose(0, 2, 1)[..., None])[..., 0].transpose(0, 2, 1)
        return [
            PeriodicSolution(float(w) / (2 * np.pi), x, inputs, values, int(count))
            for w, x, inputs, values, count in zip(W, X, u, channels, iterations, strict=True)
        ]
