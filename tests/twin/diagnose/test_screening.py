"""Which causes a search tries, and from which values."""

from __future__ import annotations

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.fitted_model import CauseHypothesis
from twin.diagnose.models import CAUSES
from twin.diagnose.score import Score
from twin.diagnose.screening import screening
from twin.diagnose.successive_halving import LEAST_SCORE
from twin.identify.measured_data import gather_data
from twin.rigs import load_rig


@pytest.fixture(scope="module")
def evidence(campaign):
    return gather_data(
        [read_run(campaign / f"{name}.mcap") for name in ("random", "sweeps")], load_rig("steel-lap-joint")
    )


def score(name, gain, values, **label):
    return Score(CauseHypothesis(CAUSES[name], label, values, {}), gain, np.zeros(3))


def friction(gain, stiffness):
    return [
        score("joint-friction", gain, {"stiffness_N_per_m": stiffness, "slip_m": slip}, layer_element="3")
        for slip in (1e-7, 3e-7)
    ]


MASS = score("added-mass", 50 * LEAST_SCORE, {"mass_kg": 0.01, "position_m": 0.2})


@pytest.mark.parametrize("gain", [0.0, 20 * LEAST_SCORE], ids=["promising nothing", "promising a gain"])
def test_friction_is_tried_at_its_usual_size_whatever_its_first_order_promises(evidence, gain):
    """The base family's law imitates it: beside that law a little more of it may have the wrong sign."""
    tried = screening(evidence, [MASS, *friction(gain, stiffness=5e6)])
    parameters = CAUSES["joint-friction"].parameters(evidence, {"layer_element": "3"})
    (usual,) = (p.scale for p in parameters if p.name == "stiffness_N_per_m")
    assert [hypothesis.cause.name for hypothesis in tried] == ["added-mass", "joint-friction", "joint-friction"]
    assert [hypothesis.values["stiffness_N_per_m"] for hypothesis in tried[1:]] == [usual, usual]
    assert [hypothesis.values["slip_m"] for hypothesis in tried[1:]] == [1e-7, 3e-7]


def test_nothing_is_tried_where_nothing_promises_a_gain(evidence):
    """A clean rig costs no search, and gives chance nothing to find."""
    slight = score("added-mass", 0.5 * LEAST_SCORE, {"mass_kg": 1e-4, "position_m": 0.2})
    assert screening(evidence, [slight, *friction(0.0, stiffness=1.0)]) == []


def test_a_resonator_is_tried_at_frequencies_far_apart_however_well_their_neighbours_do(evidence):
    """One tuned above the first modes looks, to first order, less like itself than like one between them."""
    values = {"mass_kg": 0.003, "damping_ratio": 0.03}
    tuned = [
        score("attached-resonator", gain * LEAST_SCORE, {**values, "frequency_Hz": f, "position_m": x})
        for gain, f, x in ((90, 90.0, 0.28), (80, 64.0, 0.28), (70, 46.0, 0.14), (60, 126.0, 0.28), (50, 247.0, 0.42))
    ]
    assert [hypothesis.values["frequency_Hz"] for hypothesis in screening(evidence, tuned)] == [90.0, 64.0, 247.0]
