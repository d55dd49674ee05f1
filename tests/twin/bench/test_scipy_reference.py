"""A small rig marched by the bench's kernel against scipy's adaptive integrator at a tight tolerance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from twin.bench.linear import LinearRig, to_poles
from twin.bench.marching import Elements, coefficients, integrate
from twin.joint import Cubic, Saturating, one_sided

STEP = 1.0 / 100000.0
M, K, C = 0.2, 5000.0, 0.5
LAWS = [Cubic(4e9), Saturating(4000.0, 2e-4, -2000.0), one_sided(5000.0, 3e-4)]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_an_oscillator_with_a_law_to_1e_5(law):
    A = np.array([[0.0, 1.0], [-K / M, -C / M]])
    B = np.array([[0.0, 0.0], [1 / M, -1 / M]])
    row = np.array([[1.0, 0.0]])
    rig = LinearRig(A, B, np.vstack([row, row]), np.zeros((2, 2)))
    c = coefficients(to_poles(rig), STEP)
    count = 20000
    time = STEP * np.arange(count)

    def force(t):
        return 3.0 * np.sin(2 * np.pi * 25.0 * t)

    out = np.empty((count, 1))
    step, first, none = c.packed(1, 0), np.array([0]), np.array([-1])
    element = Elements(np.array([law.kind]), first, none, np.ones(1), law.parameters[None], np.zeros((1, 1)))
    failures = integrate(step, element, np.zeros_like(step.decay), np.zeros(1), np.zeros(2), force(time), out)
    assert failures == 0
    exact = solve_ivp(
        lambda t, x: A @ x + B @ [force(t), law.force_history(x[:1])[0]],
        (0.0, time[-1]), [0.0, 0.0], t_eval=time, method="DOP853", rtol=1e-10, atol=1e-14, max_step=2e-4,
    ).y[0]  # fmt: skip
    assert np.abs(law.force_history(exact)).max() > 0.1 * np.abs(K * exact).max()
    assert np.abs(out[:, 0] - exact).max() < 1e-5 * np.abs(exact).max()
