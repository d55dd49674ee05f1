"""Harmonic balance of Jenkins elements written by hand in numpy: all places at once, LAPACK for Newton's system.

The unknowns are those of :class:`twin.response.HarmonicBalance`; time and frequency alternate over all places together,
with the slopes of each slider by the coefficients carried along the path.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from benchmarks.rig_of_places import RigOfPlaces
from twin.bench.linear import Poles

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class BalanceByHand:
    """Steady states of a rig of sliders along a list of frequencies, each found from the one before."""

    rig: RigOfPlaces
    harmonics: int
    samples: int
    tolerance: float = 1e-9

    @cached_property
    def _poles(self) -> Poles:
        return self.rig.poles(0.0, 0.0)

    def sweep(self, frequencies_Hz: Array, amplitude: float) -> Complex:
        """First harmonic of what is shown at each frequency, (count,)."""
        places, n = self.rig.places, 2 * self.harmonics + 1
        stiffness, slip = self.rig.law.parameters[1:3]
        t = 2 * np.pi * np.arange(self.samples) / self.samples
        k = np.arange(1, self.harmonics + 1)
        waves = np.empty((n, self.samples))
        waves[0], waves[1::2], waves[2::2] = 1.0, np.cos(np.outer(k, t)), np.sin(np.outer(k, t))
        weight = np.full((n, 1), 2.0 / self.samples)
        weight[0] /= 2.0
        back = weight * waves
        x, found = np.zeros((places, n)), []
        for frequency in frequencies_Hz:
            G = self._transfer(frequency)
            own = np.zeros((places, n))
            own[:, 1], own[:, 2] = amplitude * G[1, :places, 0].imag, amplitude * G[1, :places, 0].real
            x = own.copy() if not x.any() else x
            for _ in range(50):
                force, slopes = _sliders(x @ waves, waves, stiffness, slip)
                F, dF = force @ back.T, np.einsum("it,pjt->pij", back, slopes, optimize=True)
                residual = x - own - _through(G[:, :places, 1:], F[:, :, None])[..., 0]
                J = -_blocks(G[:, :places, 1:], dF)
                J[np.arange(places * n), np.arange(places * n)] += 1.0
                step = np.linalg.solve(J, residual.ravel()).reshape(places, n)
                x = x - step
                if np.linalg.norm(step) < self.tolerance * np.linalg.norm(x):
                    break
            force, _ = _sliders(x @ waves, waves, stiffness, slip)
            F = force @ back.T
            first = F[:, 1] - 1j * F[:, 2]
            found.append(G[1, places, 0] * -1j * amplitude + G[1, places, 1:] @ first)
        return np.array(found)

    def _transfer(self, frequency_Hz: float) -> Complex:
        """Frequency responses at the harmonics, (H + 1, places + 1, 1 + places)."""
        poles = self._poles
        s = 2j * np.pi * frequency_Hz * np.arange(self.harmonics + 1)[:, None]
        one, other = 1.0 / (s - poles.pole), 1.0 / (s - poles.pole.conj())
        plus = (poles.C * one[:, None]) @ poles.B
        return np.asarray(0.5 * (plus + (poles.C.conj() * other[:, None]) @ poles.B.conj()) + poles.D)


def _sliders(e: Array, waves: Array, stiffness: float, slip: float) -> tuple[Array, Array]:
    """Force (places, samples) in the second of two periods, and its slopes by the coefficients (places, n, samples)."""
    places, samples = e.shape
    held, slope = np.zeros(places), np.zeros((places, len(waves)))
    force, slopes = np.empty(e.shape), np.empty((places, len(waves), samples))
    for step in range(2 * samples):
        t = step % samples
        before = e[:, t - 1] if step else 0.0
        trial = held + stiffness * (e[:, t] - before)
        slope = slope + stiffness * (waves[:, t] - (waves[:, t - 1] if step else 0.0))
        held = np.clip(trial, -slip, slip)
        slope[np.abs(trial) > slip] = 0.0
        force[:, t], slopes[:, :, t] = held, slope
    return force, slopes


def _through(G: Complex, F: Array) -> Array:
    """Coefficients (places, n, m) of the motion that forces of such coefficients make."""
    out = np.empty_like(F)
    out[:, 0] = np.tensordot(G[0].real, F[:, 0], 1)
    a, b = F[:, 1::2].transpose(1, 0, 2), F[:, 2::2].transpose(1, 0, 2)
    re, im = np.ascontiguousarray(G[1:].real), np.ascontiguousarray(G[1:].imag)
    out[:, 1::2] = (re @ a + im @ b).transpose(1, 0, 2)
    out[:, 2::2] = (re @ b - im @ a).transpose(1, 0, 2)
    return out


def _blocks(G: Complex, dF: Array) -> Array:
    """The same for each place's slopes dF (places, n, n) by its own unknowns, as one matrix."""
    places, n = dF.shape[:2]
    out = np.empty((places, n, places, n))
    out[:, 0] = G[0].real[..., None] * dF[:, 0]
    re, im = G[1:].real.transpose(1, 0, 2)[..., None], G[1:].imag.transpose(1, 0, 2)[..., None]
    a, b = dF[:, 1::2].transpose(1, 0, 2), dF[:, 2::2].transpose(1, 0, 2)
    out[:, 1::2] = re * a + im * b
    out[:, 2::2] = re * b - im * a
    return out.reshape(places * n, places * n)
