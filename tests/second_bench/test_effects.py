"""Hidden effects: what they do, how large they are, and that the truth is told in the contract's names."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.second_bench.believed import BELIEVED, TRANSDUCERS
from tests.second_bench.campaign import EFFECTS, Case, record
from tests.second_bench.channels import Wiring
from tests.second_bench.effects import LISTED, UNLISTED, Rig
from tests.second_bench.mechanics.structure import modes_of
from tests.second_bench.plans import Noise, sweeps_of
from tests.second_bench.sizing import CHANGES, near_resonance, sized
from tests.second_bench.unknowns import drawn_specimen


def sound():
    rng = np.random.default_rng(0)
    return Rig(drawn_specimen(rng), {t.channel: Wiring.drawn(rng, t) for t in TRANSDUCERS})


@pytest.mark.parametrize("name", [name for name in EFFECTS if name != "none"])
def test_each_effect_changes_the_rig(name):
    rig = sound()
    effect = EFFECTS[name](np.random.default_rng(1))
    changed, parameters = effect.apply(rig, effect.usual)
    assert changed != rig
    assert parameters


@pytest.mark.parametrize("name", [name for name in LISTED if name not in ("channel-gain", "channel-delay")])
def test_effects_of_no_size_leave_the_linear_rig_as_it_is(name):
    rig = sound()
    changed, _ = EFFECTS[name](np.random.default_rng(1)).apply(rig, 0.0)
    assert modes_of(changed.specimen).omega[:4] == pytest.approx(modes_of(rig.specimen).omega[:4], rel=1e-6)


def test_a_mass_lowers_the_frequency_as_rayleigh_says():
    x, mass = 0.42, 1e-4
    changed = replace(BELIEVED, masses=(*BELIEVED.masses, (x, mass)))
    modes = modes_of(BELIEVED)
    shape = modes.sensors[list(BELIEVED.sensors.values()).index(x), 0]
    ratio = (modes_of(changed).omega[0] / modes.omega[0]) ** 2
    assert 1 / ratio - 1 == pytest.approx(mass * shape**2, rel=1e-2)


@pytest.mark.slow
def test_a_size_is_found_that_changes_the_response_by_some_per_cent():
    rng = np.random.default_rng(2)
    rig, effect = sound(), LISTED["cubic-stiffness"](rng)
    changed, _ = effect.apply(rig, sized(effect, rig, rng, 1.0))
    before, after = near_resonance(rig.specimen), near_resonance(changed.specimen)
    change = np.linalg.norm(after - before) / np.linalg.norm(before)
    assert 0.7 * CHANGES[0] < change < 1.5 * CHANGES[1]


def test_strength_scales_the_size():
    effect = LISTED["added-mass"](np.random.default_rng(3))
    assert sized(effect, sound(), np.random.default_rng(4), 0.33) == pytest.approx(0.33 * effect.usual)


def test_what_is_on_no_list_is_unknown(tmp_path, monkeypatch):
    short = replace(sweeps_of(1, 26.45)[0], frequencies_Hz=(25.0,), forces_N=(1.5,), measured_s=0.5)
    monkeypatch.setattr("tests.second_bench.campaign.sweeps_of", lambda mode, resonance_Hz: (short, short))
    monkeypatch.setattr("tests.second_bench.campaign.Noise", lambda: Noise(seconds=1))
    monkeypatch.setattr("tests.second_bench.campaign.sized", lambda *_: 5.0)
    folder = record(Case("magnet", 1), tmp_path)
    truth = json.loads((folder / "truth.json").read_text())
    assert (truth["cause"], truth["effect"]) == ("unknown", "magnet")
    assert set(UNLISTED).isdisjoint(LISTED)
    assert {path.name for path in folder.iterdir()} == {
        "broadband.mcap", "sweeps.mcap", "heldout.mcap", "rig.toml", "truth.json",
    }  # fmt: skip
