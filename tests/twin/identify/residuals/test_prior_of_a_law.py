"""What a joint's law is expected to be, before any data."""

from dataclasses import replace

import numpy as np
import pytest

from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.linear.linear_model import Output, build_linear_model, nominal_parameters
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.residuals.error_model import SOUND
from twin.identify.residuals.residual_model import ResidualModel
from twin.rigs import load_rig

KNOTS = np.geomspace(1e-8, 1e-5, 20)


@pytest.fixture
def expected(evidence):
    """Standard deviations of a rig's softening over E' and of its loss over G', at the knots."""

    def of(name, channel="acc1"):
        rig = load_rig(name)
        model = build_linear_model(rig, [Output(channel, "acceleration", rig.place_of(channel))])
        baseline = BaselineParameters(nominal_parameters(rig), (LayerLaw.zero(KNOTS, KNOTS),))
        elsewhere = replace(evidence, rig=rig, model=model, outputs=model.outputs, reference=0, broadband=())
        precision = ResidualModel(elsewhere).inferred_precision(baseline, SOUND)
        curves = (baseline.softening(0), baseline.base.E[0]), (baseline.loss(0), baseline.base.G[0])
        return [np.sqrt(np.diag(np.linalg.inv(precision[own, own]))) / modulus for own, modulus in curves]

    return of


def test_a_joint_softens_by_its_own_normal_modulus_and_loses_by_its_own_shear_modulus(expected):
    """The hybrid joint's first mode hardly shears it: by what damps that its loss would be a thousand times G'."""
    for steel, hybrid in zip(expected("steel-lap-joint"), expected("hybrid-joint"), strict=True):
        np.testing.assert_allclose(hybrid, steel, rtol=1e-6)


def test_a_joint_may_lose_many_times_its_shear_modulus(expected):
    """The shipped steel joint's does, and damps no more than a tenth of E' would."""
    softening, loss = expected("steel-lap-joint")
    assert np.max(loss) > 5
    assert np.max(softening) < np.max(loss)
