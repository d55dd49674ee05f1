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
    rate = run.device_of(channel).sample_rate_Hz
    x, u = (run.between(name, stretch.start_ns, stretch.stop_ns).astype(float) for name in (channel, force))
    count = min(len(x), len(u))
    line = round(frequency_Hz * count / rate)
    alike = run.device_of(force).sample_rate_Hz == rate
    if (
        not alike
        or not LIMITS.hum_around < line < count / 2 - LIMITS.hum_around
        or not np.isfinite(x[:count] + u[:count]).all()
    ):
        return None
    away = np.arange(-LIMITS.hum_around, LIMITS.hum_around + 1)
    window = np.hanning(count + 1)[:-1]
    steady = np.exp(2j * np.pi * frequency_Hz / rate * np.arange(count))
    Y, U, W = (np.fft.fft(window * signal)[line + away] for signal in (x[:count], u[:count], steady))
    bend = (away / LIMITS.hum_around)[:, None] ** np.arange(3)
    basis = np.hstack([bend * U[:, None], bend[:, :2]])
    beside = np.abs(away) > LIMITS.hum_lobe
    left = Y - basis @ np.linalg.lstsq(basis[beside], Y[beside], rcond=None)[0]
    noise = np.sum(np.abs(left[beside]) ** 2) / (beside.sum() - basis.shape[1])
    inside = ~beside
    power = np.sum(np.abs(W[inside]) ** 2)
    amplitude = 2 * np.abs(np.conj(W[inside]) @ left[inside]) / power
    return float(amplitude), float(2 * np.sqrt(noise / power / 2))
