"""Diagnosis from frequency responses alone, on responses in closed form that scatter from case to case."""

import numpy as np
import pytest
from clamped_beam import LAB

from recordings.errors import InputError
from twin.diagnose import DiagnosisOptions, diagnose_data, responses_data
from twin.diagnose.models import CAUSES
from twin.identify.responses.updating import update_rig

SCATTER = 0.003
SOME = {
    name: CAUSES[name] for name in ("added-mass", "beam-modulus", "clamp-compliance", "channel-gain", "cubic-stiffness")
}


def diagnosed(file, model):
    data = responses_data([file], model, causes=SOME)
    return diagnose_data(data, out=None, options=DiagnosisOptions(causes=SOME))


@pytest.fixture(scope="module")
def lab():
    return LAB


@pytest.fixture(scope="module")
def truth(lab):
    """Softer than believed, and shown a little otherwise."""
    return lab.with_modulus(lab.rig, 0.97, elements=42)


@pytest.fixture(scope="module")
def model(lab, truth):
    rng = np.random.default_rng(21)
    return update_rig([lab.responses(truth, rng, scatter=SCATTER) for _ in range(3)], lab.rig, scatter=SCATTER).rig


@pytest.mark.slow
@pytest.mark.parametrize("name", ["m1", "m3", "m6"])
def test_a_mass_that_was_removed_is_named(lab, truth, model, name):
    rng = np.random.default_rng(100 + int(name[1]))
    file = lab.responses(lab.without(truth, name), rng, scatter=SCATTER)
    found = diagnosed(file, model)
    first = found.causes[0]
    assert (found.verdict, first.cause, first.parameters["mass"]) == ("explained", "added-mass", name)
    mass = first.parameters["mass_kg"]
    assert mass.value == pytest.approx(-0.12, abs=max(3 * mass.std, 0.02))
    assert found.notes[0].startswith("frequency responses alone have no force level")
    unseen = next(one for one in found.excluded if one.cause == "cubic-stiffness")
    assert unseen.limit_95 is None
    assert {one.cause for one in found.excluded} >= {"beam-modulus", "clamp-compliance"}


@pytest.mark.slow
@pytest.mark.parametrize("seed", [201, 202])
def test_the_same_state_once_more_is_none(lab, truth, model, seed):
    file = lab.responses(truth, np.random.default_rng(seed), scatter=SCATTER)
    assert diagnosed(file, model).verdict == "none"


def test_a_file_of_other_channels_is_one_line(lab):
    file = lab.responses(lab.rig, np.random.default_rng(1), channels=("mid", "tip"))
    other = lab.rig.model_copy(
        update={
            "sensor": [
                s.model_copy(update={"channel": f"x-{s.channel}"}) if s.quantity != "force" else s
                for s in lab.rig.sensor
            ]
        }
    )
    with pytest.raises(InputError, match="none of its responses"):
        responses_data([file], other)
