"""Channels that are dead, half empty or hold single wild samples, which no model need be asked about."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from recordings.container.stored import with_samples
from recordings.run import PIECE, Run, Samples, pieces
from recordings.sweeps import sweeps
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
    findings: list[Finding] = []
    for channel in [name for name in run.channels if any(name in device.values for device in run.devices.values())]:
        with working_on(run.path, channel):
            run, wild = _without_wild(run, channel)
            finding = _dead(run, channel, action="stopped" if channel == force else "set aside")
        findings += wild
        if finding is not None:
            findings.append(finding)
            run = run if channel == force else without_channels(run, {channel})
    return run, findings


def _without_wild(run: Run, channel: str) -> tuple[Run, list[Finding]]:
    """Single samples that the converter cannot have shown, or far beyond all others, as their neighbours' line.

    Where many are beyond it, it is the range that is wrong.
    """
    device = run.device_of(channel)
    samples = device.values[channel]
    usual, largest = _usual(samples)
    if not np.isfinite(usual):
        return run, []
    limit = run.channels[channel].range
    most = min(WILD * usual if usual > 0 else np.inf, BEYOND_RANGE * limit if limit else np.inf)
    if not largest > most:
        return run, []
    at, wild, beside_at, beside, count = _beyond(samples, most)
    unit = run.channels[channel].unit
    if count > FEW * len(samples):
        found = f"{count} samples up to {largest:.3g} {unit}, so that no use is made of it"
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


def _usual(samples: Samples) -> tuple[float, float]:
    """The size that a share FEW of the finite samples pass, and that of the largest of all; nan where none is finite.

    It lies between two of the largest, which alone are kept.
    """
    kept = int(FEW * len(samples)) + 2
    top, count = np.empty(0, np.float32), 0
    largest = 0.0
    for piece in pieces(samples):
        sizes = np.abs(piece)
        sound = sizes[np.isfinite(sizes)]
        count += len(sound)
        largest = float(np.max(sizes, initial=largest, where=~np.isnan(sizes)))
        top = np.concatenate([top, sound[sound > top.min(initial=np.inf)] if len(top) >= kept else sound])
        if len(top) > kept:
            top = np.partition(top, len(top) - kept)[-kept:]
    if not count:
        return np.nan, largest
    place = (count - 1) * (1 - FEW)
    beyond = count - 1 - int(place)
    pair = np.sort(top.astype(float))[len(top) - 1 - beyond :][:2]
    return float(np.quantile(pair, place - int(place))), largest


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


def _dead(run: Run, channel: str, *, action: Action) -> Finding | None:
    """Whether the measured stretches of a channel hold nothing, or too little."""
    device = run.device_of(channel)
    samples = device.values[channel]
    parts = [
        (device.position_at(one.start_ns), device.position_at(one.stop_ns))
        for sweep in sweeps(run)
        for one in sweep.stretches
    ]
    measured = [part for part in parts or [(0, len(samples))] if part[0] < part[1]]
    seen, jumps = _Seen(), 0
    for part in measured:
        for piece in pieces(samples, *part):
            seen.take(piece)
        jumps += _overflows(samples, *part) if parts else 0
    if not seen.count:
        return None
    if not seen.sound:
        return Finding(run.path, channel, "dead", "a signal", "no sample is a number", action)
    if seen.low == seen.high:
        return Finding(run.path, channel, "dead", "a signal", f"every sample is {seen.low:g}", action)
    for share, what in (
        (1 - seen.sound / seen.count, "missing"),
        (_zeros(samples, measured, seen), "exactly zero"),
        (seen.longest / seen.sound, "the one before again"),
    ):
        if share > HALF_EMPTY:
            return Finding(
                run.path, channel, "empty", "a signal throughout", f"{share:.0%} of samples are {what}", action
            )
    if jumps >= FEWEST_JUMPS:
        found = f"{jumps} jumps from one end of its samples to the other: whole numbers that overflow?"
        return Finding(run.path, channel, "overflow", "samples that follow each other", found, action)
    return None


@dataclass
class _Seen:
    """What the samples of one channel are like, taken piece by piece; of the finite ones but for `count`.

    `longest` is the longest row of equal ones, `first` as many as tell the smallest step.
    """

    count: int = 0
    sound: int = 0
    low: float = np.inf
    high: float = -np.inf
    zeros: int = 0
    longest: int = 0
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


def _zeros(samples: Samples, measured: Sequence[tuple[int, int]], seen: _Seen) -> float:
    """Share of exact zeros beyond what a coarse converter shows; 0 where there are few."""
    zeros = seen.zeros / seen.sound
    if zeros <= HALF_EMPTY:
        return 0.0
    step = smallest_step(seen.first)
    every = (piece for part in measured for piece in pieces(samples, *part))
    beside = sum(int(np.sum((piece != 0) & (np.abs(piece) < 1.5 * step))) for piece in every)
    return zeros if zeros > ZEROS_OVER_NEIGHBOURS * beside / seen.sound else 0.0


def _overflows(samples: Samples, start: int, stop: int) -> int:
    """How often a sample lies at the other end of all of them, while those beside go the other way: not if cut off."""
    ends = np.array([(np.min(piece), np.max(piece)) for piece in pieces(samples, start, stop)])
    if stop - start < 4 or not np.isfinite(ends).all():
        return 0
    jumps, count, span = 0, 0, np.ptp(ends)
    for at in range(start, stop - 3, PIECE):
        steps = np.diff(samples[at : min(at + PIECE + 3, stop)].astype(float))
        far = np.flatnonzero(np.abs(steps[1:-1]) > FAR * span) + 1
        jump, beside = steps[far], np.stack([steps[far - 1], steps[far + 1]])
        back = np.all((beside * jump < 0) & (np.abs(beside) < (1 - FAR) * np.abs(jump)), axis=0)
        jumps, count = jumps + int(np.sum(back)), count + len(far)
    return jumps if 2 * jumps > count else 0
