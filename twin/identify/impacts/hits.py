"""Which hits of an impact test can be used: no second hit in the record, nothing on the converter's limit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from recordings.errors import InputError
from recordings.run import Run
from twin.arrays import Array
from twin.identify.limits import LIMITS
from twin.identify.spectra.spectrum import BroadbandRecord, broadband_records


@dataclass(frozen=True, kw_only=True)
class HitRecord:
    """The record of one hit."""

    record: BroadbandRecord
    top: int
    half: int
    """Sample at which the pulse is highest, and how many to either side belong to it and its filtering."""


@dataclass(frozen=True, kw_only=True)
class Hits:
    """The records that can be used, by point in the order of the test, and a line on each that cannot."""

    force: str
    channels: tuple[str, ...]
    records: Mapping[str, tuple[HitRecord, ...]]
    set_aside: tuple[str, ...]
    sample_rate_Hz: float
    length: int
    """Samples that all records have."""

    @property
    def each(self) -> tuple[HitRecord, ...]:
        """All that can be used, whatever the point."""
        return tuple(hit for own in self.records.values() for hit in own)


def sound_hits(run: Run, *, force: str, channels: Sequence[str]) -> Hits:
    """Look at every hit of a run.

    Raises
    ------
    InputError
        If a point has no hit that can be used.
    """
    records: dict[str, list[HitRecord]] = {}
    numbers: dict[str, int] = {}
    set_aside = []
    for record in broadband_records(run, channels=[force, *channels], impacts=True):
        point = record.sweep
        number = numbers[point] = numbers.get(point, 0) + 1
        kept = records.setdefault(point, [])
        top, half = pulse_of(record.samples[force])
        hit = HitRecord(record=record, top=top, half=half)
        if reason := _wrong(hit, run, force):
            set_aside.append(f"point {point}, hit {number} is set aside: {reason}")
        else:
            kept.append(hit)
    if not records:
        raise InputError(run.path, "/procedure", "holds no hit", "run a procedure of kind impact")
    for point, kept in records.items():
        if not kept:
            why = next(line for line in set_aside if line.startswith(f"point {point}, "))
            raise InputError(run.path, f"point {point}", f"none of its hits can be used: {why}", "hit it again")
    whole = [hit.record for kept in records.values() for hit in kept]
    length = min(record.length for record in whole)
    kept_records = {point: tuple(kept) for point, kept in records.items()}
    return Hits(
        force=force, channels=tuple(channels), records=kept_records, set_aside=tuple(set_aside),
        sample_rate_Hz=whole[0].sample_rate_Hz, length=length,
    )  # fmt: skip


def pulse_of(force: Array) -> tuple[int, int]:
    """Where a pulse is highest, and how many samples to either side of that belong to it and its filtering."""
    top = int(np.argmax(np.abs(force)))
    high = np.abs(force) > LIMITS.pulse_foot * np.abs(force[top])
    before, after = np.flatnonzero(~high[:top][::-1]), np.flatnonzero(~high[top:])
    wide = (before[0] if len(before) else top) + (after[0] if len(after) else len(force) - top)
    return top, int(wide) + LIMITS.pulse_ringing


def _wrong(hit: HitRecord, run: Run, force: str) -> str:
    """What forbids to use a hit; empty if nothing does."""
    record, top, half = hit.record, hit.top, hit.half
    for name, samples in record.samples.items():
        full = run.channels[name].range
        if full is not None and np.any(np.abs(samples) >= LIMITS.full_scale * full):
            return f"{name} is on the limit of its converter, {full:g} {run.channels[name].unit}"
        if len(record.missing.get(name, ())):
            return f"{len(record.missing[name])} samples of {name} were lost"
    signal = record.samples[force]
    others = np.abs(signal)
    others[max(0, top - half) : top + half + 1] = 0.0
    second = int(np.argmax(others))
    share = others[second] / np.abs(signal[top])
    if share > LIMITS.second_hit and others[second] > LIMITS.second_over_noise * np.median(others):
        apart_ms = 1e3 * abs(second - top) / record.sample_rate_Hz
        return f"double hit, a second pulse of {share:.0%} lies {apart_ms:.3g} ms beside the first"
    return ""
