"""Nonlinear forces at ports of a small structure, against the equations of its motion solved whole."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from twin.identify.extension import JointState, NonlinearForce
from twin.identify.local_forces import Influence, LocalForces

M, K = np.diag([1.0, 0.5, 0.2]), np.array([[900.0, -300.0, 0.0], [-300.0, 500.0, -200.0], [0.0, -200.0, 260.0]])
OMEGA = np.array([3.0, 11.0, 17.0, 24.0, 33.0])
PORTS = (1, 2)
"""Where the forces act; the structure is driven, and its motion is known, at degree of freedom 0."""
MOVED = 0.7 * np.exp(0.4j)
OTHERWISE = {"hardening": lambda a: 150.0 * a**2, "slipping": lambda a: 400.0 / (1 + (a / 0.1) ** 2) * (1 + 0.3j)}


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


def local(*laws):
    def force(law):
        return NonlinearForce(None, lambda a, omega: law(a) + 0j, None)

    return LocalForces(tuple(force(law) for law in laws))


@pytest.mark.parametrize("names", [("hardening", "slipping"), ("slipping", "slipping"), ("slipping", "hardening")])
def test_stiffness_and_amplitude_agree_with_each_other(names):
    forces = local(*(OTHERWISE[name] for name in names))
    R = forces.balance(OMEGA, receptance(), receptance, motion)
    amplitude = np.abs(motion(R)[0])
    assert np.all(np.abs(amplitude / np.abs(motion(receptance())[0]) - 1).max(axis=0) > 0.02)
    np.testing.assert_allclose(R, receptance(forces.stiffness(amplitude, OMEGA)), rtol=1e-8)


def test_one_spring_is_where_a_root_finder_finds_it():
    """Of one port the amplitude solves one real equation."""
    hardening = OTHERWISE["hardening"]
    forces = local(hardening, lambda a: 0.0 * a)
    found = np.abs(motion(forces.balance(OMEGA, receptance(), receptance, motion))[0])[:, 0]
    for i in range(len(OMEGA)):

        def gap(a, i=i):
            k = np.zeros((len(OMEGA), 2))
            k[i, 0] = hardening(a)
            return np.abs(motion(receptance(k))[0][i, 0]) - a

        assert found[i] == pytest.approx(brentq(gap, 1e-6, 1e2, xtol=1e-13), rel=1e-8)


@pytest.mark.parametrize("names", [("hardening", "slipping"), ("slipping", "slipping")])
def test_what_follows_another_change_is_the_derivative_of_the_balanced_state(names):
    """Another change: linear stiffness at the second port."""
    forces = local(*(OTHERWISE[name] for name in names))

    def settled(extra):
        def attach(k):
            return receptance(k + np.array([0.0, extra]))

        R = forces.balance(OMEGA, attach(np.zeros((len(OMEGA), 2))), attach, motion)
        return R, np.log(motion(R)[0]), np.log(R[:, [0], 0])

    R, _, _ = settled(0.0)
    z, influence = motion(R)
    held = influence.motion[:, :, [1]], influence.response[:, :, [1]]
    followed = forces.follow(np.abs(z), OMEGA, influence, *held)
    up, down = settled(1e-3), settled(-1e-3)
    for found, alone, plus, minus in zip(followed, held, up[1:], down[1:], strict=True):
        expected = (plus - minus)[:, :, None] / 2e-3
        np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-6 * np.max(np.abs(expected)))
        assert np.max(np.abs(alone - expected)) > 0.05 * np.max(np.abs(expected))


def test_changes_of_harmonics_are_their_derivatives():
    """Third-order force whose size depends on what the joint has left."""

    def harmonics(a, count, joint):
        return joint.left[:, None] ** 2 * a[:, None] ** 3 * np.arange(1, count + 1) * (1 - 0.2j)

    forces = LocalForces((NonlinearForce(None, None, harmonics),))
    z, joint = np.array([[0.3 + 0.2j], [1.0 - 0.5j]]), JointState(np.array([0.9, 0.4]), np.zeros((2, 4)), np.ones(2))
    log_motion, left = np.array([[[0.2 - 0.7j]], [[1.1 + 0.3j]]]), np.array([[0.5], [-0.2]])

    def moved(h):
        at = replace(joint, left=joint.left + h * left[:, 0])
        return forces.harmonics(z * np.exp(h * log_motion[:, :, 0]), 3, at)

    expected = (moved(1e-5) - moved(-1e-5)) / 2e-5
    here = forces.harmonics(z, 3, joint)
    found = forces.harmonic_changes(here, z, 3, joint, log_motion, left)[..., 0]
    np.testing.assert_allclose(found, expected, rtol=1e-4)
