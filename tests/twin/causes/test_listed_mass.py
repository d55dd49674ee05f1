"""A listed mass that is gone, against the responses of the beam without it."""

import numpy as np
import pytest
from clamped_beam import LAB

from recordings.errors import InputError
from twin.diagnose.effects import acting_effects
from twin.diagnose.models import CAUSES
from twin.identify.base_fit import starting_baseline
from twin.identify.forward.broadband_response import broadband_response
from twin.identify.linear.linear_model import build_linear_model, nominal_parameters
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.responses import gather_responses
from twin.rigs import Effect

MASS = CAUSES["added-mass"]


@pytest.fixture(scope="module")
def evidence():
    return gather_responses([LAB.responses(LAB.rig, np.random.default_rng(1))], LAB.rig).evidence


def test_each_listed_mass_is_a_place(evidence):
    names = [label.get("mass") for label in MASS.labels(evidence)]
    assert names == [None, "m1", "m2", "m3", "m4", "m5", "m6"]
    mass, place = MASS.parameters(evidence, {"part": "beam", "mass": "m3"})
    assert (mass.lower, place.lower, place.upper) == (-0.12, 0.3, 0.3)
    assert place.is_known
    assert not place.is_threshold


def test_all_of_it_gone_is_the_beam_without_it(evidence):
    label = {"part": "beam", "mass": "m4"}
    modification = MASS.modification(evidence, label, {"mass_kg": -0.12, "position_m": 0.4})
    baseline = starting_baseline(evidence)
    nominal = nominal_parameters(LAB.rig)
    at_rest = type(baseline)(nominal, baseline.laws, baseline.shown)
    found = broadband_response(ResidualModel(evidence, modification), evidence.broadband[0], at_rest)
    gone = build_linear_model(LAB.without(LAB.rig, "m4"), list(evidence.outputs))
    omega = evidence.broadband[0].omega
    there = gone.response(gone.receptance(omega, nominal), omega)
    # Damping is that of the modes as assumed, whose frequencies are up to three per cent lower.
    np.testing.assert_allclose(np.abs(found), np.abs(there), rtol=0.03)


def test_where_masses_are_listed_none_is_taken_off_elsewhere(evidence):
    anywhere = MASS.parameters(evidence, {"part": "beam"})[0]
    assert anywhere.lower == 0.0  # its sensors weigh nothing


def test_an_answer_is_an_effect_again(evidence):
    told = {"part": "beam", "mass": "m3", "mass_kg": -0.1, "position_m": 0.3}
    (again,) = acting_effects(evidence, [Effect(cause="added-mass", parameters=told)])
    assert (again.label, again.values["mass_kg"]) == ({"part": "beam", "mass": "m3"}, -0.1)
    with pytest.raises(InputError, match="not one of its choices"):
        acting_effects(evidence, [Effect(cause="added-mass", parameters={**told, "mass": "m9"})])
