"""Channels that are dead, half empty or hold single wild samples, which no model need be asked about.

What every channel is asked is asked of all of them side by side, since a file has them so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from recordings.container.stored import with_samples
from recordings.run import PIECE, DeviceSamples, Run, Samples, channel_blocks, pieces
from recordings.sweeps import measured_stretches
from recordings.whereabouts import working_on
from twin.arrays import Array
from twin.checks.finding import Action, Finding
from twin.checks.thresholds import BEYOND_RANGE, FEW, HALF_EMPTY, WILD, ZEROS_OVER_NEIGHBOURS
from twin.diagnose.signals.levels import SAMPLES, smallest_step
from twin.identify.rig_channels import without_channels

FAR = 0.9
"""Of the distance of a channel's extremes, which no sampled signal goes at one step between small ones."""
FEWEST_JUMPS = 3
ALONE = 3.0
"""Over those beside it, from which on a large sample is no peak of a signal."""


def look_at_samples(run: Run, *, force: str) -> tuple[Run, list[Finding]]:
    """A run without its dead channels, single wild samples drawn over, and what was found."""
    channels = [name for name in run.channels if any(name in device.values for device in run.devices.values())]
    sizes: dict[str, _Sizes] = {}
    for device in run.devices.values():
        sizes |= {name: _Sizes(len(samples)) for name, samples in device.values.items()}
        for name, piece in channel_blocks(device):
            sizes[name].take(piece)
    wild: dict[str, list[Finding]] = {}
    for channel in channels:
        with working_on(run.path, channel):
            run, wild[channel] = _without_wild(run, channel, sizes[channel])
    findings: list[Finding] = []
    seen = {name: one for device in run.devices.values() for name, one in _measured(run, device).items()}
    for channel in channels:
        with working_on(run.path, channel):
            finding = _dead(run, channel, seen[channel], action="stopped" if channel == force else "set aside")
        findings += wild[channel]
        if finding is not None:
            findings.append(finding)
            run = run if channel == force else without_channels(run, {channel})
    return run, findings


def _without_wild(run: Run, channel: str, sizes: _Sizes) -> tuple[Run, list[Finding]]:
    """Single samples that the converter cannot have shown, or far beyond all others, as their neighbours' line.

    Where many are beyond it, it is the range that is wrong.
    """
    device = run.device_of(channel)
    samples, usual = device.values[channel], sizes.usual
    if not np.isfinite(usual):
        return run, []
    limit = run.channels[channel].range
    most = min(WILD * usual if usual > 0 else np.inf, BEYOND_RANGE * limit if limit else np.inf)
    if not sizes.largest > most:
        return run, []
    at, wild, beside_at, beside, count = _beyond(samples, most)
    unit = run.channels[channel].unit
    if count > FEW * len(samples):
        found = f"{count} samples up to {sizes.largest:.3g} {unit}, so that no use is made of it"
        run = replace(run, channels={**run.channels, channel: replace(run.channels[channel], range=None)})
        return run, [Finding(run.path, channel, "range", f"at most its range of {limit:g} {unit}", found, "told")]
    size = np.abs(wild)
    if WILD * usual == most:
        alone = size > ALONE * np.interp(at, beside_at, np.abs(beside))
        at, size, count = at[alone], size[alone], int(np.sum(alone))
    if not count:
        return run, []
    told = f"{float(np.max(size)):.3g} {unit}"
    drawn = with_samples(samples, at, np.interp(at, beside_at, beside).astype(np.float32))
    when = "sample" if count == 1 else "samples"
    finding = Finding(
        run.path, channel, "wild", f"at most {most:.3g} {unit}", f"{count} wild {when} of {told}", "set aside"
    )
    device = replace(device, values={**device.values, channel: drawn})
    return replace(run, devices={**run.devices, device.device: device}), [finding]


@dataclass
class _Sizes:
    """Of a channel's samples, as many as `length`, taken piece by piece; the largest alone are kept."""

    length: int
    count: int = 0
    largest: float = 0.0
    top: Array = field(default_factory=lambda: np.empty(0, np.float32))

    def take(self, piece: Array) -> None:
        """The next samples."""
        kept = int(FEW * self.length) + 2
        sizes = np.abs(piece)
        sound = sizes[np.isfinite(sizes)]
        self.count += len(sound)
        self.largest = float(np.max(sizes, initial=self.largest, where=~np.isnan(sizes)))
        full = len(self.top) >= kept
        self.top = np.concatenate([self.top, sound[sound > self.top.min(initial=np.inf)] if full else sound])
        if len(self.top) > kept:
            self.top = np.partition(self.top, len(self.top) - kept)[-kept:]

    @property
    def usual(self) -> float:
        """The size that a share FEW of the finite samples pass, between two of the largest; nan of none."""
        if not self.count:
            return np.nan
        place = (self.count - 1) * (1 - FEW)
        beyond = self.count - 1 - int(place)
        pair = np.sort(self.top.astype(float))[len(self.top) - 1 - beyond :][:2]
        return float(np.quantile(pair, place - int(place)))


def _beyond(samples: Samples, most: float) -> tuple[Array, Array, Array, Array, int]:
    """Positions and values of samples larger than `most`, and of those beside them or missing ones that are not.

    And how many are larger; where these are more than single ones they are only counted.
    """
    found: list[list[Array]] = [[np.empty(0, np.int64)], [np.empty(0)], [np.empty(0, np.int64)], [np.empty(0)]]
    at = count = 0
    for piece in pieces(samples):
        first, last = max(at - 1, 0), min(at + len(piece) + 1, len(samples))
        x = samples[first:last].astype(float)
        good = np.abs(x) <= most
        beside = good & ~(np.append(good[1:], True) & np.insert(good[:-1], 0, True))
        larger = np.abs(x) > most
        own = (np.arange(first, last) >= at) & (np.arange(first, last) < at + len(piece))
        count += int(np.sum(larger & own))
        if count <= FEW * len(samples):
            for kept, chosen in zip((found[:2], found[2:]), (larger & own, beside & own), strict=True):
                kept[0].append(first + np.flatnonzero(chosen))
                kept[1].append(x[chosen])
        at += len(piece)
    at_larger, larger_ones, at_beside, those_beside = map(np.concatenate, found)
    return at_larger, larger_ones, at_beside, those_beside, count


def _measured(run: Run, device: DeviceSamples) -> dict[str, _Seen]:
    """What a device's channels are like in the measured stretches, or throughout where there are none."""
    stretches = [(device.position_at(one.start_ns), device.position_at(one.stop_ns)) for one in measured_stretches(run)]
    parts = [part for part in stretches or [(0, len(device))] if part[0] < part[1]]
    seen = {name: _Seen(parts) for name in device.values}
    for part in parts:
        for name, piece in channel_blocks(device, *part):
            seen[name].take(piece)
        for name, jumps in _overflows(device, *part).items() if stretches else ():
            seen[name].jumps += jumps
    return seen


def _dead(run: Run, channel: str, seen: _Seen, *, action: Action) -> Finding | None:
    """Whether the measured stretches of a channel hold nothing, or too little."""
    if not seen.count:
        return None
    if not seen.sound:
        return Finding(run.path, channel, "dead", "a signal", "no sample is a number", action)
    if seen.low == seen.high:
        return Finding(run.path, channel, "dead", "a signal", f"every sample is {seen.low:g}", action)
    for share, what in (
        (1 - seen.sound / seen.count, "missing"),
        (_zeros(run.device_of(channel).values[channel], seen), "exactly zero"),
        (seen.longest / seen.sound, "the one before again"),
    ):
        if share > HALF_EMPTY:
            return Finding(
                run.path, channel, "empty", "a signal throughout", f"{share:.0%} of samples are {what}", action
            )
    if seen.jumps >= FEWEST_JUMPS:
        found = f"{seen.jumps} jumps from one end of its samples to the other: whole numbers that overflow?"
        return Finding(run.path, channel, "overflow", "samples that follow each other", found, action)
    return None


@dataclass
class _Seen:
    """What the samples of one channel in some parts are like, taken piece by piece; the finite ones but for `count`.

    `longest` is the longest row of equal ones, `first` as many as tell the smallest step.
    """

    parts: Sequence[tuple[int, int]]
    count: int = 0
    sound: int = 0
    low: float = np.inf
    high: float = -np.inf
    zeros: int = 0
    longest: int = 0
    jumps: int = 0
    first: Array = field(default_factory=lambda: np.empty(0, np.float32))
    _last: float = np.nan
    _row: int = 0

    def take(self, piece: Array) -> None:
        """The next samples."""
        x = piece[np.isfinite(piece)]
        self.count += len(piece)
        self.sound += len(x)
        if not len(x):
            return
        self.low, self.high = min(self.low, float(np.min(x))), max(self.high, float(np.max(x)))
        self.zeros += len(x) - int(np.count_nonzero(x))
        if len(self.first) < SAMPLES:
            self.first = np.concatenate([self.first, x[: SAMPLES - len(self.first)]])
        edges = np.flatnonzero(np.diff(x))
        rows = np.diff(np.concatenate([[-1], edges, [len(x) - 1]]))
        rows[0] += self._row if x[0] == self._last else 0
        self.longest = max(self.longest, int(np.max(rows)))
        self._last, self._row = float(x[-1]), int(rows[-1])


def _zeros(samples: Samples, seen: _Seen) -> float:
    """Share of exact zeros beyond what a coarse converter shows; 0 where there are few."""
    zeros = seen.zeros / seen.sound
    if zeros <= HALF_EMPTY:
        return 0.0
    step = smallest_step(seen.first)
    every = (piece for part in seen.parts for piece in pieces(samples, *part))
    beside = sum(int(np.sum((piece != 0) & (np.abs(piece) < 1.5 * step))) for piece in every)
    return zeros if zeros > ZEROS_OVER_NEIGHBOURS * beside / seen.sound else 0.0


def _overflows(device: DeviceSamples, start: int, stop: int) -> dict[str, int]:
    """How often a channel's sample is at the other end of all, while those beside go the other way: not if cut off."""
    ends: dict[str, list[float]] = {name: [] for name in device.values}
    for name, piece in channel_blocks(device, start, stop):
        ends[name] += [np.min(piece), np.max(piece)]
    spans = {name: np.ptp(both) for name, both in ends.items() if stop - start >= 4 and np.isfinite(both).all()}
    jumps, count = dict.fromkeys(spans, 0), dict.fromkeys(spans, 0)
    for at in range(start, stop - 3, PIECE):
        for name, span in spans.items():
            steps = np.diff(device.values[name][at : min(at + PIECE + 3, stop)].astype(float))
            far = np.flatnonzero(np.abs(steps[1:-1]) > FAR * span) + 1
            jump, beside = steps[far], np.stack([steps[far - 1], steps[far + 1]])
            back = np.all((beside * jump < 0) & (np.abs(beside) < (1 - FAR) * np.abs(jump)), axis=0)
            jumps[name], count[name] = jumps[name] + int(np.sum(back)), count[name] + len(far)
    return {name: one if 2 * one > count[name] else 0 for name, one in jumps.items()}
