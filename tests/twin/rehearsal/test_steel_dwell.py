"""A dwell too short on the steel rig: what it does to the damping, and that the improved procedure mends it.

The true quality factor is the half-power width of harmonic balance, which knows neither procedure nor shaker.
"""

import numpy as np
import pytest

from twin.bench import BenchSetup, open_bench
from twin.procedures import SteppedSine
from twin.procedures.tables import Measure, Settle
from twin.rehearsal import NominalRig, rehearse, rehearse_until_clear
from twin.response import HarmonicBalance
from twin.rigs import load_rig

STEEL = load_rig("steel-lap-joint")
FORCE_N = 0.5
HASTY = SteppedSine(
    frequencies=[round(26.0 + 0.05 * i, 2) for i in range(17)], amplitudes=[FORCE_N], direction="both",
    settle=Settle(seconds=0.1), measure=Measure(seconds=0.2),
)  # fmt: skip


def true_quality_factor():
    free = open_bench(STEEL, setup=BenchSetup(drive="force", noise=False, converter=False))
    points = HarmonicBalance(free.built).branch(26.0, 26.8, FORCE_N)
    frequency = np.array([point.frequency_Hz for point in points])
    tip = [channel.name for channel in free.channels].index("acc2")
    size = np.array([abs(point.channels[tip, 1]) for point in points]) / frequency**2
    peak, half = int(np.argmax(size)), size.max() / np.sqrt(2)
    low = np.interp(half, size[: peak + 1], frequency[: peak + 1])
    high = np.interp(-half, -size[peak:], frequency[peak:])
    return frequency[peak] / (high - low)


@pytest.mark.slow
def test_a_quality_factor_wrong_by_a_factor_of_two_comes_right(tmp_path):
    nominal = NominalRig(rig_name="steel", damping_ratio=min(STEEL.damping.modal_ratio), bits=24)

    def bench():
        return open_bench(STEEL, seed=1, sample_rate_Hz=HASTY.sample_rate)

    true = true_quality_factor()
    first = rehearse(HASTY, bench(), tmp_path / "run.mcap", nominal=nominal)
    assert {"dwell-too-short"} < {caution.kind for caution in first.cautions}
    for summary in first.rehearsal.summaries():
        assert summary.quality_factor < true / 2
    better = rehearse_until_clear(first, lambda _: bench(), tmp_path / "improved.mcap")
    assert better.clear
    for summary in better.rehearsal.summaries():
        assert summary.quality_factor == pytest.approx(true, rel=0.05)
