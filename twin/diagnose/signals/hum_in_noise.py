"""A steady line in a broadband run: what of a channel does not follow the force at one frequency alone."""

import numpy as np

from recordings.run import Run
from recordings.sweeps import Stretch
from twin.diagnose.signals.limits import LIMITS


def line_in_noise(run: Run, stretch: Stretch, channel: str, frequency_Hz: float) -> tuple[float, float] | None:
    """Amplitude of a steady line, and its standard deviation for each of its two parts; None where it cannot be seen.

    About the line the response is a bent curve times the force's spectrum; what is left there is compared with what is
    left beside it.
    """
    force = stretch.step.target_channel
    if channel == force or not {channel, force} <= set(run.channels):
        return None
    devices = [run.device_of(name) for name in (channel, force)]
    begun = [device.position_at(stretch.start_ns) for device in devices]
    count = min(device.position_at(stretch.stop_ns) - at for device, at in zip(devices, begun, strict=True))
    rate = devices[0].sample_rate_Hz
    line = round(frequency_Hz * count / rate)
    alike = devices[1].sample_rate_Hz == rate
    if not alike or not LIMITS.hum_around < line < count / 2 - LIMITS.hum_around:
        return None
    away = np.arange(-LIMITS.hum_around, LIMITS.hum_around + 1)
    turn = -2j * np.pi * (line + away) / count
    turns = np.exp(np.arange(LIMITS.remainder_rows)[:, None] * turn)
    sums = np.zeros((3, len(away)), complex)
    for first in range(0, count, LIMITS.remainder_rows):
        n = np.arange(first, min(first + LIMITS.remainder_rows, count))
        taken = [
            device.values[name][at + first : at + first + len(n)]
            for device, name, at in zip(devices, (channel, force), begun, strict=True)
        ]
        windowed = (0.5 - 0.5 * np.cos(2 * np.pi * n / count)) * [*taken, np.exp(2j * np.pi * frequency_Hz / rate * n)]
        sums += np.exp(first * turn) * (windowed @ turns[: len(n)])
    if not np.isfinite(sums).all():
        return None
    Y, U, W = sums
    bend = (away / LIMITS.hum_around)[:, None] ** np.arange(3)
    basis = np.hstack([bend * U[:, None], bend[:, :2]])
    beside = np.abs(away) > LIMITS.hum_lobe
    left = Y - basis @ np.linalg.lstsq(basis[beside], Y[beside], rcond=None)[0]
    noise = np.sum(np.abs(left[beside]) ** 2) / (beside.sum() - basis.shape[1])
    inside = ~beside
    power = np.sum(np.abs(W[inside]) ** 2)
    amplitude = 2 * np.abs(np.conj(W[inside]) @ left[inside]) / power
    return float(amplitude), float(2 * np.sqrt(noise / power / 2))
