"""From a true quantity to numbers on the wire: one channel's signal path, in the order in which signals pass it.

Transducer (gain, polarity, cross-talk, hum) -> high-passes -> amplifier limit -> noise -> quantiser of limited range.
The transducer's own resonance is a pole of the linear rig, and its delay a shift of the decimation filter.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from recordings.quantities import quantity
from recordings.run import Channel
from twin.arrays import Array
from twin.joint.kernel import COMPILED
from twin.rigs import Transducer


@dataclass
class InstrumentChannel:
    """One channel as it is, which need not be as its data sheet says.

    `channel` is what a recording says of it, `reads` the quantity of the rig that it shows;
    `corners_Hz` are first-order high-passes; `cross_talk` adds a factor times another channel's true quantity;
    `transverse` is the share of the surface's motion along the beam; `hum` is (Hz, amplitude);
    `freezes_per_s` and `freeze_s` make stretches in which the last value is repeated.
    """

    channel: Channel
    reads: str
    range: float
    noise_density: float = 0.0
    bits: int = 24
    corners_Hz: list[float] = field(default_factory=list)
    gain: float = 1.0
    delay_s: float = 0.0
    limit: float = np.inf
    step: float = 0.0
    cross_talk: list[tuple[str, float]] = field(default_factory=list)
    hum: list[tuple[float, float]] = field(default_factory=list)
    resonances: list[tuple[float, float]] = field(default_factory=list)
    transverse: float = 0.0
    freezes_per_s: float = 0.0
    freeze_s: float = 0.0

    @classmethod
    def of(cls, sensor: Transducer, bits: int, *, position_m: float | None, direction: str) -> InstrumentChannel:
        """A channel as the rig file describes it."""
        channel = Channel(
            name=sensor.channel, quantity=sensor.quantity, unit=quantity(sensor.quantity).unit, position_m=position_m,
            range=sensor.range, direction=direction,
        )  # fmt: skip
        corners = [sensor.high_pass] if sensor.high_pass > 0 else []
        resonances = [(sensor.mounting_frequency, sensor.mounting_damping)] if sensor.mounting_frequency else []
        return cls(
            channel, sensor.quantity, sensor.range, sensor.noise_density, bits, corners,
            resonances=resonances, transverse=sensor.transverse_sensitivity,
        )  # fmt: skip

    @property
    def quantum(self) -> float:
        """Least significant bit, in the channel's unit."""
        return self.range / 2.0 ** (self.bits - 1)


def high_pass_coefficients(corner_Hz: float, sample_rate_Hz: float) -> tuple[float, float]:
    """(pole, gain) of y = pole y1 + gain (x - x1), the bilinear image of s/(s + w) warped to the corner."""
    k = np.tan(np.pi * min(corner_Hz / sample_rate_Hz, 0.49))
    return float((1 - k) / (1 + k)), float(1 / (1 + k))


class Conversion(NamedTuple):
    """Amplifier's limit, coarse quantiser (zero: none), the converter's bit (zero: none) and range."""

    limit: float
    step: float
    quantum: float
    full_scale: float


@COMPILED
def convert(
    signal: Array, noise: Array, sigma: float, high_passes: Array, memory: Array, conversion: Conversion
) -> tuple[Array, int]:
    """High-pass, limit, add noise, quantise and clip one channel; told is also how many samples sit on the limit.

    Parameters
    ----------
    signal, noise : ndarray, (count,)
        True signal, and normal deviates of standard deviation one.
    high_passes, memory : ndarray, (n, 2)
        Pole and gain of each in series; its last input and output, which move on in place.
    """
    limit, step, quantum, full_scale = conversion
    out = np.empty(signal.shape[0], np.float32)
    overload = 0
    top = full_scale - quantum
    bits = 1.0 / quantum if quantum > 0.0 else 0.0
    filters = high_passes.shape[0]
    # The first high-pass, which nearly every channel has, keeps its memory in registers.
    pole, gain, x1, y1 = 0.0, 1.0, 0.0, 0.0
    if filters > 0:
        pole, gain, x1, y1 = high_passes[0, 0], high_passes[0, 1], memory[0, 0], memory[0, 1]
    for n in range(signal.shape[0]):
        x = signal[n]
        if filters > 0:
            y1 = pole * y1 + gain * (x - x1)
            x1 = x
            x = y1
            for i in range(1, filters):
                value = high_passes[i, 0] * memory[i, 1] + high_passes[i, 1] * (x - memory[i, 0])
                memory[i, 0] = x
                memory[i, 1] = value
                x = value
        x = min(max(x, -limit), limit) + sigma * noise[n]
        if step > 0.0:
            x = np.rint(x / step) * step
        if quantum > 0.0:
            x = np.rint(x * bits) * quantum
        if x >= top or x <= -full_scale:
            x = top if x > 0.0 else -full_scale
            overload += 1
        out[n] = x
    if filters > 0:
        memory[0, 0], memory[0, 1] = x1, y1
    return out, overload
