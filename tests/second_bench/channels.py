"""From forces and accelerations to samples: coupling, delay, gain, noise, the converter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter, lfilter_zi

from recordings import Channel
from tests.second_bench.believed import BITS, TRANSDUCERS, HIGH_PASS_Hz, Transducer

Array = NDArray[np.float64]

DEVICE = "daq"
TAPS = 10
"""Of the interpolation that delays a channel by parts of a sample: right to 1e-5 at 1 kHz and 20 samples a period."""


@dataclass(frozen=True, kw_only=True)
class Wiring:
    """What a channel does to its signal; SI.

    Attributes
    ----------
    gain
        Factor.
    delay_s
        s.
    corner_Hz
        Of its high-pass.
    noise_density
        White, per square root of hertz.
    low_share, low_Hz
        Noise beside it that dies out above a frequency, over the white one's density.
    hum
        (Hz, amplitude, phase in rad).
    """

    gain: float
    delay_s: float = 0.0
    corner_Hz: float
    noise_density: float
    low_share: float
    low_Hz: float
    hum: tuple[tuple[float, float, float], ...] = ()

    @classmethod
    def drawn(cls, rng: np.random.Generator, transducer: Transducer) -> Wiring:
        """As good as calibrations and data sheets are."""
        return cls(
            gain=1 + rng.normal(0, 1e-4),
            corner_Hz=HIGH_PASS_Hz * (1 + rng.normal(0, 3e-3)),
            noise_density=transducer.noise_density * rng.uniform(0.6, 1.3),
            low_share=rng.uniform(0.5, 3.0),
            low_Hz=rng.uniform(2.0, 15.0),
        )


def announced(transducers: tuple[Transducer, ...] = TRANSDUCERS) -> list[Channel]:
    """The channels as a recording names them."""
    return [
        Channel(
            name=t.channel, quantity=t.quantity, unit=t.unit, position_m=t.position, range=t.range, device=DEVICE
        )
        for t in transducers
    ]  # fmt: skip


class Reading:
    """One channel while it is read, block by block: its filters remember."""

    def __init__(
        self, transducer: Transducer, wiring: Wiring, *, rate_Hz: float, keep_each: int, rng: np.random.Generator
    ) -> None:
        self.transducer, self.wiring, self.rate_Hz, self.keep_each, self.rng = (
            transducer, wiring, rate_Hz, keep_each, rng,
        )  # fmt: skip
        corner = np.tan(np.pi * wiring.corner_Hz / rate_Hz)
        self._coupling = (np.array([1.0, -1.0]) / (1 + corner), np.array([1.0, -(1 - corner) / (1 + corner)]))
        self._coupling_state = np.zeros(1)
        self._taps = _delaying(wiring.delay_s * rate_Hz)
        self._delay_state = np.zeros(len(self._taps) - 1)
        low = np.exp(-2 * np.pi * wiring.low_Hz * keep_each / rate_Hz)
        self._low = (np.array([1 - low]), np.array([1.0, -low]))
        self._low_state = lfilter_zi(*self._low) * 0.0
        self._time_s = 0.0

    def read(self, signal: Array, *, stored: bool) -> tuple[NDArray[np.float32], int]:
        """Samples of a block of the signal, none where it is not stored, and how many sit on the converter's limit."""
        signal, self._coupling_state = lfilter(*self._coupling, signal, zi=self._coupling_state)
        signal, self._delay_state = lfilter(self._taps, [1.0], signal, zi=self._delay_state)
        times = self._time_s + np.arange(0, len(signal), self.keep_each) / self.rate_Hz
        self._time_s += len(signal) / self.rate_Hz
        if not stored:
            return np.zeros(0, np.float32), 0
        w = self.wiring
        values = w.gain * signal[:: self.keep_each]
        white = self.rng.normal(size=len(values))
        low, self._low_state = lfilter(*self._low, self.rng.normal(size=len(values)), zi=self._low_state)
        values = values + w.noise_density * np.sqrt(self.rate_Hz / self.keep_each / 2) * (white + w.low_share * low)
        for frequency, amplitude, phase in w.hum:
            values += amplitude * np.sin(2 * np.pi * frequency * times + phase)
        limit = self.transducer.range
        step = 2 * limit / 2**BITS
        return np.clip(np.rint(values / step) * step, -limit, limit).astype(np.float32), int(
            np.count_nonzero(np.abs(values) >= limit)
        )


def _delaying(samples: float) -> Array:
    """Taps that delay by a number of samples (Lagrange), beside half of `TAPS` that every channel is late."""
    whole = int(np.floor(samples))
    late = TAPS // 2 + samples - whole
    order = np.arange(TAPS)
    taps = [
        np.prod([(late - other) / (tap - other) for other in order if other != tap]) for tap in order
    ]  # fmt: skip
    return np.concatenate([np.zeros(whole), taps])
