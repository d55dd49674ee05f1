"""The force at the beam: sines that are not quite pure and not quite held, and noise that the shaker colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.second_bench.believed import Shaker
from tests.second_bench.mechanics.structure import Modes

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Distortion:
    """Harmonics in the force, from the second: shares of the fundamental, and phases in rad, (h,) each."""

    share: Array
    phase: Array

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Distortion:
        """Of a shaker within its range: tenths of a per cent."""
        return cls(rng.uniform(0.5, 1.5, 2) * (1.5e-3, 1.0e-3), rng.uniform(0, 2 * np.pi, 2))


def sine(amplitude: float, frequency_Hz: float, distortion: Distortion, phase: Array, rate_Hz: float) -> Array:
    """A sine and its harmonics in a march's force, and as a force cell reads them, N, (2, t).

    A march takes forces for linear between samples, which takes sinc^2 off each harmonic: it is given that much more.

    Parameters
    ----------
    amplitude
        Peak, N.
    frequency_Hz, rate_Hz
        Of the sine, and samples a second.
    distortion
        The harmonics.
    phase : ndarray, (t,)
        Of the fundamental, rad.
    """
    shares, phases = [1.0, *distortion.share], [0.0, *distortion.phase]
    waves = [
        amplitude * share * np.sin(order * phase + more)
        for order, (share, more) in enumerate(zip(shares, phases, strict=True), start=1)
    ]
    lost = [np.sinc(order * frequency_Hz / rate_Hz) ** 2 for order in range(1, len(waves) + 1)]
    return np.array([sum(wave / share for wave, share in zip(waves, lost, strict=True)), sum(waves)])


def noise(
    rng: np.random.Generator,
    modes: Modes,
    shaker: Shaker,
    *,
    band_Hz: tuple[float, float],
    rms: float,
    samples: int,
    rate_Hz: float,
) -> Array:
    """Random force in a band, N, as :func:`sine` gives it, (2, t): it drops where the beam yields, as with any shaker.

    A coil's force on the armature, which has a suspension and drives the beam through the stinger, all linear.
    """
    frequency = np.fft.rfftfreq(samples, 1 / rate_Hz)
    inside = (frequency >= band_Hz[0]) & (frequency <= band_Hz[1])
    w = 2 * np.pi * frequency[inside]
    modal = modes.drive**2 / (modes.omega**2 - w[:, None] ** 2 + 2j * modes.damping * modes.omega * w[:, None])
    soft = modal.sum(axis=1) + 1 / shaker.stinger_stiffness
    armature = shaker.suspension_stiffness * (1 + 0.1j) - shaker.armature_mass * w**2
    reaches = 1 / (1 + armature * soft)
    spectrum = np.zeros(len(frequency), complex)
    spectrum[inside] = reaches * (rng.normal(size=len(w)) + 1j * rng.normal(size=len(w)))
    read = np.fft.irfft(spectrum, samples)
    scale = rms / read.std()
    marched = np.fft.irfft(spectrum / np.sinc(frequency / rate_Hz) ** 2, samples)
    return np.array([marched, read]) * scale
