"""A rig whose file carries identified functions g1, g2 of amplitude: the bench has them as its describing functions."""

from __future__ import annotations

import numpy as np
import pytest

from twin.bench import open_bench
from twin.joint import describing_function
from twin.rigs import LawTable, load_rig

RIG = load_rig("steel-lap-joint")
X = np.array([0.0, 5e-4, 1e-3, 2e-3, 3e-3, 4e-3])
G1 = 2.0e8 * X / (X + 2e-3)
G2 = 8.0e8 * (X / 4e-3) ** 2


def with_law(**change):
    table = LawTable(channel="acc2", amplitude_m=list(X), softening=list(G1), loss=list(G2)).model_copy(update=change)
    return RIG.model_copy(update={"joint": RIG.joint.model_copy(update={"law": table})})


def test_describing_functions_return_the_tables():
    built = open_bench(with_law()).built
    softening = describing_function(built.law.normal.path, X[1:] * built.opening_per_m)
    np.testing.assert_allclose(-softening.real, G1[1:], rtol=2e-3)
    np.testing.assert_allclose(softening.imag, 0.0, atol=1e-6 * G1[-1])
    np.testing.assert_allclose(built.law.loss.stiffness(X * built.slip_per_m).imag, G2, rtol=1e-3, atol=1e4)


def test_amplitudes_are_those_of_the_named_channel():
    tip, middle = (open_bench(with_law(channel=channel)).built for channel in ("acc2", "acc1"))
    o = 1e-3 * tip.opening_per_m
    # The same opening is a smaller amplitude at the middle, so the same table softens it less.
    assert -tip.law.normal.stiffness(np.array(o)).real > -middle.law.normal.stiffness(np.array(o)).real


def test_a_law_that_no_passive_layer_has_is_refused():
    with pytest.raises(ValueError, match="tangent modulus negative"):
        open_bench(with_law(softening=list(3e8 * (X / 4e-3) ** 3)))
