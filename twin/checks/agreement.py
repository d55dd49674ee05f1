"""How a run's responses compare with the rig's linear model: their level, their direction, their shape."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from recordings.run import Run
from twin.arrays import Array
from twin.checks.expected import ExpectedResponse
from twin.checks.responses import NoiseResponse, SineResponse, noise_responses, sine_responses
from twin.checks.thresholds import TURNED, UNRELATED

LEAST_LINES, LEAST_STEPS = 16, 4
"""Lines of noise, or steps of a sweep, that are enough to compare."""
NARROW = 1.2
"""Ratio of the highest to the lowest frequency of a sweep about one resonance."""


@dataclass(frozen=True, kw_only=True)
class RunBesideModel:
    """What a run shows, and what the rig's linear model says that it should."""

    run: Run
    force: str
    channels: tuple[str, ...]
    noise: list[NoiseResponse]
    sines: list[SineResponse]
    expected: ExpectedResponse

    @classmethod
    def of(cls, run: Run, expected: ExpectedResponse, *, force: str, channels: tuple[str, ...]) -> "RunBesideModel":
        """A run with responses (o,) to the force, in the order of the model's outputs."""
        noise = noise_responses(run, force=force, channels=channels)
        sines = sine_responses(run, force=force, channels=channels)
        return cls(run=run, force=force, channels=channels, noise=noise, sines=sines, expected=expected)


@dataclass(frozen=True)
class Agreement:
    """One run's channels beside the model's."""

    level: Array
    """Measured over expected response per force, positive, (o,)."""
    turned: Array
    """Whether a channel moves the other way, (o,)."""
    shape: Array
    """Interquartile range of log response over the model's along the frequency, (o,): 0 for the model's shape."""


def agreement_of(
    noise: Sequence[NoiseResponse], sines: Sequence[SineResponse], expected: ExpectedResponse
) -> Agreement | None:
    """The median over a run's stretches of noise and its sweeps; None where it has too few lines and steps."""
    parts = [_of_noise(one, expected) for one in noise] + [_of_sines(one, expected) for one in sines]
    kept = [part for part in parts if part is not None]
    if not kept:
        return None
    ratio, shape = (np.array([part[i] for part in kept]) for i in (0, 1))
    level = np.exp(np.median(np.log(np.abs(ratio)), axis=0))
    return Agreement(level, np.median(np.sign(ratio), axis=0) < 0, np.median(shape, axis=0))


def clear_lines(noise: NoiseResponse, expected: ExpectedResponse) -> Array:
    """Lines (f,) of a noise that show a response where the model has all its modes."""
    told = (noise.coherence.min(axis=1) > UNRELATED) & (noise.frequency_Hz < expected.reach_Hz)
    return np.asarray(told & np.all(noise.H != 0, axis=1))


def misfit(measured: Array, expected: Array) -> float:
    """Interquartile range of the log ratio of two responses (f,)."""
    return float(np.subtract(*np.percentile(np.log(np.abs(measured / expected)), [75, 25])))


def _of_noise(noise: NoiseResponse, expected: ExpectedResponse) -> tuple[Array, Array] | None:
    clear = clear_lines(noise, expected)
    if clear.sum() < LEAST_LINES:
        return None
    return _along(noise.H[clear], expected.H(noise.frequency_Hz[clear]))


def _of_sines(sines: SineResponse, expected: ExpectedResponse) -> tuple[Array, Array] | None:
    """By the slope of the dynamic stiffness about a resonance: a mode's mass, that neither frequency nor damping moves.

    Near a resonance the response itself says little: half a per cent of frequency is a factor of ten.
    """
    f, H = sines.frequency_Hz, sines.H
    if len(f) < LEAST_STEPS or np.ptp(f) == 0 or not np.all(np.abs(H) > 0):
        return None
    P = expected.H(f)
    if f.max() > NARROW * f.min():
        return _along(H, P)
    x = f**2 - np.mean(f**2)
    size = np.abs(H) * np.abs(sines.force)[:, None]
    slope = np.array([_slope(f**2, np.real(1 / one), own) for one, own in zip(H.T, size.T, strict=True)])
    if not np.all(np.isfinite(slope) & (slope != 0)):
        return None
    return (x @ np.real(1 / P)) / (x @ x) / slope, np.zeros(H.shape[1])


def _slope(x: Array, stiffness: Array, size: Array) -> float:
    """Median slope between both sides of a resonance at equal amplitudes, where a joint is equally soft."""
    order = np.argsort(x)
    x, stiffness, size = x[order], stiffness[order], size[order]
    peak = int(np.argmax(size))
    below, above = slice(0, peak), slice(peak + 1, len(x))
    rising = np.argsort(size[below])
    if len(rising) < 2:
        return np.nan
    shared = (size[above] >= size[below].min()) & (size[above] <= size[below].max())
    if shared.sum() < 2:
        return np.nan
    across = [np.interp(size[above][shared], size[below][rising], one[below][rising]) for one in (stiffness, x)]
    return float(np.median((stiffness[above][shared] - across[0]) / (x[above][shared] - across[1])))


def _along(H: Array, P: Array) -> tuple[Array, Array]:
    """Signed level and shape over many lines."""
    ratio = H / P
    level = np.exp(np.median(np.log(np.abs(ratio)), axis=0))
    sign = np.where(np.mean(ratio.real > 0, axis=0) < TURNED, -1.0, 1.0)
    return sign * level, np.array([misfit(one, two) for one, two in zip(H.T, P.T, strict=True)])
