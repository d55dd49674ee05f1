"""What small forces at ports change, all at once, against whole models with each of them: central differences."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.models import CAUSES
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.measured_data import gather_data
from twin.identify.model_modification import ModelModification
from twin.identify.nonlinear import local_forces
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.port_forces import PortModel, acts_at_ports, port_changes
from twin.identify.residuals.residual_model import ResidualModel
from twin.rigs import load_rig

RIG = load_rig("steel-lap-joint")
SMALL = {
    "added-mass": {"mass_kg": 1e-7, "position_m": 0.3},
    "viscous-damper": {"damping_Ns_per_m": 1e-6, "position_m": 0.2},
    "stiffness-loss": {"factor": 1 - 1e-6, "position_m": 0.3},
    "cubic-stiffness": {"stiffness_N_per_m3": 1e3, "position_m": 0.4},
    "ground-friction": {"force_N": 1e-6, "position_m": 0.4, "travel_m": 2e-6},
    "air-drag": {"coefficient_Ns2_per_m3": 1e-4},
}
LEAST = 2e-4
"""Of a change, in deviations: rounding is a part of the residuals themselves."""
BESIDE = {
    "nothing": {},
    "a-stop": {"ground-stop": {"stiffness_N_per_m": 300.0, "gap_m": 2e-4, "position_m": 0.35}},
    "a-yielding-clamp": {"clamp-compliance": {"rotational_rad_per_Nm": 1e-5}},
    "a-slap": {"joint-slap": {"stiffness_factor": 0.8, "gap_m": 1e-7}},
}


@pytest.fixture(scope="module")
def measured(campaign):
    """Frequencies, forces, responses and noise of recordings."""
    return gather_data([read_run(campaign / f"{name}.mcap") for name in ("random", "sweeps")], RIG)


@pytest.fixture(scope="module")
def baseline():
    """A softening, losing joint."""
    base = replace(nominal_parameters(RIG), loss_E=0.01, loss_G=0.02)
    opening, slip = np.geomspace(5e-8, 8e-6, 6), np.geomspace(2e-8, 2e-6, 7)
    law = LayerLaw(opening, slip, base.E * np.linspace(0.02, 0.3, 6), base.G * np.linspace(0.1, 2.0, 7))
    return BaselineParameters(base, (law,))


def modified(measured, causes):
    whole = ModelModification()
    for name, values in causes.items():
        cause = CAUSES[name]
        whole = whole.merged(cause.modification(measured, cause.labels(measured)[-1], cause.from_reported(values)))
    return whole


@pytest.mark.parametrize("beside", BESIDE)
def test_all_changes_at_once_are_those_of_each_whole_model(measured, baseline, monkeypatch, beside):
    monkeypatch.setattr(local_forces, "NEWTON", local_forces.NEWTON._replace(settled=1e-13))
    whole = modified(measured, BESIDE[beside])
    harmonics = harmonic_residuals(ResidualModel(measured), baseline)  # of the mesh that is assumed
    held = ResidualModel(measured, whole, harmonics).linearisation(baseline)
    plain = ResidualModel(measured, whole, harmonics, held=held)
    small = [modified(measured, {name: values}) for name, values in SMALL.items()]
    assert all(acts_at_ports(each) for each in small)

    with_ports = partial(PortModel, measured, whole, harmonics, held=held)

    def left_by(modification):
        changed = ResidualModel(measured, whole.merged(modification), harmonics, held=held)
        before, start = plain.added_beyond(held, baseline)
        more = changed.added_beyond(held, baseline, start=start)[0] - before
        return changed.holding(held.adding(more)).evaluate(baseline, sensitivities=False)

    before = left_by(ModelModification())
    found = port_changes(with_ports, plain.model.structure, baseline, [((each, 1.0),) for each in small])
    for name, modification, change in zip(SMALL, small, found, strict=True):
        expected = before.residual - left_by(modification).residual
        for block, rows in before.blocks:
            # What else moves a slap changes its even harmonics too little to be taken into account.
            near = 0.04 if block == "harmonics" and beside == "a-slap" else 3e-3
            size = max(np.max(np.abs(expected[rows])), LEAST)
            assert np.max(np.abs(change[rows] - expected[rows])) < near * size, (name, block)


def test_a_further_force_begins_where_the_rig_moves_without_it(measured, baseline):
    """Not where nothing acts: what harmonics add is known about the balance alone, and may be steep."""
    held = ResidualModel(measured).linearisation(baseline).balance
    growth = np.einsum("sp,pq->spq", 100.0 * held.stiffness[:, :3], np.eye(3))
    steep = replace(held, added=replace(held.added, growth=growth))
    beside = ResidualModel(measured, modified(measured, {"cubic-stiffness": SMALL["cubic-stiffness"]}))
    found = beside.step_receptance(baseline, held=steep)[2]
    assert np.max(found.unsettled) < 1e-8
    np.testing.assert_allclose(found.motion[:, : held.motion.shape[1]], held.motion, rtol=1e-3)
    omega = beside.step_omega(baseline)
    free = beside.receptance(omega, baseline.base, beside.step_times, inner=False, points=True)
    around, added = beside.surroundings(free, omega), steep.added.of_ports(len(beside.moving))
    elsewhere = beside.local.balance(baseline.laws, omega, around, added=added).motion[:, : held.motion.shape[1]]
    assert np.max(np.abs(elsewhere / held.motion - 1)) > 0.1, "begun without any force, another balance is found"
