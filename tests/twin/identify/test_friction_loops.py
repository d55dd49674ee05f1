"""Friction laws from loops: known laws come back and are told apart, and a real damper's tension changes slip alone."""

import json
from pathlib import Path

import numpy as np
import pytest

from recordings.errors import InputError
from twin.identify.friction_loops import INCH, KIP, Loop, identify_friction, iwan, jenkins, read_damper_json

DATA = Path(__file__).parents[2] / "data" / "friction-damper"


def real_loop(name):
    t = np.genfromtxt(DATA / f"{name}.csv", delimiter=",", names=True)
    return Loop(name, 256.0, INCH * t["displacement_inch"], KIP * t["friction_kip"])


@pytest.fixture(scope="module")
def damper():
    return identify_friction([real_loop(name) for name in ("0lb", "30lb", "36lb")])


def made(law, shared, slips, noise=0.02):
    """Loops of a known law at 1 Hz, 5 s at 128 Hz, with noise."""
    generator = np.random.default_rng(1)
    x = 0.02 * np.sin(2 * np.pi * np.arange(640) / 128)
    loops = []
    for i, (up, down) in enumerate(slips):
        force = law(x, np.array(shared), up, down)
        loops.append(Loop(f"t{i}", 128.0, x, force + noise * up * generator.standard_normal(640)))
    return loops


def test_a_closed_loop_of_jenkins_dissipates_what_its_corners_say():
    """Area of a symmetric loop: 4 F (X - F/k - gap/2), the slip force times the sliding distance of a cycle."""
    X, k, F, gap = 0.02, 2e6, 8e3, 0.006
    x = X * np.sin(2 * np.pi * np.arange(40001) / 20000)
    f = jenkins(x, np.array([k, gap]), F, F)
    area = np.trapezoid(f[20000:], x[20000:])
    assert area == pytest.approx(4 * F * (X - F / k - gap / 2), rel=1e-4)


def test_backlash_is_found_and_measured():
    result = identify_friction(made(jenkins, [2e6, 0.006], [(5e3, 4e3), (9e3, 8e3)]))
    assert result.best.law == "jenkins-with-gap"
    assert result.best.shared["gap_m"] == pytest.approx(0.006, rel=0.05)
    assert result.best.shared["stiffness_N_per_m"] == pytest.approx(2e6, rel=0.1)
    assert result.best.slip_force_N["t1"] == pytest.approx((9e3, 8e3), rel=0.02)


def test_spread_sliders_are_told_from_backlash():
    result = identify_friction(made(iwan, [1.5e6, 0.9], [(5e3, 5e3), (9e3, 9e3)]))
    assert result.best.law == "iwan"
    assert result.best.shared["spread"] == pytest.approx(0.9, abs=0.1)


@pytest.mark.slow
def test_the_dampers_loops_are_reproduced_at_all_three_tensions(damper):
    assert damper.best.law == "jenkins-with-gap"
    assert min(damper.best.r2.values()) >= 0.97
    assert damper.fits[1].bic > damper.best.bic + 50, "the evidence for the backlash is overwhelming"


def test_one_law_holds_across_tensions_and_slip_rises_with_tension(damper):
    assert min(damper.left_out_r2.values()) >= 0.97
    for direction in (0, 1):
        slips = [damper.best.slip_force_N[name][direction] for name in ("0lb", "30lb", "36lb")]
        spread = [damper.best.slip_force_std_N[name][direction] for name in ("0lb", "30lb", "36lb")]
        assert slips[1] - slips[0] > 3 * (spread[0] + spread[1])
        assert slips[2] - slips[1] > 3 * (spread[1] + spread[2])
    assert 0.003 < damper.best.shared["gap_m"] < 0.008


def test_ringing_of_the_frame_is_not_hidden(damper):
    """Above the cutoff the frame rings, most visibly at the lowest tension: the unfiltered figures say so."""
    assert damper.best.r2_unfiltered["0lb"] < damper.best.r2["0lb"] - 0.03
    assert all(damper.best.r2_unfiltered[name] > 0.85 for name in damper.best.r2)


def test_published_table_is_read_and_rubbish_refused(tmp_path):
    path = tmp_path / "t.json"
    rows = [[i / 1024, 1.0, 2.0, 0.0, 0.0, 0.0] for i in range(200)]
    path.write_text(json.dumps({"data": rows, "sampling freq": 1024}))
    loop = read_damper_json(path)
    assert loop.displacement_m[0] == pytest.approx(0.0254)
    assert loop.force_N[0] == pytest.approx(8896.443)
    for rubbish in ("{", "[]", '{"data": [[1]], "sampling freq": 1}', '{"data": "x", "sampling freq": 1}'):
        path.write_text(rubbish)
        with pytest.raises(InputError, match=r"t\.json"):
            read_damper_json(path)
    with pytest.raises(InputError):
        read_damper_json(tmp_path / "missing.json")
