"""What one step a sample leaves of error: the marched rig beside scipy's integrator on the same reduced equations."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from twin.bench import JointLaw, open_bench, steel_law
from twin.bench.linear import to_poles
from twin.bench.marching import Elements, coefficients, integrate
from twin.rigs import load_rig, moduli_at

RATE_Hz = 25600.0
SECONDS = 0.2
"""Of rig time."""
FREQUENCY_Hz, VOLTS = 26.3, 1.6


def _hyperelastic_rig() -> tuple[Any, Any, float]:
    """The shaken rig with a memoryless joint, which any integrator can march: linear part, law, scale of its force."""
    rig = load_rig("steel-lap-joint")
    law = steel_law(moduli_at(rig, "120N")[0].normal_modulus).normal
    built = open_bench(rig, joint_law=JointLaw(law)).built
    return built.rig(0.0, RATE_Hz), law, built.elements_[0].scale


@cache
def step_error() -> float:
    """Of the joint's opening over :data:`SECONDS` at one step a sample, over its largest."""
    rig, law, scale = _hyperelastic_rig()
    c = coefficients(to_poles(rig), 1.0 / RATE_Hz)
    # The opening is the local coordinate, and the channel that is told.
    step = replace(c, C=np.vstack([c.C[:1], c.C[:1]]), D=np.vstack([c.D[:1], c.D[:1]])).packed(1, 0)
    count = round(SECONDS * RATE_Hz)
    voltage = VOLTS * np.sin(2 * np.pi * FREQUENCY_Hz * np.arange(count) / RATE_Hz)
    first, none = np.array([0]), np.array([-1])
    element = Elements(np.array([law.kind]), first, none, np.array([scale]), law.parameters[None], np.zeros((1, 1)))
    out = np.empty((count, 1))

    integrate(step, element, np.zeros_like(step.decay), np.zeros(1), np.zeros(2), voltage, out)
    exact = _integrated()
    return float(np.abs(out[:, 0] - exact).max() / np.abs(exact).max())


def _integrated(rtol: float = 1e-9) -> Any:
    """The joint's opening at the same instants by RK45."""
    rig, law, scale = _hyperelastic_rig()
    A, b_V, b_f = rig.A, rig.B[:, 0], rig.B[:, 1]
    c, d_V, d_f = rig.C[0], rig.D[0, 0], rig.D[0, 1]
    k, e0, spring = law.parameters

    def opening(p: float) -> tuple[float, float]:
        """Opening and force that agree through the residual flexibility, o = p + d_f f(o)."""
        o = p
        for _ in range(20):
            q = 1.0 / (1.0 + (o / e0) ** 2)
            force = scale * (k * q**0.5 + spring) * o
            r = o - p - d_f * force
            if abs(r) <= 1e-13 * abs(o):
                break
            o -= r / (1.0 - d_f * scale * (k * q**1.5 + spring))
        return o, force

    def slope(t: float, x: Any) -> Any:
        volts = VOLTS * np.sin(2 * np.pi * FREQUENCY_Hz * t)
        _, force = opening(float(c @ x) + d_V * volts)
        return A @ x + b_V * volts + b_f * force

    time_s = np.arange(round(SECONDS * RATE_Hz)) / RATE_Hz
    x = solve_ivp(slope, (0.0, time_s[-1]), np.zeros(len(A)), t_eval=time_s, rtol=rtol, atol=1e-3 * rtol * e0).y
    volts = VOLTS * np.sin(2 * np.pi * FREQUENCY_Hz * time_s)
    return np.array([opening(p)[0] for p in c @ x + d_V * volts])
