"""A rig small enough to be right by inspection: one mass on a spring (linear or Duffing) behind a shaker.

    m x'' + c x' + k x + k3 x^3 = F,    F = force_per_volt V - back_emf x'

marched by the classical Runge-Kutta scheme, whose numerical damping at 80 samples a period is 1e-9 of the physical.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numba
import numpy as np

from recordings.run import Channel, SampleBlock
from recordings.streams import Excitation


@numba.njit(cache=True)
def _march(state, count, h, m, c, k, k3, kf, cb, amplitude, omega, phase, noise, force, acc):
    x, v = state[0], state[1]
    for i in range(count):
        t = i * h
        drive = amplitude * np.sin(phase + omega * t) + noise[i, 0]
        mid = amplitude * np.sin(phase + omega * (t + 0.5 * h)) + noise[i, 1]
        end = amplitude * np.sin(phase + omega * (t + h)) + noise[i, 2]
        f = kf * drive - cb * v
        a1 = (f - c * v - k * x - k3 * x**3) / m
        force[i], acc[i] = f, a1
        x2, v2 = x + 0.5 * h * v, v + 0.5 * h * a1
        a2 = (kf * mid - (cb + c) * v2 - k * x2 - k3 * x2**3) / m
        x3, v3 = x + 0.5 * h * v2, v + 0.5 * h * a2
        a3 = (kf * mid - (cb + c) * v3 - k * x3 - k3 * x3**3) / m
        x4, v4 = x + h * v3, v + h * a3
        a4 = (kf * end - (cb + c) * v4 - k * x4 - k3 * x4**3) / m
        x += h / 6 * (v + 2 * v2 + 2 * v3 + v4)
        v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    state[0], state[1] = x, v


@dataclass
class Resonator:
    """A SampleSource with the channels ``force`` and ``acc`` of one device."""

    frequency_Hz: float = 26.5
    damping_ratio: float = 0.0023
    mass_kg: float = 5.0
    cubic: float = 0.0
    force_per_volt: float = 4.0
    back_emf_ratio: float = 0.1  # back_emf over c: by how much of itself the force drops at resonance
    noise: float = 1e-4
    acc_noise: float = 1e-4
    force_range: float = 50.0
    acc_range: float = 490.0
    bits: int = 24
    seed: int = 3
    sample_rate_Hz: float = 2048.0
    device: str = "daq"
    voltage_limit_V: float = 1e9
    frozen_after: int | None = None
    _excitation: Excitation = field(default_factory=Excitation)
    _state: np.ndarray = field(default_factory=lambda: np.zeros(2))
    _phase: float = 0.0
    _index: int = 0

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)
        self._m = self.mass_kg
        self._k = self._m * (2 * np.pi * self.frequency_Hz) ** 2
        self._c = 2 * self.damping_ratio * np.sqrt(self._k * self._m)
        self._cb = self.back_emf_ratio * self._c

    @property
    def channels(self) -> list[Channel]:
        return [
            Channel(name="force", quantity="force", unit="N", range=self.force_range, device=self.device),
            Channel(name="acc", quantity="acceleration", unit="m/s^2", range=self.acc_range, device=self.device),
        ]

    @property
    def spring(self) -> float:
        return self._k

    def receptance(self, frequency_Hz):
        """Displacement over force of the linear resonator: the exact answer."""
        w = 2 * np.pi * np.asarray(frequency_Hz)
        return 1.0 / (self._k - self._m * w**2 + 1j * w * self._c)

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        self.sample_rate_Hz = sample_rate_Hz
        return sample_rate_Hz

    def set_output(self, excitation: Excitation) -> None:
        self._excitation = excitation

    def _multisine(self, out: Excitation) -> np.ndarray:
        """One period at half steps, from its spectrum."""
        count = round(2 * out.period_s * self.sample_rate_Hz)
        first, last = np.ceil(out.band_Hz[0] * out.period_s), np.floor(out.band_Hz[1] * out.period_s)
        spectrum = np.zeros(count // 2 + 1, complex)
        lines = spectrum[int(first) : int(last) + 1]
        lines[:] = np.exp(2j * np.pi * np.random.default_rng(out.seed).random(len(lines)))
        values = np.fft.irfft(spectrum, count)
        return values / values.std()

    def read(self, count: int) -> SampleBlock:
        if self.frozen_after is not None and self._index >= self.frozen_after:
            count = 0
        h = 1.0 / self.sample_rate_Hz
        out = self._excitation
        amplitude = min(out.amplitude_V, self.voltage_limit_V) if out.kind == "sine" else 0.0
        noise = np.zeros((count, 3))  # at the beginning, in the middle and at the end of each step
        if out.kind == "random":
            noise[:] = self._rng.normal(size=(count, 1)) * out.amplitude_V
        elif out.kind == "multisine":
            half_steps = 2 * np.arange(self._index, self._index + count)[:, None] + [0, 1, 2]
            values = self._multisine(out)
            noise = out.amplitude_V * values[half_steps % len(values)]
        omega = 2 * np.pi * out.frequency_Hz if out.kind == "sine" else 0.0
        force, acc = np.empty(count), np.empty(count)
        _march(
            self._state, count, h, self._m, self._c, self._k, self.cubic, self.force_per_volt, self._cb,
            amplitude, omega, self._phase, noise, force, acc,
        )  # fmt: skip
        self._phase = (self._phase + omega * h * count) % (2 * np.pi)
        samples, overload = {}, {}
        for name, values, limit, noise_rms in (
            ("force", force, self.force_range, self.noise),
            ("acc", acc, self.acc_range, self.acc_noise),
        ):
            noisy = values + noise_rms * self._rng.normal(size=count)
            step = 2 * limit / 2**self.bits
            samples[name] = np.clip(np.round(noisy / step) * step, -limit, limit).astype(np.float32)
            overload[name] = int((np.abs(noisy) >= limit).sum())
        block = SampleBlock(
            device=self.device,
            time_ns=round(self._index / self.sample_rate_Hz * 1e9),
            first_index=self._index,
            sample_rate_Hz=self.sample_rate_Hz,
            samples=samples,
            overload=overload,
        )
        self._index += count
        return block


@dataclass
class ListSink:
    """Keeps what would be written."""

    blocks: list = field(default_factory=list)
    steps: list = field(default_factory=list)
    events: list = field(default_factory=list)
    indicators: list = field(default_factory=list)

    def write_block(self, block) -> None:
        self.blocks.append(block)

    def write_step(self, step) -> None:
        self.steps.append(step)

    def write_event(self, event) -> None:
        self.events.append(event)

    def write_indicator(self, indicator) -> None:
        self.indicators.append(indicator)
