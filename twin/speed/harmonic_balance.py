"""Harmonic balance, compiled against its plain numpy twin, and how long a point of a branch takes."""

from __future__ import annotations

from functools import partial

import numpy as np

from twin.bench import JointLaw, open_bench
from twin.bench.build import Built
from twin.joint import iwan
from twin.response import HarmonicBalance
from twin.rigs import Effect, load_rig
from twin.speed.measured import Measured, least_seconds, parallel_map

__all__ = ["balance", "ten_sliders"]

PROMISED_MS = 0.15


def balance() -> Measured:
    """One point of the steel rig with its own law and nine harmonics."""
    built = open_bench(load_rig("steel-lap-joint"), drive="force").built
    ratio, error = _beside_its_twin(built, harmonics=9, samples=256)
    return Measured(ratio=ratio, promise=None, against="its numpy twin", error=error)


def ten_sliders() -> Measured:
    """A branch of the steel rig with ten sliders in the joint, a gap and a cubic spring; five harmonics."""
    rig = load_rig("steel-lap-joint")
    E = rig.moduli()[0].normal_modulus
    gap = Effect(cause="ground-stop", parameters={"position_m": 0.4, "gap_m": 8e-4, "stiffness_N_per_m": 60.0})
    cubic = Effect(cause="cubic-stiffness", parameters={"position_m": 0.42, "stiffness_N_per_m3": 8e6})
    sliders = JointLaw(iwan(0.3 * E, 0.15 * E * 1e-6))
    bench = open_bench(rig, drive="force", joint_law=sliders, effects=[gap, cubic])
    ratio, error = _beside_its_twin(bench.built, harmonics=5, samples=128)
    compiled = HarmonicBalance(bench.built, harmonics=5, samples=128)
    points = len(compiled.branch(26.0, 28.0, 1.0))
    seconds = least_seconds(lambda: compiled.branch(26.0, 28.0, 1.0), 50)
    return Measured(
        ratio=ratio, promise=None, against="its numpy twin", error=error,
        more={"ms_a_point": 1e3 * seconds / points, "promise_ms_a_point": PROMISED_MS, "points": points},
    )  # fmt: skip


def _beside_its_twin(built: Built, *, harmonics: int, samples: int) -> tuple[float, float]:
    """Ratio of times for one point, and the largest difference of a channel's harmonic."""
    fast = HarmonicBalance(built, harmonics=harmonics, samples=samples)
    slow = HarmonicBalance(built, harmonics=harmonics, samples=samples, kernel="numpy")
    quick, plain = parallel_map(*(partial(one.solve, 26.6, 1.0) for one in (fast, slow)), repeats=3)
    a, b = (one.solve(26.6, 1.0).channels for one in (fast, slow))
    return plain / quick, float(np.abs(a - b).max() / np.abs(b).max())
