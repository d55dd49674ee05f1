"""Modes that responses show are found whatever the model has wrong, and a model is updated to them."""

import numpy as np
import pytest

from twin.identify.responses import gather_responses
from twin.identify.responses.updating import update_rig
from twin.structure import assemble, normal_modes

SEEDS = (1, 2)


def natural_Hz(rig, count=4):
    structure = assemble(rig)
    return normal_modes(structure.M, structure.stiffness([], []), count).omega / (2 * np.pi)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("factor", [0.92, 1.08])
def test_resonances_are_followed_with_a_model_off_by_four_per_cent(lab, seed, factor):
    file = lab.responses(lab.rig, np.random.default_rng(seed), shown=0.1)
    found = gather_responses([file], lab.with_modulus(lab.rig, factor))
    base = found.evidence.linear.base
    model_Hz = found.evidence.model.basis.omega[:4] / (2 * np.pi)
    np.testing.assert_allclose(
        model_Hz * np.sqrt(1 + 2 * base.frequency_discrepancy[:4]), natural_Hz(lab.rig), rtol=3e-4
    )
    np.testing.assert_allclose(base.zeta[:4], 0.004, rtol=0.05)
    np.testing.assert_array_equal(found.shown, [True, True, True, True, False])


def test_what_a_sensor_shows_of_each_mode_is_found(lab):
    rng = np.random.default_rng(3)
    rng_of_shown = np.random.default_rng(3)
    file = lab.responses(lab.rig, rng, shown=0.05)
    count = len(normal_modes(assemble(lab.rig).M, assemble(lab.rig).stiffness([], [])).omega)
    rng_of_shown.standard_normal(count)  # the frequencies' draws come first
    shown = 1 + 0.05 * rng_of_shown.standard_normal(count)
    found = gather_responses([file], lab.rig)
    np.testing.assert_allclose(found.factors[0][:4], shown[:4], atol=0.01)


def test_scatter_is_told_from_three_cases(lab):
    rng = np.random.default_rng(4)
    files = [lab.responses(lab.rig, rng, scatter=0.003) for _ in range(6)]
    found = gather_responses(files, lab.rig)
    assert found.scatter == pytest.approx(0.003, rel=0.4)
    assert found.evidence.frequency_scatter == pytest.approx(found.scatter / 6**0.5)
    assert any("scatter by 0." in note for note in found.notes)
    assert gather_responses(files, lab.rig, scatter=0.002).scatter == 0.002


def test_a_modulus_is_updated_and_what_is_left_is_kept(lab):
    rng = np.random.default_rng(5)
    truth = lab.with_modulus(lab.rig, 0.95, elements=56)
    files = [lab.responses(truth, rng, scatter=0.002, channels=("mid", "tip")) for _ in range(3)]
    found = update_rig(files, lab.rig, scatter=0.002)
    modulus = next(one for one in found.values if one.name == "youngs_modulus beam")
    assert modulus.told
    assert modulus.after.value == pytest.approx(0.95 * modulus.before.value, abs=3 * modulus.after.std)
    assert modulus.after.std < 0.5 * modulus.before.std
    assert all(abs(pair.after_Hz / pair.measured_Hz - 1) < 0.004 for pair in found.pairs)
    assert all(pair.mac_after > 0.99 for pair in found.pairs)
    kept = found.rig.natural_frequencies
    np.testing.assert_allclose(
        natural_Hz(found.rig) * np.sqrt(1 + 2 * np.array(kept.offset[:4])),
        [p.measured_Hz for p in found.pairs],
        rtol=1e-4,
    )
    assert [len(sensor.modal_factor) for sensor in found.rig.sensor] == [0, 5, 5]
    # The model that was kept reproduces the responses: nothing is left to be followed.
    again = gather_responses(files, found.rig)
    np.testing.assert_allclose(again.evidence.linear.base.frequency_discrepancy[:4], kept.offset[:4], atol=2e-4)
    np.testing.assert_allclose(
        np.array(again.factors)[:, :4], [s.modal_factor[:4] for s in found.rig.sensor[1:]], rtol=0.01
    )
