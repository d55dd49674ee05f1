"""The signal generator: sine without phase jumps, band-limited Gaussian noise, a multisine, or nothing."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt, sosfreqz

from recordings.streams import Excitation
from twin.bench.multisine import PeriodicSignal


class Generator:
    """Makes the voltage at the bench's internal steps."""

    def __init__(self, step_s: float) -> None:
        self._step_s = step_s
        self._phase = 0.0
        self._excitation = Excitation()
        self._rng = np.random.default_rng(0)
        self._sos: NDArray[np.float64] | None = None
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

    def add(self, pulse: NDArray[np.float64]) -> None:
        """Put a pulse, a value a step, on top of the output from the next sample on."""
        self._pulse = pulse

    def samples(self, count: int) -> NDArray[np.float64]:
        """The next `count` values, V."""
        out = self._steady(count)
        now, self._pulse = self._pulse[:count], self._pulse[count:]
        out[: len(now)] += now
        return out

    def _steady(self, count: int) -> NDArray[np.float64]:
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
