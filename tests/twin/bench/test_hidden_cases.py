"""Drawn cases stay within what an experimenter could believe; unlisted physics acts and stays finite."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from recordings.streams import Excitation
from twin.bench import FIRST_CAUSES, draw_case, open_bench
from twin.rigs import load_rig

sys.path.insert(0, str(Path(__file__).parent))
from unlisted import UNLISTED, open_unlisted

from twin.bench import BenchSetup

RIG = load_rig("steel-lap-joint")


def test_a_case_hides_one_cause_and_moves_what_nobody_knows():
    rng = np.random.default_rng(4)
    seen = set()
    for _ in range(60):
        case = draw_case(rng, rig=RIG)
        seen.add(case.effects[0].cause)
        for key, nominal in RIG.joint.preload.items():
            true = case.rig.joint.preload[key]
            assert 0.9 <= true.normal_modulus / nominal.normal_modulus <= 1.1
            assert 0.9 <= true.shear_modulus / nominal.shear_modulus <= 1.1
        assert all(
            0.8 <= a / b <= 1.2 for a, b in zip(case.rig.damping.modal_ratio, RIG.damping.modal_ratio, strict=True)
        )
        assert 0.8 <= case.softening <= 1.2
        assert 0.8 <= case.loss <= 1.2
    assert seen == set(FIRST_CAUSES)


def test_the_same_chance_draws_the_same_case_and_none_is_possible():
    a, b = (draw_case(np.random.default_rng(9), rig=RIG) for _ in range(2))
    assert a == b
    assert draw_case(np.random.default_rng(9), rig=RIG, causes=["none"]).effects == ()
    with pytest.raises(ValueError, match="no cause 'gremlin'"):
        draw_case(np.random.default_rng(9), rig=RIG, causes=["gremlin"])


def test_clamp_compliance_of_normal_strength_lowers_mode_1_by_about_one_per_cent():
    for seed in range(5):
        case = draw_case(np.random.default_rng(seed), rig=RIG, causes=["clamp-compliance"])
        stiff = open_bench(case.rig).built.modal(0.0, 51200.0).omega[0]
        assert 0.008 < 1 - case.open_bench().built.modal(0.0, 51200.0).omega[0] / stiff < 0.03


@pytest.mark.parametrize("name", UNLISTED)
def test_unlisted_physics_acts(name):
    setup = BenchSetup(noise=False)
    plain, changed = open_bench(RIG, setup=setup), open_unlisted(RIG, name, setup=setup)
    values = []
    for bench in (plain, changed):
        bench.set_output(Excitation(kind="sine", amplitude_V=0.8, frequency_Hz=26.3))
        bench.read(5 * 1024)
        values.append(bench.read(1024).samples["acc2"])
    assert np.isfinite(values[1]).all()
    assert np.std(values[0] - values[1]) > 0.005 * np.std(values[0])
