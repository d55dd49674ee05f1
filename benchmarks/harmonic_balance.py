"""Harmonic balance beside the bench, which marches to the same steady state, and how long a point of a branch takes."""

import numpy as np

from benchmarks.measured import Measured, least_seconds, timed_in_turns
from recordings.streams import Excitation
from twin.bench import Bench, JointLaw, open_bench
from twin.joint import iwan
from twin.response import HarmonicBalance
from twin.rigs import Effect, load_rig

PROMISED_MS = 0.15
AGAINST = "marching the bench until it has settled"
FREQUENCY_Hz, FORCE_N = 26.6, 1.0
SETTLING_s = 10.0
"""Of the rig's time: mode 1 with a damping ratio of 0.25 % has left a sixtieth of its transient then."""


def balance() -> Measured:
    """One point of the steel rig with its own law and nine harmonics."""
    bench = open_bench(load_rig("steel-lap-joint"), drive="force", noise=False, converter=False)
    ratio, error = _beside_the_bench(bench, harmonics=9, samples=256)
    return Measured(ratio=ratio, promise=None, against=AGAINST, error=error)


def ten_sliders() -> Measured:
    """A branch of the steel rig with ten sliders in the joint, a gap and a cubic spring; five harmonics."""
    rig = load_rig("steel-lap-joint")
    E = rig.moduli()[0].normal_modulus
    gap = Effect(cause="ground-stop", parameters={"position_m": 0.4, "gap_m": 8e-4, "stiffness_N_per_m": 60.0})
    cubic = Effect(cause="cubic-stiffness", parameters={"position_m": 0.42, "stiffness_N_per_m3": 8e6})
    sliders = JointLaw(iwan(0.3 * E, 0.15 * E * 1e-6))
    bench = open_bench(rig, drive="force", joint_law=sliders, effects=[gap, cubic], noise=False, converter=False)
    ratio, error = _beside_the_bench(bench, harmonics=5, samples=128)
    compiled = HarmonicBalance(bench.built, harmonics=5, samples=128)
    points = len(compiled.branch(26.0, 28.0, 1.0))
    seconds = least_seconds(lambda: compiled.branch(26.0, 28.0, 1.0), 50)
    return Measured(
        ratio=ratio, promise=None, against=AGAINST, error=error,
        more={"ms_a_point": 1e3 * seconds / points, "promise_ms_a_point": PROMISED_MS, "points": points},
    )  # fmt: skip


def _beside_the_bench(bench: Bench, *, harmonics: int, samples: int) -> tuple[float, float]:
    """Ratio of times for one steady state, and the largest difference of a channel's fundamental."""
    one = HarmonicBalance(bench.built, harmonics=harmonics, samples=samples)
    bench.set_output(Excitation(kind="sine", amplitude_V=FORCE_N, frequency_Hz=FREQUENCY_Hz))
    count = round(SETTLING_s * bench.sample_rate_Hz)
    ours, marched = timed_in_turns(lambda: one.solve(FREQUENCY_Hz, FORCE_N), lambda: bench.read(count), repeats=3)
    phase = 2 * np.pi * FREQUENCY_Hz / bench.sample_rate_Hz * np.arange(count)
    waves = np.column_stack([f(k * phase) for k in range(1, harmonics + 1) for f in (np.cos, np.sin)])
    signals = np.column_stack(list(bench.read(count).samples.values()))
    cosine, sine = np.linalg.lstsq(waves, signals - signals.mean(axis=0), rcond=None)[0][:2]
    found = np.abs(one.solve(FREQUENCY_Hz, FORCE_N).channels[:, 1])
    expected = np.hypot(cosine, sine)
    return marched / ours, float(np.max(np.abs(found / expected - 1)))
