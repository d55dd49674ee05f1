"""The linear model in the frequency domain: responses against a dense solution, sensitivities against differences."""

from dataclasses import replace

import numpy as np
import pytest
from beam_rows import deflection, slope

from twin.identify.linear.linear_model import LinearParameters, Output, build_linear_model
from twin.rigs import load_rig

OMEGA = 2 * np.pi * np.array([12.0, 26.2, 26.45, 80.0, 156.9, 300.0, 472.0, 800.0, 890.0])


def difference(function, x, step):
    """Central differences, extrapolated twice (Romberg)."""
    a, b, c = ((function(x + h) - function(x - h)) / (2 * h) for h in (step, step / 2, step / 4))
    ab, bc = (4 * b - a) / 3, (4 * c - b) / 3
    return (16 * bc - ab) / 15


@pytest.mark.parametrize("changed", [False, True])
def test_responses_are_those_of_all_degrees_of_freedom_at_once(steel_model, steel_dense, other_base, changed):
    """With changes of the moduli as large as a softened joint's, another one at each frequency."""
    rng = np.random.default_rng(1)
    dE = -other_base.E * rng.uniform(0, 0.7, (len(OMEGA), 1)) if changed else 0.0
    dG = other_base.G * 5j * rng.uniform(0, 1, (len(OMEGA), 1)) if changed else 0.0
    H = steel_model.response(steel_model.receptance(OMEGA, other_base, dE=dE, dG=dG), OMEGA)
    np.testing.assert_allclose(H, steel_dense.accelerance(OMEGA, other_base, dE, dG), rtol=5e-6)


@pytest.mark.parametrize("entry", range(14))
def test_sensitivities_are_derivatives_of_the_response(steel_model, other_base, entry):
    def response(value):
        vector = other_base.vector.copy()
        vector[entry] = value
        return steel_model.response(steel_model.receptance(OMEGA, LinearParameters.from_vector(vector)), OMEGA)

    R = steel_model.receptance(OMEGA, other_base)
    analytic = steel_model.sensitivity(R, OMEGA, other_base)[:, :, entry]
    # A frequency discrepancy or a modulus moves sharp resonances: their steps are small beside the resonances' width.
    step = {0: 1e-3, 1: 1e-2, 2: 1e-3, 3: 1e-2}.get(entry, 2e-2 if entry < 9 else 5e-5)
    numeric = difference(response, other_base.vector[entry], step)
    # Far from a mode its parameters move nothing, and a difference is round-off of the response itself.
    allowed = 1e-6 * np.abs(analytic) + 1e-11 * np.abs(response(other_base.vector[entry])) / step
    assert np.all(np.abs(analytic - numeric) < allowed)
    assert np.max(np.abs(analytic) / allowed) > 1e5


def test_a_vector_of_base_parameters_goes_there_and_back(other_base):
    again = LinearParameters.from_vector(other_base.vector)
    np.testing.assert_allclose(again.vector, other_base.vector, rtol=1e-14)
    np.testing.assert_allclose([again.E, again.G], [other_base.E, other_base.G], rtol=1e-13)
    assert len(LinearParameters.blocks(1)) == len(other_base.vector)


def test_quantities_and_directions_differ_by_powers_of_j_omega(steel_model, other_base):
    tip = load_rig("steel-lap-joint").place_of("acc2")
    outputs = [Output("a", q, tip, sign) for q, sign in (("displacement", 1), ("velocity", 1), ("acceleration", -1))]
    model = build_linear_model(load_rig("steel-lap-joint"), outputs)
    H = model.response(model.receptance(OMEGA, other_base), OMEGA)
    known = steel_model.response(steel_model.receptance(OMEGA, other_base), OMEGA)[:, 1]
    jw = 1j * OMEGA
    np.testing.assert_allclose(H, np.stack([known / jw**2, known / jw, -known], axis=1), rtol=1e-9)


def test_loss_and_damping_take_energy_out(steel_model, other_base):
    """Of any passive rig the drive point's velocity has a part in phase with the force; a loss makes it larger."""

    def mobility(base):
        drive = steel_model.ports.drive
        return (1j * OMEGA * steel_model.receptance(OMEGA, base)[:, drive, drive]).real

    assert np.all(mobility(other_base) > 0)
    between = [0, 3, 5]
    for field in ("loss_E", "loss_G"):
        more = replace(other_base, **{field: 2 * getattr(other_base, field)})
        assert np.all(mobility(more)[between] > mobility(other_base)[between])


def test_other_ports_change_nothing_about_the_first_ones(steel_model, other_base):
    rows = np.array([deflection(steel_model.structure, 0.2), slope(steel_model.structure, 0.4)])
    more = steel_model.with_ports(rows)
    R, plain = more.receptance(OMEGA, other_base), steel_model.receptance(OMEGA, other_base)
    count = len(steel_model.ports.outer)
    assert more.ports.extra == slice(count, count + 2)
    np.testing.assert_allclose(R[:, :count, :count], plain[:, :count, :count], rtol=1e-12)
    replaced = more.with_ports(rows[:1])
    assert replaced.ports.extra == slice(count, count + 1)
