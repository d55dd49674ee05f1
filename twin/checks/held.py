"""Which channel the steps' amplitudes were held at."""

from collections.abc import Mapping, Sequence

import numpy as np

from recordings.run import Run
from recordings.sweeps import Stretch, measured_stretches
from twin.checks.finding import Finding
from twin.checks.responses import line_of, whole_stretch
from twin.checks.thresholds import TARGET

STEADY = 0.05
"""Scatter of the logarithm over a run's steps up to which a channel was held."""


def amplitudes_over_target(run: Run, channels: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Median and scatter of the logarithm of each channel's amplitude over the steps' target; inf without a target."""
    measured = [stretch for stretch in measured_stretches(run) if stretch.step.target_amplitude > 0]
    sizes = [[_size(run, name, one) / one.step.target_amplitude for name in channels] for one in measured]
    return {name: _spread([row[k] for row in sizes]) for k, name in enumerate(channels)}


def look_at_target(run: Run, over_target: Mapping[str, tuple[float, float]], *, force: str) -> list[Finding]:
    """Whether the steps name the channel that was held."""
    named = {step.target_channel for step in run.steps} - {""}
    if len(named) != 1:
        return []
    (target,) = named
    held = [name for name, (level, spread) in over_target.items() if abs(level) < STEADY and spread < STEADY]
    level, _ = over_target.get(target, (np.inf, np.inf))
    if target in held or abs(level) < TARGET or not held:
        return []
    expected = f"the steps' {target} at its target"
    found = f"{held[0]} keeps the targets' amplitudes"
    if target == force:
        return [Finding(run.path, force, "swapped", expected, f"{found}: {force} and {held[0]} swapped?", "stopped")]
    return [Finding(run.path, target, "target", expected, found, "told")]


def _spread(sizes: Sequence[float]) -> tuple[float, float]:
    logs = np.log([size for size in sizes if np.isfinite(size) and size > 0])
    if not len(logs):
        return np.inf, np.inf
    return float(np.median(logs)), float(np.subtract(*np.percentile(logs, [75, 25])))


def _size(run: Run, channel: str, stretch: Stretch) -> float:
    """Peak value of the step's sine; the noise's rms."""
    samples = whole_stretch(run, channel, stretch)
    if samples is None:
        return np.nan
    if stretch.step.frequency_Hz == 0:
        return float(np.std(samples))
    return abs(line_of(samples, stretch.step.frequency_Hz / run.device_of(channel).sample_rate_Hz))
