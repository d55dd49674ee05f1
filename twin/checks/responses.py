"""Responses per force of one recording, quickly: from noise by Welch's method, from sines by one line a step."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from recordings.run import Run
from recordings.sweeps import Stretch, sweeps
from twin.arrays import Array
from twin.identify.spectra.broadband import find_resonances
from twin.identify.spectra.spectrum import broadband_records, h1

LEAST_SAMPLES = 16
"""Of a step that can be fitted."""
TOP = (0.47, 0.499)
"""Of the sample rate: where a filter passes nothing."""


@dataclass(frozen=True, kw_only=True)
class NoiseResponse:
    """One stretch of noise."""

    run: str
    sweep: str
    frequency_Hz: Array
    """Within the band that the force excites, (f,)."""
    H: Array
    """Responses over the force, in the channels' units, (f, o)."""
    coherence: Array
    """(f, o)."""
    averages: int
    """Pieces that it is a mean of, half of one in the next."""
    resonances_Hz: Array
    """Peaks of all channels together."""
    at_the_end: float
    """Mean density of the force just below half the sample rate, over that at all frequencies."""


@dataclass(frozen=True, kw_only=True)
class SineResponse:
    """One stepped sweep."""

    run: str
    sweep: str
    frequency_Hz: Array
    """As commanded, (s,)."""
    force: Array
    """Complex amplitudes at the commanded frequency, (s,)."""
    H: Array
    """Responses over the force, in the channels' units, (s, o)."""


def noise_responses(run: Run, *, force: str, channels: Sequence[str]) -> list[NoiseResponse]:
    """Of all stretches of noise in a run; `channels` are the responses."""
    found = []
    for record in broadband_records(run, channels=[force, *channels]):
        resonances, band = find_resonances(record, force=force, channels=tuple(channels))
        response = h1(record, force=force)
        density, part = response.density[force], response.frequency_Hz / record.sample_rate_Hz
        end = density[(part > TOP[0]) & (part < TOP[1])]
        inside = (response.frequency_Hz > 0) & (response.frequency_Hz >= band[0]) & (response.frequency_Hz <= band[1])
        found.append(
            NoiseResponse(
                run=run.path,
                sweep=record.sweep,
                frequency_Hz=response.frequency_Hz[inside],
                H=np.stack([response.H[name][inside] for name in channels], axis=1),
                coherence=np.stack([response.coherence[name][inside] for name in channels], axis=1),
                averages=response.averages,
                resonances_Hz=resonances,
                at_the_end=float(np.mean(end) / np.mean(density)) if len(end) and density.any() else 0.0,
            )
        )
    return found


def sine_responses(run: Run, *, force: str, channels: Sequence[str]) -> list[SineResponse]:
    """Of all stepped sweeps in a run; steps that lost samples are passed over."""
    found = []
    for sweep in sweeps(run):
        steps = [stretch for stretch in sweep.stretches if stretch.step.frequency_Hz > 0]
        lines = np.array([[_line(run, name, stretch) for name in (force, *channels)] for stretch in steps])
        if not len(lines):
            continue
        frequency = np.array([stretch.step.frequency_Hz for stretch in steps])
        sound = np.isfinite(lines).all(axis=1) & (lines[:, 0] != 0)
        found.append(
            SineResponse(
                run=run.path,
                sweep=sweep.name,
                frequency_Hz=frequency[sound],
                force=lines[sound, 0],
                H=lines[sound, 1:] / lines[sound, :1],
            )
        )
    return found


def whole_stretch(run: Run, channel: str, stretch: Stretch) -> Array | None:
    """Samples (n,) of a measured stretch; None where there are few, or some are missing."""
    samples = run.between(channel, stretch.start_ns, stretch.stop_ns).astype(float)
    return samples if len(samples) >= LEAST_SAMPLES and np.isfinite(samples).all() else None


def _line(run: Run, channel: str, stretch: Stretch) -> complex:
    """Complex amplitude at the step's frequency, from the stretch's start; NaN where samples are missing."""
    device, samples = run.device_of(channel), whole_stretch(run, channel, stretch)
    if samples is None:
        return complex(np.nan)
    first = device.position_at(stretch.start_ns)
    late_s = float(device.times_ns(first, first + 1)[0] - stretch.start_ns) * 1e-9
    line = line_of(samples, stretch.step.frequency_Hz / device.sample_rate_Hz)
    return line * np.exp(-2j * np.pi * stretch.step.frequency_Hz * late_s)


def line_of(samples: Array, turns: float) -> complex:
    """Complex amplitude (peak value) of the sine of so many turns a sample, behind a Hann window."""
    window = np.hanning(len(samples) + 2)[1:-1]
    turned = np.exp(-2j * np.pi * turns * np.arange(len(samples)))
    return complex(2 * np.sum(window * (samples - np.mean(samples)) * turned) / np.sum(window))
