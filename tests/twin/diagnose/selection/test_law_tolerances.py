"""What joints' laws leave out: its directions against differences of the residual, and what they cannot be."""

from dataclasses import replace

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.selection.law_tolerances import law_tolerances
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.jenkins import jenkins_harmonics
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.measured_data import gather_data
from twin.identify.nonlinear.joint_law import LayerLaw, choose_knots
from twin.identify.residuals.harmonics import by_stiffness, friction_harmonics, harmonic_residuals
from twin.identify.residuals.linearisation import with_more
from twin.identify.residuals.residual_model import ResidualModel
from twin.joint import Saturating
from twin.rigs import load_rig

RIG = load_rig("steel-lap-joint")


@pytest.fixture(scope="module")
def measured(campaign):
    return gather_data([read_run(campaign / f"{name}.mcap") for name in ("random", "sweeps")], RIG)


@pytest.fixture(scope="module")
def softening():
    """A joint that saturates, and so has harmonics."""
    knots = choose_knots(np.array([1e-5]), 30)
    softening = -Saturating(1.5e8, 2e-6, -1.5e8).describing_function(knots).real
    law = LayerLaw(knots, knots, softening, 0.1 * softening)
    return BaselineParameters(replace(nominal_parameters(RIG), loss_E=0.02, loss_G=0.05), (law,))


@pytest.fixture(scope="module")
def linear(softening):
    (law,) = softening.laws
    return replace(softening, laws=(LayerLaw.zero(law.opening_knots, law.slip_knots),))


def added_by_harmonics(balance, points):
    return balance.more


def softer_at_one_end(balance, points):
    return balance.stiffness * np.tile(np.linspace(-0.1, 0.1, points), 2)


@pytest.mark.parametrize("of_ports", [added_by_harmonics, softer_at_one_end])
def test_a_stiffness_of_the_ports_is_felt_as_the_difference_that_a_little_of_it_makes(measured, softening, of_ports):
    plain = ResidualModel(measured)
    held = plain.linearisation(softening)
    points, size, rows = len(plain.points), 1e-3, []
    felt = of_ports(held.balance, points)
    assert np.any(felt)
    for sign in (1, -1):
        balance = with_more(held.balance, sign * size * felt)
        found = ResidualModel(measured, held=replace(held, balance=balance)).evaluate(softening)
        rows.append(found.residual[dict(found.blocks)["steps"]])
    direction = by_stiffness(plain, softening, lambda balance: of_ports(balance, points)[:, :, None])[:, :, 0]
    white = held.steps(np.concatenate([direction.real, direction.imag], axis=1))
    expected = (rows[1] - rows[0]) / (2 * size)
    assert np.linalg.norm(white - expected) < 0.02 * np.linalg.norm(expected)


def law_columns(measured, softening):
    """Columns (s, 2 o, k) of the steps in which a law differs from any."""
    _, (of_laws, *_) = law_tolerances(ResidualModel(measured), softening, np.zeros(3), lambda modification: np.zeros(3))
    assert not np.any(of_laws.harmonics)
    assert not any(np.any(run) for run in of_laws.broadband)
    return of_laws.steps


def felt(measured, softening, of_ports):
    """What a stiffness of the openings and slips (s, 2 p) changes in the steps, (s, 2 o)."""
    plain = ResidualModel(measured)
    change = by_stiffness(plain, softening, lambda balance: of_ports(balance, len(plain.points))[:, :, None])[:, :, 0]
    return np.concatenate([change.real, change.imag], axis=1)


def growing_along_slips(balance, points):
    """A loss that is larger at one end, the more the larger the motion is."""
    more = np.zeros(balance.motion.shape, complex)
    slip = slice(points, 2 * points)
    growing = np.log(np.abs(balance.motion[:, points - 1 : points]))
    more[:, slip] = 1j * balance.stiffness[:, slip].imag * np.linspace(-1, 1, points) * growing
    return more


def stiffness_taken_where_a_joint_slips(balance, points):
    """In proportion to the loss, the less so the larger the motion is."""
    more = np.zeros(balance.motion.shape, complex)
    loss = balance.stiffness[:, points : 2 * points].imag
    more[:, points : 2 * points] = -loss / np.sqrt(1 + np.abs(balance.motion[:, :1]) / 1e-7)
    return more


@pytest.mark.parametrize("of_ports", [growing_along_slips, stiffness_taken_where_a_joint_slips])
def test_a_law_may_differ_in_this_way(measured, softening, of_ports):
    columns, change = law_columns(measured, softening), felt(measured, softening, of_ports)
    columns = columns.reshape(-1, columns.shape[2])
    left = change.ravel() - columns @ np.linalg.lstsq(columns, change.ravel(), rcond=1e-9)[0]
    assert np.linalg.norm(left) < 0.02 * np.linalg.norm(change)


def test_a_linear_joint_leaves_nothing_out(measured, linear):
    plain = ResidualModel(measured, harmonics=harmonic_residuals(ResidualModel(measured), linear))
    assert law_tolerances(plain, linear, np.zeros(3), lambda modification: np.zeros(3)) == ([], [])


def test_shares_err_along_the_layer_in_the_odd_harmonics_alone(measured, softening):
    """What all points share is free anyway: their sum over the layer is nothing."""
    harmonics = harmonic_residuals(ResidualModel(measured), softening)
    plain = ResidualModel(measured, harmonics=harmonics)
    _, (_, _, *of_shares) = law_tolerances(plain, softening, np.zeros(3), lambda modification: np.zeros(3))
    assert of_shares
    for columns in of_shares:
        assert not np.any(columns.steps)
        (felt,) = np.unique(np.nonzero(columns.harmonics)[1])
        assert harmonics.orders[felt] in (3, 5, 7)


def test_friction_makes_an_hth_of_what_damps_in_each_odd_harmonic(measured, softening):
    """Carried to the channels by the field of unit forces; a slider's own harmonics have these shares."""
    plain = ResidualModel(measured)
    harmonics, balance = harmonic_residuals(plain, softening), plain.step_receptance(softening)[2]
    made, p = friction_harmonics(plain, softening, harmonics.orders), len(plain.points)
    slip, damping = balance.motion[:, p : 2 * p], balance.stiffness.imag[:, p : 2 * p]
    assert np.any(made)
    for number, h in enumerate(harmonics.orders):
        square = damping * np.abs(slip) / h * (slip / np.abs(slip)) ** h
        expected = np.einsum("son,pn,sp->so", harmonics.field[:, number], plain.points.slip, square)
        np.testing.assert_allclose(made[:, number], expected if h % 2 else 0.0, rtol=1e-3, atol=1e-6 * abs(made).max())
    slider = jenkins_harmonics(np.array([1.0]), 1e9, 1.0, 7)[0]
    np.testing.assert_allclose(np.abs(slider[[2, 4, 6]] / slider[0]), [1 / 3, 1 / 5, 1 / 7], rtol=1e-3)
