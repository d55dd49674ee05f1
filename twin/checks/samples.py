"""Channels that are dead, half empty or hold single wild samples, which no model need be asked about."""

from dataclasses import replace

import numpy as np

from recordings.run import Run
from recordings.sweeps import sweeps
from recordings.whereabouts import working_on
from twin.arrays import Array
from twin.checks.finding import Action, Finding
from twin.checks.thresholds import BEYOND_RANGE, FEW, HALF_EMPTY, WILD, ZEROS_OVER_NEIGHBOURS
from twin.diagnose.signals.levels import smallest_step

FAR = 0.9
"""Of the distance of a channel's extremes, which no sampled signal goes at one step between small ones."""
FEWEST_JUMPS = 3
ALONE = 3.0
"""Over those beside it, from which on a large sample is no peak of a signal."""


def look_at_samples(run: Run, *, force: str) -> tuple[Run, list[Finding]]:
    """A run without its dead channels, single wild samples drawn over, and what was found."""
    findings: list[Finding] = []
    for channel in [name for name in run.channels if any(name in device.values for device in run.devices.values())]:
        with working_on(run.path, channel):
            run, wild = _without_wild(run, channel)
            finding = _dead(run, channel, action="stopped" if channel == force else "set aside")
        findings += wild
        if finding is not None:
            findings.append(finding)
            run = run if channel == force else _without(run, channel)
    return run, findings


def _without_wild(run: Run, channel: str) -> tuple[Run, list[Finding]]:
    """Single samples that the converter cannot have shown, or far beyond all others, as their neighbours' line.

    Where many are beyond it, it is the range that is wrong.
    """
    device = run.device_of(channel)
    samples = device.values[channel]
    size = np.abs(samples.astype(float))
    sound = size[np.isfinite(size)]
    if not len(sound):
        return run, []
    limit = run.channels[channel].range
    usual = WILD * float(np.quantile(sound, 1 - FEW))
    most = min(usual if usual > 0 else np.inf, BEYOND_RANGE * limit if limit else np.inf)
    wild = np.flatnonzero(size > most)
    if usual == most and len(wild):
        wild = wild[size[wild] > ALONE * np.interp(wild, np.flatnonzero(size <= most), size[size <= most])]
    unit = run.channels[channel].unit
    if not len(wild):
        return run, []
    largest = f"{float(np.max(size[wild])):.3g} {unit}"
    if len(wild) > FEW * len(size):
        found = f"{len(wild)} samples up to {largest}, so that no use is made of it"
        run = replace(run, channels={**run.channels, channel: replace(run.channels[channel], range=None)})
        return run, [Finding(run.path, channel, "range", f"at most its range of {limit:g} {unit}", found, "told")]
    drawn = samples.copy()
    good = np.flatnonzero(size <= most)
    drawn[wild] = np.interp(wild, good, samples[good])
    when = "sample" if len(wild) == 1 else "samples"
    finding = Finding(
        run.path, channel, "wild", f"at most {most:.3g} {unit}", f"{len(wild)} wild {when} of {largest}", "set aside"
    )
    device = replace(device, values={**device.values, channel: drawn})
    return replace(run, devices={**run.devices, device.device: device}), [finding]


def _dead(run: Run, channel: str, *, action: Action) -> Finding | None:
    """Whether the measured stretches of a channel hold nothing, or too little."""
    parts = [run.between(channel, one.start_ns, one.stop_ns) for sweep in sweeps(run) for one in sweep.stretches]
    measured = np.concatenate(parts) if parts else run.device_of(channel).values[channel]
    sound = measured[np.isfinite(measured)]
    if not len(measured):
        return None
    if not len(sound):
        return Finding(run.path, channel, "dead", "a signal", "no sample is a number", action)
    if np.ptp(sound) == 0:
        return Finding(run.path, channel, "dead", "a signal", f"every sample is {sound[0]:g}", action)
    for share, what in (
        (1 - len(sound) / len(measured), "missing"),
        (_zeros(sound), "exactly zero"),
        (_held(sound), "the one before again"),
    ):
        if share > HALF_EMPTY:
            return Finding(
                run.path, channel, "empty", "a signal throughout", f"{share:.0%} of samples are {what}", action
            )
    if (jumps := sum(_overflows(part) for part in parts)) >= FEWEST_JUMPS:
        found = f"{jumps} jumps from one end of its samples to the other: whole numbers that overflow?"
        return Finding(run.path, channel, "overflow", "samples that follow each other", found, action)
    return None


def _overflows(samples: Array) -> int:
    """How often a sample lies at the other end of all of them, while those beside go the other way: not if cut off."""
    if len(samples) < 4 or not np.isfinite(samples).all():
        return 0
    steps = np.diff(samples.astype(float))
    far = np.flatnonzero(np.abs(steps[1:-1]) > FAR * np.ptp(samples)) + 1
    jump, beside = steps[far], np.stack([steps[far - 1], steps[far + 1]])
    back = np.all((beside * jump < 0) & (np.abs(beside) < (1 - FAR) * np.abs(jump)), axis=0)
    return int(np.sum(back)) if 2 * np.sum(back) > len(far) else 0


def _zeros(samples: Array) -> float:
    """Share of exact zeros beyond what a coarse converter shows."""
    zeros = float(np.mean(samples == 0))
    step = smallest_step(samples)
    beside = float(np.mean((samples != 0) & (np.abs(samples) < 1.5 * step)))
    return zeros if zeros > ZEROS_OVER_NEIGHBOURS * beside else 0.0


def _held(samples: Array) -> float:
    """Share of samples within the longest row of equal ones."""
    edges = np.flatnonzero(np.diff(samples) != 0)
    rows = np.diff(np.concatenate([[-1], edges, [len(samples) - 1]]))
    return float(np.max(rows)) / len(samples)


def _without(run: Run, channel: str) -> Run:
    devices = {
        name: replace(device, values={one: x for one, x in device.values.items() if one != channel})
        for name, device in run.devices.items()
        if set(device.values) != {channel}
    }
    return replace(run, channels={n: c for n, c in run.channels.items() if n != channel}, devices=devices)
