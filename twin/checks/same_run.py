"""Sweeps and channels that are there twice, by their samples."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from recordings.run import PIECE, Run, Samples, pieces
from recordings.sweeps import Sweep, sweeps
from twin.checks.finding import Finding


def look_at_copies(run: Run) -> list[Finding]:
    """Channels with the samples of another one, but for those that never move."""
    samples = {name: x for device in run.devices.values() for name, x in device.values.items() if len(x)}
    groups = [list(samples)]
    for at in range(0, max(map(len, samples.values()), default=0), PIECE):
        groups = [alike for group in groups for alike in _alike({name: samples[name] for name in group}, at)]
    return [
        Finding(run.path, two, "same", "samples of its own", f"its samples are those of {one}", "stopped")
        for group in groups
        if any(np.any(piece != samples[group[0]][:1]) for piece in pieces(samples[group[0]]))
        for one, two in combinations(group, 2)
    ]


def _alike(samples: Mapping[str, Samples], at: int) -> list[list[str]]:
    """Which channels have the same piece there, none of it missing; those that are like no other are left out."""
    found: dict[bytes, list[str]] = {}
    for name, x in samples.items():
        piece = x[at : at + PIECE].astype(float) + 0.0  # of which both zeros are one
        if not np.isnan(piece).any():
            found.setdefault(hashlib.sha256(piece.tobytes()).digest(), []).append(name)
    return [names for names in found.values() if len(names) > 1]


def without_repeats(
    runs: Sequence[Run], held_out: Sequence[Run], *, force: str
) -> tuple[list[Run], list[Run], list[Finding]]:
    """Both kinds of runs without sweeps that came before; one that is held out must be none of those learnt from."""
    seen: dict[str, str] = {}
    findings: list[Finding] = []
    learnt = [_without(run, seen, findings, force=force, stop=False) for run in runs]
    kept = [_without(run, seen, findings, force=force, stop=True) for run in held_out]
    return [run for run in learnt if run], [run for run in kept if run], findings


def _without(run: Run, seen: dict[str, str], findings: list[Finding], *, force: str, stop: bool) -> Run | None:
    repeated: dict[str, str] = {}
    for sweep in (one for one in sweeps(run) if one.stretches):
        digest = _digest(run, sweep, force)
        if digest in seen:
            repeated[sweep.name] = seen[digest]
        seen.setdefault(digest, f"{sweep.name} of {Path(run.path).name}")
    if not repeated:
        return run
    found = f"sweep {', '.join(repeated)} is {', '.join(repeated.values())} again, sample by sample"
    expected = "sweeps that no fit has seen" if stop else "each sweep once"
    findings.append(Finding(run.path, "", "same", expected, found, "stopped" if stop else "set aside"))
    steps = tuple(step for step in run.steps if step.sweep not in repeated)
    return replace(run, steps=steps) if steps else None


def _digest(run: Run, sweep: Sweep, force: str) -> str:
    """Of the force's samples in all measured stretches."""
    digest = hashlib.sha256()
    for one in sweep.stretches:
        digest.update(run.between(force, one.start_ns, one.stop_ns).tobytes())
    return digest.hexdigest()
