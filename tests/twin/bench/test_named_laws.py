"""Laws by name on the bench, in both coordinates: the march meets harmonic balance."""

from __future__ import annotations

import numpy as np
import pytest
from test_steady_state import steady

from twin.bench import BenchSetup, open_bench
from twin.response import HarmonicBalance
from twin.rigs import NamedLaws, load_rig

RIG = load_rig("steel-lap-joint")
LAWS = {
    "saturating": {"opening": {"name": "saturating", "softening": 2e8, "begins_at": 2e-6}},
    "jenkins": {"opening": {"name": "jenkins", "stiffness": 1e8, "slips_at": 2e-6}},
    "iwan": {"slip": {"name": "iwan", "stiffness": 5e7, "slips_at": 1e-6}},
    "mayer-gaul": {"opening": {"name": "mayer-gaul", "opened": 1e8, "closed": 2e8, "pressed": 3e8, "gap": 4e-6}},
    "side by side": {
        "opening": [
            {"name": "running-loss", "loss": 4e7, "reached_at": 2e-6},
            {"name": "cubic", "stiffness": 4e18},
        ],
        "slip": {"name": "running-loss", "loss": 4e8, "reached_at": 1e-6},
    },
}


@pytest.mark.parametrize("name", LAWS)
def test_marching_meets_harmonic_balance(name):
    law = NamedLaws.model_validate(LAWS[name])
    rig = RIG.model_copy(update={"joint": RIG.joint.model_copy(update={"law": law})})
    bench = open_bench(rig, sample_rate_Hz=2048, setup=BenchSetup(drive="force", noise=False, converter=False))
    balance = HarmonicBalance(bench.built, harmonics=9, samples=512, internal_rate_Hz=11264.0)
    at = [c.name for c in bench.channels].index("acc2")
    marched = steady(bench, 26.42, 6.0, 30.0)
    measured = abs(marched["acc2"][1] / marched["force"][1])
    expected = abs(balance.sweep(np.linspace(27.2, 26.42, 14), 6.0)[-1].channels[at][1]) / 6.0
    assert measured == pytest.approx(expected, rel=3e-4)
    linear = abs(bench.built.rig(0.0, 11264.0).transfer(np.array([26.42]))[0, -1, 0])
    assert abs(measured / linear - 1) > 5e-3  # or the law was not there
