"""A hammer on the bench: half sines with the impulse that they should have, at each place in its turn."""

from __future__ import annotations

import numpy as np
import pytest

from twin.bench import HammeredBench, Hit, open_bench
from twin.bench.generator import pulse
from twin.bench.limits import LIMITS
from twin.rigs import Place, load_rig

STEP_s, RATE_Hz = 1e-5, 5120.0
DELAY = 12
"""Samples, of the anti-aliasing filter."""


def test_a_pulse_has_the_impulse_of_a_half_sine_and_a_rebound_comes_later_and_weaker():
    once, twice = pulse(30.0, 1e-3, STEP_s), pulse(30.0, 1e-3, STEP_s, rebound=True)
    assert np.sum(once) * STEP_s == pytest.approx(2 / np.pi * 30.0 * 1e-3, rel=1e-3)
    assert np.max(once) == pytest.approx(30.0, rel=1e-3)
    assert np.abs(once[[0, -1]]) == pytest.approx(0.0, abs=1e-9)
    assert np.sum(twice) / np.sum(once) == pytest.approx(1 + LIMITS.rebound_share)
    assert np.argmax(twice[len(once) :]) > 0


@pytest.fixture(scope="module")
def recorded():
    """Two hits at one end, the second a double one, then one hit at the other."""
    rig = load_rig("hung-lap-joint")
    places = [Place("lower", 0.0, (0.0, 1.0, 0.0)), Place("upper", 0.235, (0.0, 1.0, 0.0))]

    def open_at(number):
        return open_bench(rig.hit_at(places[number]), seed=number, sample_rate_Hz=RATE_Hz)

    hits = [[Hit(peak_N=5.0), Hit(peak_N=4.0, rebound=True)], [Hit(peak_N=3.0)]]
    bench = HammeredBench(open_at, hits, width_s=1e-3, every_s=1.0)
    blocks = [bench.read(777) for _ in range(round(8 * RATE_Hz / 777))]
    return bench, blocks


def test_hits_come_in_time_and_in_blocks_without_a_gap(recorded):
    _, blocks = recorded
    assert [block.first_index for block in blocks] == [777 * n for n in range(len(blocks))]
    assert [block.time_ns for block in blocks] == pytest.approx(
        [round(777 * n / RATE_Hz * 1e9) for n in range(len(blocks))], abs=100
    )
    force = np.concatenate([block.samples["force"] for block in blocks])
    aim, turn = LIMITS.takes_aim_s, LIMITS.takes_aim_s + 2.0
    for begin, peak in ((aim, 5.0), (aim + 1.0, 4.0), (turn + aim, 3.0)):
        first = round(begin * RATE_Hz)
        assert np.max(force[first : first + 24]) == pytest.approx(peak, rel=0.05)
        assert np.max(np.abs(force[first - 200 : first - 20])) < 0.1
    second = round((aim + 1.0 + LIMITS.rebound_s) * RATE_Hz)
    assert np.max(force[second : second + 24]) == pytest.approx(4.0 * LIMITS.rebound_share, rel=0.1)


def test_each_place_begins_at_rest(recorded):
    _, blocks = recorded
    seen = np.concatenate([block.samples["acc2"] for block in blocks])
    turn = round((LIMITS.takes_aim_s + 2.0) * RATE_Hz)
    assert np.std(seen[turn + 200 : turn + 2000]) < 0.2 * np.std(seen[turn - 2000 : turn])


def test_the_test_begins_anew_with_the_rate(recorded):
    bench, _ = recorded
    assert bench.set_sample_rate(2048.0) == 2048.0
    force = bench.read(round((LIMITS.takes_aim_s + 0.1) * 2048.0)).samples["force"]
    assert np.argmax(np.abs(force)) == pytest.approx(LIMITS.takes_aim_s * 2048.0 + DELAY, abs=3)


def test_a_hammer_takes_the_shaker_off_and_leaves_no_mass():
    for name in ("hung-lap-joint", "steel-lap-joint", "stiffened-plate"):
        rig = load_rig(name)
        hit = rig.hit_at(rig.drive_place)
        assert hit.shaker.ideal
        assert hit.force_sensor.mass == hit.force_sensor.stinger_side_mass == 0.0
        assert hit.drive_place == rig.drive_place
        assert [s.channel for s in hit.response_sensors] == [s.channel for s in rig.response_sensors]
    with pytest.raises(ValueError, match="nowhere"):
        load_rig("hung-lap-joint").hit_at(Place("nowhere", 0.0, (0.0, 1.0, 0.0)))
    with pytest.raises(ValueError, match="point"):
        load_rig("steel-lap-joint").hit_at(Place("upper", 9.0, (0.0, 1.0, 0.0)))


@pytest.mark.parametrize(("place", "moves"), [(("foot", 0.0), False), (("column", 0.3), True)])
def test_where_all_is_held_a_hit_moves_nothing(place, moves):
    bench = open_bench(load_rig("l-frame").hit_at(Place(*place, (1.0, 0.0, 0.0))), sample_rate_Hz=RATE_Hz)
    bench.hit(peak_N=5.0, width_s=1e-3)
    samples = bench.read(512).samples
    assert np.max(samples["force"]) == pytest.approx(5.0, rel=0.1)
    assert (np.ptp(samples["acc1"]) > 10.0) == moves
    assert moves or np.ptp(samples["acc1"]) < 0.5, "its noise alone"
