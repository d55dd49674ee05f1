"""Each law's closed describing function against quadrature of its own path in time (2011 paper, equation 6)."""

from __future__ import annotations

import numpy as np
import pytest
from smooth_backbones import iwan_backbone, masing, masing_stiffness

from twin.joint import (
    Cubic,
    ForceTable,
    Linear,
    PiecewiseLinearContact,
    Polynomial,
    QuadraticDrag,
    RunningLoss,
    Saturating,
    describing_function,
    iwan,
    jenkins,
    one_sided,
    table_from_stiffness,
)

AMPLITUDE = np.array([0.3, 0.9, 1.0, 1.7, 4.0])


def iwan_stiffness(amplitude, stiffness, slip_force, chi=0.0):
    """With infinitely many sliders."""
    return masing_stiffness(amplitude, lambda x: iwan_backbone(x, stiffness, slip_force, chi=chi))


@pytest.mark.parametrize(
    ("law", "tolerance"),
    [
        (Linear(3.0), 1e-12),
        (Cubic(2.0), 1e-12),
        (Saturating(2.0, 0.8, -0.5), 1e-12),
        (Saturating(2.0, 100.0), 1e-12),
        (one_sided(5.0, 0.7), 1e-6),
        (one_sided(5.0, -0.7), 1e-6),
        (PiecewiseLinearContact((1.0, 2.0, 6.0), (0.5, 0.0, -0.5), (-1, -1, -1)), 1e-6),
        (jenkins(2.0, 1.5), 1e-5),
        (iwan(2.0, 1.5, sliders=7), 1e-5),
        (RunningLoss(5.0, np.linspace(0.0, 2.0, 11)), 1e-6),
    ],
    ids=lambda value: type(value).__name__,
)
def test_closed_form_is_the_quadrature_of_the_path(law, tolerance):
    expected = describing_function(law.force_history, AMPLITUDE, points=8192)
    np.testing.assert_allclose(law.describing_function(AMPLITUDE), expected, rtol=tolerance, atol=5 * tolerance)


def test_the_papers_polynomials_come_back_from_their_time_form():
    storage, loss = (-2.0, 1.5, -0.3, 0.02), (0.4, 0.25, 0.1)
    law = Polynomial(storage, loss)
    found = describing_function(law.force_history, AMPLITUDE, points=1 << 16)
    np.testing.assert_allclose(found.real, np.polyval(storage[::-1], AMPLITUDE), rtol=0, atol=1e-3)
    np.testing.assert_allclose(found.imag, np.polyval(loss[::-1], AMPLITUDE), rtol=1e-6)
    np.testing.assert_allclose(law.describing_function(AMPLITUDE).real, np.polyval(storage[::-1], AMPLITUDE))


def test_the_jump_of_the_loss_is_what_limits_the_quadrature_of_its_storage():
    errors = [
        abs(describing_function(Polynomial((), (0.0, 1.0)).force_history, 1.0, points=points).real)
        for points in (1 << 10, 1 << 12)
    ]
    assert errors[1] < errors[0] / 3


def test_a_reversal_over_a_short_travel_changes_the_loss_little():
    exact, blunt = Polynomial((), (0.0, 1.0)), Polynomial((), (0.0, 1.0), stick=1e-4)
    found = describing_function(blunt.force_history, 1.0, points=1 << 14)
    assert abs(found.imag / exact.describing_function(np.array(1.0)).imag - 1) < 1e-3


def test_a_table_made_from_a_stiffness_curve_has_that_curve():
    law = Saturating(2.0, 0.8, -0.5)

    def slope(A):
        return (law.describing_function(A + 1e-6) - law.describing_function(np.maximum(A - 1e-6, 0.0))).real / (
            A + 1e-6 - np.maximum(A - 1e-6, 0.0)
        )

    table = table_from_stiffness(lambda A: law.describing_function(A).real, slope, limit_m=5.0)
    np.testing.assert_allclose(
        table.describing_function(AMPLITUDE).real, law.describing_function(AMPLITUDE).real, atol=1e-5
    )
    e = np.linspace(-5, 5, 101)
    np.testing.assert_allclose(table.force_history(e), law.force_history(e), atol=2e-5)


def test_a_table_goes_on_along_its_last_tangent():
    table = ForceTable.of(lambda e: e**3, limit_m=1.0)
    assert table.force_history(np.array([2.0]))[0] == pytest.approx(4.0, rel=1e-2)
    assert table.force_history(np.array([-2.0]))[0] == pytest.approx(-4.0, rel=1e-2)


def test_drag_dissipates_as_its_equivalent_damper():
    theta = 2 * np.pi * np.arange(4096) / 4096
    velocity = 3.0 * np.cos(theta)
    power = np.mean(QuadraticDrag(0.7).force_history(velocity) * velocity)
    equivalent = QuadraticDrag(0.7).describing_function(np.array(3.0)).real
    assert power == pytest.approx(equivalent * np.mean(velocity**2), rel=1e-9)


def test_a_softening_that_saturates_never_has_a_negative_tangent():
    e = np.linspace(-50, 50, 4001)
    whole = Saturating(0.85, 0.8, -0.85).force_history(e) + e
    assert np.all(np.diff(whole) > 0)


def test_an_iwan_loop_in_micro_slip_is_a_parabola():
    """k (1 - A/(2 x_1) + j 2 A/(3 pi x_1)), from the parabola's area and first moment."""
    k, F = 2.0, 1.5
    x_1 = 2 * F / k
    A = np.array([0.1, 0.7, 1.4])
    np.testing.assert_allclose(
        iwan_stiffness(A, k, F), k * (1 - A / (2 * x_1) + 2j * A / (3 * np.pi * x_1)), rtol=1e-10
    )


@pytest.mark.parametrize("chi", [-0.5, 0.0, 1.0])
def test_many_sliders_come_to_the_closed_iwan_law(chi):
    closed = iwan_stiffness(AMPLITUDE, 2.0, 1.5, chi=chi)
    errors = [
        np.abs(iwan(2.0, 1.5, sliders=sliders, chi=chi).describing_function(AMPLITUDE) - closed).max()
        for sliders in (10, 100)
    ]
    assert errors[1] < errors[0] / 5
    assert errors[1] < 0.005 * 2.0
    assert iwan(2.0, 1.5, chi=chi).force_history(np.linspace(0, 100.0, 9))[-1] == pytest.approx(1.5)


def test_energy_lost_in_micro_slip_grows_with_segalmans_power():
    for chi in (-0.6, 0.0):
        A = np.array([0.01, 0.02])
        loss = np.pi * A**2 * iwan_stiffness(A, 2.0, 1.5, chi=chi).imag
        assert np.log2(loss[1] / loss[0]) == pytest.approx(3 + chi, abs=1e-4)


def test_a_masing_law_follows_its_backbone_and_has_its_stiffness():
    def backbone(x):
        return np.tanh(x) + 0.2 * x

    law = masing(backbone, limit_m=4.0, sliders=100)
    x = np.linspace(0.0, 4.0, 101)
    np.testing.assert_allclose(law.force_history(x), backbone(x), atol=1e-9)
    np.testing.assert_allclose(law.describing_function(AMPLITUDE), masing_stiffness(AMPLITUDE, backbone), atol=2e-3)
    quadrature = describing_function(law.force_history, AMPLITUDE, points=8192)
    np.testing.assert_allclose(masing_stiffness(AMPLITUDE, backbone), quadrature, atol=2e-3)


def test_a_backbone_that_stiffens_is_refused():
    with pytest.raises(ValueError, match="stiffens or falls"):
        masing(lambda x: x + x**3, limit_m=1.0)
    with pytest.raises(ValueError, match="chi above -1"):
        iwan(1.0, 1.0, chi=-1.0)


def test_an_iwan_network_loads_along_its_backbone():
    x = np.linspace(0.0, 2.0, 401)
    np.testing.assert_allclose(iwan(2.0, 1.5, sliders=400).force_history(x), iwan_backbone(x, 2.0, 1.5), atol=2e-3)


def test_masing_branches_are_twice_the_backbone():
    law = iwan(2.0, 1.5, sliders=50)
    loading = np.linspace(0, 2.0, 2001)
    backbone = law.force_history(loading)
    back = law.force_history(np.concatenate([loading, np.linspace(2.0, -2.0, 4001)[1:]]))[2000:]
    half = np.interp((2.0 - np.linspace(2.0, -2.0, 4001)) / 2, loading, backbone)
    np.testing.assert_allclose(back, backbone[-1] - 2 * half, atol=1e-9)
