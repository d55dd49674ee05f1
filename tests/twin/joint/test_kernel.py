"""The laws as compiled kernels see them against their own formulas."""

from __future__ import annotations

import numpy as np
import pytest
from law_paths import law_path

from twin.joint import (
    Cubic,
    ForceTable,
    Linear,
    PiecewiseLinearContact,
    Polynomial,
    QuadraticDrag,
    RunningLoss,
    Saturating,
    iwan,
)
from twin.joint.kernel import evaluate, remember

STEPS = 2.0 * np.sin(np.linspace(0, 9, 700)) * np.linspace(0.2, 1.0, 700)
LAWS = [
    Linear(3.0),
    Cubic(2.0),
    Saturating(2.0, 0.8, -0.5),
    PiecewiseLinearContact((1.0, 2.0, 6.0), (0.5, 0.0, -0.5), (-1, -1, -1)),
    iwan(2.0, 1.5, sliders=5),
    Polynomial((-1.0, 0.5), (0.3, 0.2), stick=0.05),
    Polynomial((-1.0, 0.5), (0.3, 0.2)),
    ForceTable.of(np.tanh, limit_m=1.5),
    QuadraticDrag(0.3),
]


def marched(law, evaluate_one, remember_one):
    p = np.zeros((2, len(law.parameters)))
    p[1] = law.parameters
    state = np.zeros((2, max(law.states, 1)))
    force, tangent = np.empty_like(STEPS), np.empty_like(STEPS)
    for i, e in enumerate(STEPS):
        force[i], tangent[i] = evaluate_one(law.kind, p, state, 1, e)
        remember_one(law.kind, p, state, 1, e, 0.0, 1e-3)
    return force, tangent


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_force_follows_the_laws_formula(law):
    force, _ = marched(law, evaluate, remember)
    np.testing.assert_allclose(force, law_path(law, STEPS), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(force, law.force_history(STEPS), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_compiled_and_plain_agree(law):
    compiled, plain = marched(law, evaluate, remember), marched(law, evaluate.py_func, remember.py_func)
    np.testing.assert_allclose(compiled, plain, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize(
    "law", [law for law in LAWS if law.kind != LAWS[6].kind or law.stick], ids=lambda law: type(law).__name__
)
def test_tangent_is_the_slope_of_the_force(law):
    p = law.parameters[None]
    state = np.zeros((1, max(law.states, 1)))
    for e in (-1.3, -0.31, 0.123, 0.77):
        d = 1e-7
        slope = (evaluate(law.kind, p, state, 0, e + d)[0] - evaluate(law.kind, p, state, 0, e - d)[0]) / (2 * d)
        assert evaluate(law.kind, p, state, 0, e)[1] == pytest.approx(slope, rel=1e-5, abs=1e-6)


def test_running_loss_turns_a_sine_by_a_quarter_at_any_rate():
    law = RunningLoss(5.0, np.linspace(0.0, 2.0, 11), tau_s=0.3)
    for frequency in (10.0, 80.0):
        step, w = 1e-4, 2 * np.pi * frequency
        t = step * np.arange(40000)
        x, v = 3.0 * np.sin(w * t), 3.0 * w * np.cos(w * t)
        p, state = law.parameters[None], np.zeros((1, law.states))
        force = np.empty_like(t)
        for i in range(len(t)):
            force[i] = evaluate(law.kind, p, state, 0, v[i])[0]
            remember(law.kind, p, state, 0, v[i], x[i], step)
        period = slice(-round(1 / frequency / step) * 4, None)
        found = 2 * np.mean(force[period] * np.exp(-1j * w * t[period])) / (3.0 / 1j)
        assert found.imag == pytest.approx(1.2, rel=0.01)
        assert abs(found.real) < 0.003 * 1.2
