"""Whether force and responses were recorded together, and whether the excitation reaches beyond half the rate."""

from collections.abc import Sequence

import numpy as np

from recordings.level import Level
from recordings.run import PIECE, Run
from recordings.sweeps import Stretch, measured_stretches
from twin.checks.agreement import RunBesideModel
from twin.checks.expected import ExpectedResponse
from twin.checks.finding import Finding
from twin.checks.responses import LEAST_SAMPLES, NoiseResponse, SineResponse
from twin.checks.thresholds import ALIASED, NOT_A_SINE, UNRELATED

HARMONICS = 5
"""That a sine's response may have much of."""
STILL = 0.01
"""Of the response that is largest, below which a sensor across the motion reads hardly anything else."""
QUIET = 1e-3
"""Share of its range up to which a response may be noise alone."""


def look_at_belonging(seen: RunBesideModel) -> list[Finding]:
    """Channels whose noise is not the force's, or whose steps are no sines; set aside where hardly anything moves."""
    run, force, channels, expected = seen.run, seen.force, seen.channels, seen.expected
    measured = [stretch for stretch in measured_stretches(run) if stretch.step.frequency_Hz > 0]
    findings: list[Finding] = []
    for number, channel in enumerate(channels):
        coherence = [_beyond_chance(float(np.median(one.coherence[:, number])), one.averages) for one in seen.noise]
        if coherence and max(coherence) < UNRELATED:
            found = f"median coherence {max(0.0, *coherence):.2g} beyond chance"
            still = _is_still(seen.noise, expected, number)
            findings.append(_finding(run, channel, f"a response to {force}: coherence near 1", found, still=still))
    named = (force, *channels)
    parts = np.array([[_share(run, channel, one) for channel in named] for one in measured]).reshape(-1, len(named))
    for number, channel in enumerate(named, start=-1):
        shares = parts[np.isfinite(parts[:, number + 1]), number + 1]
        if len(shares) and np.median(shares) < NOT_A_SINE and not (channel != force and _is_quiet(seen, number)):
            found = f"{np.median(shares):.0%} of its power there"
            still = channel != force and _is_still(seen.sines, expected, number)
            findings.append(_finding(run, channel, "sines at the steps' frequencies", found, still=still))
    return findings


def _beyond_chance(coherence: float, averages: int) -> float:
    """What a median coherence says over what it is of two unrelated signals, 1 - 2^(-1 / (averages - 1))."""
    chance = 1 - 0.5 ** (1 / max(averages - 1, 1))
    return (coherence - chance) / (1 - chance)


def _is_still(responses: Sequence[NoiseResponse | SineResponse], expected: ExpectedResponse, number: int) -> bool:
    """Whether a channel lies across the rig's motion: it should read next to nothing beside another of its quantity."""
    if not responses:
        return False
    size = np.abs(expected.H(np.concatenate([one.frequency_Hz for one in responses])))
    outputs = expected.model.outputs
    alike = [n for n, output in enumerate(outputs) if output.quantity == outputs[number].quantity]
    return bool(np.median(size[:, number] / np.max(size[:, alike], axis=1)) < STILL)


def _is_quiet(seen: RunBesideModel, number: int) -> bool:
    """Whether a response is small, and expected to be lost in that noise."""
    channel = seen.channels[number]
    limit, samples = seen.run.channels[channel].range, seen.run.device_of(channel).values[channel]
    size = [np.abs(seen.expected.H(one.frequency_Hz)[:, number] * one.force) for one in seen.sines]
    power = Level.of(samples).std ** 2
    if limit is None or not size or power > (QUIET * limit) ** 2:
        return False
    return float(np.median(np.concatenate(size)) ** 2) / 2 < NOT_A_SINE * power


def _finding(run: Run, channel: str, expected: str, found: str, *, still: bool) -> Finding:
    if still:
        return Finding(run.path, channel, "across", "next to nothing across the rig's motion", found, "set aside")
    return Finding(run.path, channel, "unrelated", expected, found, "stopped")


def look_at_aliasing(seen: RunBesideModel) -> list[Finding]:
    """Whether a noise's force reaches up to half the sample rate, from beyond which more then folds back."""
    share = next((noise.at_the_end for noise in seen.noise if noise.at_the_end > ALIASED), None)
    if share is None:
        return []
    rate_Hz = seen.run.device_of(seen.force).sample_rate_Hz
    expected = f"no force near half its sample rate of {rate_Hz:g} Hz"
    found = f"{share:.0%} of its mean density there: no anti-aliasing filter?"
    return [Finding(seen.run.path, seen.force, "aliasing", expected, found, "told")]


def _share(run: Run, channel: str, stretch: Stretch) -> float:
    """Share of a step's power that the step's frequency and its harmonics have; nan where samples are missing.

    Of a long step the beginning tells.
    """
    samples = run.between(channel, stretch.start_ns, stretch.stop_ns)[: PIECE // 4].astype(float)
    turns = stretch.step.frequency_Hz / run.device_of(channel).sample_rate_Hz
    if len(samples) < LEAST_SAMPLES or not np.isfinite(samples).all() or np.ptp(samples) == 0:
        return np.nan
    orders = np.arange(1, 1 + min(HARMONICS, max(1, int(0.45 / turns))))
    angle = 2 * np.pi * turns * np.arange(len(samples))[:, None] * orders
    basis = np.hstack([np.ones((len(samples), 1)), np.cos(angle), np.sin(angle)])
    left = samples - basis @ np.linalg.lstsq(basis, samples, rcond=None)[0]
    return float(1 - np.var(left) / np.var(samples))
