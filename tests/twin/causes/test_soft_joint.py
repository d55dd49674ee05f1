"""A joint softer than assumed: what the data cannot part is parted by the priors, at once."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from twin.causes.joint_stiffness.model import JointStiffness
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.linear.linear_fit import MODULI_STD
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.rigs import load_rig


def test_the_products_stay_and_the_prior_is_as_probable_as_it_can_be():
    rig = load_rig("steel-lap-joint")
    evidence = SimpleNamespace(rig=rig, joints=rig.joints, preload="120N")
    nominal = nominal_parameters(rig, preload="120N")
    knots = np.array([1e-7, 1e-6])
    softer = replace(nominal, E=0.8 * nominal.E, G=0.6 * nominal.G)
    start = BaselineParameters(softer, (LayerLaw.zero(knots, knots),))
    values = {"log_normal_factor": -0.1, "log_shear_factor": 0.0}
    baseline, shared = JointStiffness().shared(evidence, {}, start, values)
    (normal, shear) = JointStiffness().parameters(evidence, {})
    for modulus, parameter in (("E", normal), ("G", shear)):
        before = np.log(getattr(start.base, modulus)[0]) + values[parameter.name]
        own = np.log(getattr(baseline.base, modulus)[0] / getattr(nominal, modulus)[0])
        assert np.log(getattr(baseline.base, modulus)[0]) + shared[parameter.name] == pytest.approx(before)
        # Along the line the penalty's slope is zero.
        assert own / MODULI_STD**2 == pytest.approx(shared[parameter.name] / parameter.scale**2)
    again = JointStiffness().shared(evidence, {}, baseline, shared)
    assert again[1] == pytest.approx(shared)
