"""What excites the rig: a generator of sines without phase jumps, noise and multisines; and the pulse of a hammer."""

import math
from dataclasses import replace

import numpy as np
from scipy.signal import CZT, butter, sosfilt, sosfreqz

from recordings.streams import Excitation
from twin.arrays import Array
from twin.bench.limits import LIMITS


class PeriodicSignal:
    """A multisine of unit rms at equal steps: equally high sines at multiples of one frequency, their phases random.

    It repeats exactly, so that a periodic response has no leakage at all, and what is left between its lines is noise
    and distortion alone.  Schoukens, Vaes and Pintelon, "Linear System Identification in a Nonlinear Setting", IEEE
    Control Systems Magazine 36 (2016) 38-69, on why its phases are random.

    Parameters
    ----------
    period_s
        After which it repeats.
    band_Hz
        Its lines are the multiples of 1/`period_s` in it.
    seed
        Of the phases.
    step_s
        From one value to the next.

    Raises
    ------
    ValueError
        If there is no line in the band, below half of the rate 1/`step_s`.
    """

    def __init__(self, *, period_s: float, band_Hz: tuple[float, float], seed: int, step_s: float) -> None:
        high = min(band_Hz[1], 0.5 / step_s)
        first, last = int(np.ceil(band_Hz[0] * period_s - 1e-9)), int(np.floor(high * period_s + 1e-9))
        self._order = np.arange(max(first, 1), last + 1)
        if len(self._order) == 0:
            raise ValueError(f"a period of {period_s:g} s has no line from {band_Hz[0]:g} to {high:g} Hz")
        phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(self._order))
        self._lines = np.sqrt(2 / len(self._order)) * np.exp(1j * phase)
        self._turn = step_s / period_s
        self._at = 0.0
        self._transform: CZT | None = None

    def samples(self, count: int) -> Array:
        """The next `count` values."""
        if count == 0:
            return np.zeros(0)
        if self._transform is None or self._transform.m != count:
            # Re sum_k c_k exp(2 pi i k (t + n step)/T) over n is a chirp transform of the lines' phasors at time t
            self._transform = CZT(n=len(self._order), m=count, w=np.exp(2j * np.pi * self._turn))
        now = self._lines * np.exp(2j * np.pi * self._order * self._at)
        values = self._transform(now) * np.exp(2j * np.pi * self._order[0] * self._turn * np.arange(count))
        self._at = (self._at + count * self._turn) % 1.0
        return np.asarray(values.real)


def pulse(peak_N: float, width_s: float, step_s: float, *, rebound: bool = False) -> Array:
    """Half sine of a hammer's force at every step; one that rebounds hits again, weaker, while the structure rings."""
    steps = np.arange(math.ceil(width_s / step_s) + 1)
    once = peak_N * np.sin(np.minimum(np.pi * steps * step_s / width_s, np.pi))
    if not rebound:
        return np.asarray(once)
    later = round(LIMITS.rebound_s / step_s)
    both = np.zeros(later + len(once))
    both[: len(once)] += once
    both[later:] += LIMITS.rebound_share * once
    return both


class Generator:
    """Makes the voltage at the bench's internal steps."""

    def __init__(self, step_s: float) -> None:
        self._step_s = step_s
        self._phase = 0.0
        self._excitation = Excitation()
        self._rng = np.random.default_rng(0)
        self._sos: Array | None = None
        self._memory = np.zeros((0, 2))
        self._gain = 0.0
        self._multisine: PeriodicSignal | None = None
        self._pulse = np.zeros(0)

    @property
    def excitation(self) -> Excitation:
        """What it puts out."""
        return self._excitation

    def set(self, excitation: Excitation, *, step_s: float | None = None) -> None:
        """Change the output (and the step) from the next sample on; a sine goes on from the phase it has."""
        same = replace(self._excitation, amplitude_V=excitation.amplitude_V) == excitation
        restart = not same or (step_s is not None and step_s != self._step_s)
        step_s = step_s or self._step_s
        if restart and excitation.kind == "multisine":
            self._multisine = PeriodicSignal(
                period_s=excitation.period_s, band_Hz=excitation.band_Hz, seed=excitation.seed, step_s=step_s
            )
        self._step_s, self._excitation = step_s, excitation
        if restart and excitation.kind == "random":
            self._rng = np.random.default_rng(excitation.seed)
            self._design(excitation.band_Hz)

    def add(self, pulse: Array) -> None:
        """Put a pulse, a value a step, on top of the output from the next sample on."""
        self._pulse = pulse

    def samples(self, count: int) -> Array:
        """The next `count` values, V."""
        out = self._steady(count)
        now, self._pulse = self._pulse[:count], self._pulse[count:]
        out[: len(now)] += now
        return out

    def _steady(self, count: int) -> Array:
        e = self._excitation
        if e.kind == "sine":
            advance = 2 * np.pi * e.frequency_Hz * self._step_s
            phase = self._phase + advance * np.arange(1, count + 1)
            self._phase = float(phase[-1] % (2 * np.pi)) if count else self._phase
            return e.amplitude_V * np.sin(phase)
        if e.kind == "random":
            assert self._sos is not None
            noise, self._memory = sosfilt(self._sos, self._rng.standard_normal(count), zi=self._memory)
            return e.amplitude_V * self._gain * noise
        if e.kind == "multisine":
            assert self._multisine is not None
            return e.amplitude_V * self._multisine.samples(count)
        return np.zeros(count)

    def _design(self, band_Hz: tuple[float, float]) -> None:
        """Fourth-order Butterworth band, scaled so that white noise of unit rms comes out with unit rms."""
        nyquist = 0.5 / self._step_s
        low, high = band_Hz[0] / nyquist, band_Hz[1] / nyquist
        if high < 0.98:
            self._sos = butter(4, [low, high], "bandpass", output="sos")
        else:
            self._sos = butter(4, low, "highpass", output="sos")
        frequency = np.linspace(0, np.pi, 1 << 16)
        _, response = sosfreqz(self._sos, worN=frequency)
        self._gain = 1.0 / float(np.sqrt(np.mean(np.abs(response) ** 2)))
        self._memory = np.zeros((len(self._sos), 2))
