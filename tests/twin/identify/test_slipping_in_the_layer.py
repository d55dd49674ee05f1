"""A slider under a layer that softens and loses: its harmonics meet the layer as the law leaves it, and move it.

By harmonic balance of the bench's own model, whose mesh is another, with all harmonics of all coordinates.
"""

from __future__ import annotations

import numpy as np
import pytest

from twin.bench import BenchSetup, open_bench
from twin.diagnose.fit_problem import CauseHypothesis, modification_of
from twin.diagnose.fitted_model import FitOptions, fit_model
from twin.diagnose.models import CAUSES
from twin.identify.base_fit import law_from_steps
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.residuals.error_model import SOUND, continuation
from twin.identify.residuals.residual_model import ResidualModel
from twin.response import HarmonicBalance
from twin.rigs import Effect, load_rig

STEEL = load_rig("steel-lap-joint")
STIFFNESS_N_per_m, SLIP_FORCE_N, ELEMENT = 1.75e8, 41.0, "1"
UP_Hz = np.linspace(25.6, 27.2, 49)
FORCES_N = (1.5, 3.0, 6.0)
NOISE = 2e-5


@pytest.fixture(scope="module")
def slipping(build, steel_model):
    """Steps of a rig in whose joint a slider sits, which the largest force moves through many times its slip."""
    slider = Effect(
        cause="joint-friction",
        parameters={"layer_element": ELEMENT, "stiffness_N_per_m": STIFFNESS_N_per_m, "slip_force_N": SLIP_FORCE_N},
    )
    rig = STEEL.model_copy(update={"effect": [slider]})
    bench = open_bench(rig, setup=BenchSetup(drive="force", noise=False, converter=False, layout=rig.layout()))
    at = [[channel.name for channel in bench.channels].index(name) for name in ("force", "acc1", "acc2")]
    balance = HarmonicBalance(bench.built, harmonics=9)
    solutions = [s for force in FORCES_N for s in balance.sweep(UP_Hz, force)]
    channels = np.array([s.channels[at, 1:8] for s in solutions])
    omega = 2 * np.pi * np.array([s.frequency_Hz for s in solutions])
    return build.evidence(steel_model, build.steps(omega, channels[:, 0], channels[:, 1:], relative=NOISE), [])


def test_with_the_true_slider_a_smooth_law_fits_the_steps(slipping):
    """Where it begins to slip as well; ripples that meet the linear layer leave 1.6e-3 there."""
    cause = CAUSES["joint-friction"]
    values = cause.from_reported({"stiffness_N_per_m": STIFFNESS_N_per_m, "slip_force_N": SLIP_FORCE_N})
    slider = CauseHypothesis(cause, {"layer_element": ELEMENT}, values, {})
    modification = modification_of(slipping, (slider,))
    start = law_from_steps(ResidualModel(slipping, modification), nominal_parameters(STEEL))
    for errors in continuation(SOUND):
        start = fit_model(slipping, None, start, (slider,), errors=errors, options=FitOptions(frozen=True)).baseline
    fitted = ResidualModel(slipping, modification)
    R, omega, balance = fitted.step_receptance(start, inner=False)
    steps = slipping.steps
    missed = np.abs(fitted.responses(R, omega) * steps.force[:, :1] / steps.response[:, :, 0] - 1)[:, 0]
    slip = np.abs(balance.motion[:, -1]) / values["slip_m"]
    begins = (slip > 0.8) & (slip < 3.0)
    assert np.max(slip) > 4
    assert np.sum(begins) > 5
    assert np.sqrt(np.mean(missed[begins] ** 2)) < 6e-4
