"""Forces at ports of a small structure, the layer's points among them, against its equations solved whole."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from twin.identify.model_modification import NonlinearForce
from twin.identify.nonlinear.balance import Added
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.nonlinear.local_forces import Influence, LocalForces, Surroundings
from twin.identify.slipping import Slider

M, K = np.diag([1.0, 0.5, 0.2]), np.array([[900.0, -300.0, 0.0], [-300.0, 500.0, -200.0], [0.0, -200.0, 260.0]])
OMEGA = np.array([3.0, 11.0, 17.0, 24.0, 33.0])
PORTS = (1, 2)
"""Where the forces act; the structure is driven, and its motion is known, at degree of freedom 0."""
MOVED = 0.7 * np.exp(0.4j)
OTHERWISE = {"hardening": lambda a: 150.0 * a**2, "slipping": lambda a: 400.0 / (1 + (a / 0.1) ** 2) * (1 + 0.3j)}
KNOTS = np.geomspace(0.02, 2.0, 12)
LAW = LayerLaw(KNOTS, KNOTS, 90.0 * KNOTS / (KNOTS + 0.3), 40.0 * KNOTS**2)
LAWS = (LAW,)
ONE_POINT, NO_POINT = np.zeros(1, int), np.zeros(0, int)
"""As the law of one point that opens at the first port and slips at the second."""
WEIGHT = np.tile([1.5, 2.0], (len(OMEGA), 1))


def receptance(stiffness=0.0):
    """Of the whole structure (s, 3, 3), with stiffness (s, 2) at the ports."""
    Z = K + 2j * OMEGA[:, None, None] * np.eye(3) - OMEGA[:, None, None] ** 2 * M
    Z = Z + np.zeros_like(Z)
    for i, port in enumerate(PORTS):
        Z[:, port, port] += np.broadcast_to(stiffness, (len(OMEGA), 2))[:, i]
    return np.linalg.inv(Z)


def motion(R):
    """Of the ports where degree of freedom 0 moves as it does, and how stiffness changes that and the response at 0."""
    into, at = R[:, :, 0], list(PORTS)
    by_response = -(R[:, [0]][:, :, at] * into[:, None, at]) / into[:, [0], None]
    by_motion = -(R[:, at][:, :, at] * into[:, None, at]) / into[:, at, None] - by_response
    return MOVED * into[:, at] / into[:, [0]], Influence(by_motion, by_response)


def around(extra=0.0):
    """What the ports have around them, with linear stiffness beside."""
    R, at = receptance(extra), list(PORTS)
    return Surroundings(R[:, at][:, :, at], R[:, at, 0], R[:, 0, 0], R[:, 0, at], np.full(len(OMEGA), MOVED))


def local(name):
    """The layer's point, or two nonlinear forces."""
    if name == "layer":
        return LocalForces((), WEIGHT, ONE_POINT)

    def force(law):
        return NonlinearForce(None, lambda a, omega: law(a) + 0j, None)

    return LocalForces(tuple(force(OTHERWISE[part]) for part in name.split()), np.zeros((len(OMEGA), 0)), NO_POINT)


@pytest.mark.slow
def test_sliders_balanced_in_compiled_code_are_those_balanced_one_turn_after_the_other():
    """Beside a point of the layer, at steps where they stick, begin to slip and slip far."""

    def compliance(omega):
        return 1 / (1e3 - np.outer(omega, [3, 5, 7]) ** 2 + 40j * omega[:, None])

    sliders = [Slider(300.0, 200.0, compliance), Slider(150.0, 30.0, compliance)]
    R, port = receptance(), [1, 2, 1, 2]
    here = Surroundings(R[:, port][:, :, port], R[:, port, 0], R[:, 0, 0], R[:, 0, port], np.full(len(OMEGA), MOVED))
    known, plain = (
        LocalForces(
            tuple(NonlinearForce(None, s.equivalent, s.harmonics, slider=own) for s, own in each), WEIGHT, ONE_POINT
        )
        for each in (zip(sliders, sliders, strict=True), zip(sliders, (None, None), strict=True))
    )
    found, expected = known.balance(LAWS, OMEGA, here), plain.balance(LAWS, OMEGA, here)
    slips = np.abs(found.motion[:, 2:]) * [300.0, 150.0] > [200.0, 30.0]
    assert np.any(slips), "some slip"
    assert not np.all(slips), "some stick"
    assert np.all(found.unsettled < 1e-9)
    np.testing.assert_allclose(found.motion, expected.motion, rtol=1e-10)
    np.testing.assert_allclose(found.stiffness, expected.stiffness, rtol=1e-9, atol=1e-9 * 300.0)


NO_HARMONICS = np.zeros((len(OMEGA), 1, 2))
SETS = ["layer", "hardening slipping", "slipping slipping", "slipping hardening"]


def test_a_layers_point_softens_as_it_opens_and_loses_as_it_slips():
    amplitude = np.tile([0.3, 0.7], (len(OMEGA), 1))
    k, growth = LocalForces(
        (NonlinearForce(None, lambda a, omega: 5.0 * a**2 + 0j, None),), WEIGHT, ONE_POINT
    ).stiffness(LAWS, np.column_stack([amplitude, np.full(len(OMEGA), 0.1)]), OMEGA, NO_HARMONICS)
    np.testing.assert_allclose(k[:, 0], -1.5 * LAW.softening_at(0.3)[0])
    np.testing.assert_allclose(k[:, 1], 2j * LAW.loss_at(0.7)[0])
    np.testing.assert_allclose(k[:, 2], 0.05)
    np.testing.assert_allclose(growth[:, 2], 0.1, rtol=1e-4)


@pytest.mark.parametrize("name", SETS)
def test_stiffness_and_amplitude_agree_with_each_other(name):
    forces = local(name)
    found = forces.balance(LAWS, OMEGA, around())
    amplitude = np.abs(found.motion)
    assert np.all(np.abs(amplitude / np.abs(motion(receptance())[0]) - 1).max(axis=0) > 0.02)
    np.testing.assert_allclose(found.stiffness, forces.stiffness(LAWS, amplitude, OMEGA, NO_HARMONICS)[0], rtol=1e-8)
    np.testing.assert_allclose(found.motion, motion(receptance(found.stiffness))[0], rtol=1e-8)
    assert np.max(found.unsettled) < 1e-9


@pytest.mark.parametrize("name", SETS)
def test_stiffness_that_is_added_is_one_more_spring(name):
    forces, more = local(name), np.full((len(OMEGA), 2), 8.0 + 3.0j)
    added = replace(Added.nothing(more.shape, forces.points), stiffness=more)
    found = forces.balance(LAWS, OMEGA, around(), added=added)
    beside = forces.balance(LAWS, OMEGA, around(more))
    np.testing.assert_allclose(found.motion, beside.motion, rtol=1e-7)
    np.testing.assert_allclose(found.stiffness, beside.stiffness + more, rtol=1e-7)
    np.testing.assert_array_equal(found.more, more)


def test_where_a_balance_begins_does_not_matter():
    forces = local("layer")
    found = forces.balance(LAWS, OMEGA, around())
    for factor in (0.1, 30.0):
        again = forces.balance(LAWS, OMEGA, around(), start=factor * np.abs(found.motion))
        np.testing.assert_allclose(again.motion, found.motion, rtol=1e-8)


def test_one_spring_is_where_a_root_finder_finds_it():
    """Of one port the amplitude solves one real equation."""
    hardening = OTHERWISE["hardening"]
    force, nothing = (
        NonlinearForce(None, lambda a, omega, law=law: law(a) + 0j, None) for law in (hardening, np.zeros_like)
    )
    forces = LocalForces((force, nothing), np.zeros((len(OMEGA), 0)), NO_POINT)
    found = np.abs(forces.balance(LAWS, OMEGA, around()).motion)[:, 0]
    for i in range(len(OMEGA)):

        def gap(a, i=i):
            k = np.zeros((len(OMEGA), 2))
            k[i, 0] = hardening(a)
            return np.abs(motion(receptance(k))[0][i, 0]) - a

        assert found[i] == pytest.approx(brentq(gap, 1e-6, 1e2, xtol=1e-13), rel=1e-8)


@pytest.mark.parametrize("name", SETS)
def test_what_follows_another_change_is_the_derivative_of_the_balanced_state(name):
    """Another change: linear stiffness at the second port; what is added follows the openings, too."""
    forces, extra = local(name), np.array([0.0, 1e-3])
    added = Added.nothing((len(OMEGA), 2), forces.points)
    added.growth[:], added.squares[:] = 6.0 - 2.0j, [0.3, 1.9]

    def settled(sign):
        found = forces.balance(LAWS, OMEGA, around(sign * extra), added=added)
        return np.log(found.motion), np.log(receptance(found.stiffness + sign * extra)[:, [0], 0])

    balanced = forces.balance(LAWS, OMEGA, around(), added=added)
    z, influence = motion(receptance(balanced.stiffness))
    held = influence.motion[:, :, [1]], influence.response[:, :, [1]]
    followed = forces.follow(LAWS, np.abs(z), OMEGA, influence, *held, added)
    for found, alone, plus, minus in zip(followed, held, settled(1.0), settled(-1.0), strict=True):
        expected = (plus - minus)[:, :, None] / 2e-3
        np.testing.assert_allclose(found, expected, rtol=1e-4, atol=2e-6 * np.max(np.abs(expected)))
        assert np.max(np.abs(alone - expected)) > 0.03 * np.max(np.abs(expected))


def test_derivatives_by_the_law_are_those_of_the_points_stiffness():
    amplitude = np.tile([0.3, 0.7], (len(OMEGA), 1))
    squares = np.tile([0.2, 1.5], (len(OMEGA), 1, 1))
    ((by_softening, by_loss),) = local("layer").by_law(LAWS, amplitude, squares)
    k = local("layer").stiffness(LAWS, amplitude, OMEGA, squares)[0]
    np.testing.assert_allclose(by_softening[:, 0] @ LAW.softening, k[:, 0])
    np.testing.assert_allclose(by_loss[:, 0] @ LAW.loss, k[:, 1])


def test_changes_of_harmonics_are_their_derivatives():
    def harmonics(a, count, omega):
        return a[:, None] ** 3 * np.arange(1, count + 1) * (1 - 0.2j) / (1 + a[:, None])

    forces = LocalForces((NonlinearForce(None, None, harmonics),), np.zeros((2, 0)), NO_POINT)
    z, omega = np.array([[0.3 + 0.2j], [1.0 - 0.5j]]), np.ones(2)
    log_motion = np.array([[[0.2 - 0.7j]], [[1.1 + 0.3j]]])

    def moved(h):
        return forces.harmonics(z * np.exp(h * log_motion[:, :, 0]), 3, omega)

    expected = (moved(1e-5) - moved(-1e-5)) / 2e-5
    found = forces.harmonic_changes(forces.harmonics(z, 3, omega), z, 3, omega, log_motion)[..., 0]
    np.testing.assert_allclose(found, expected, rtol=1e-4)
