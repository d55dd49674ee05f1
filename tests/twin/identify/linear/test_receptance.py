"""Receptances between ports, and springs added to them, against matrices inverted whole."""

import numpy as np
import pytest
from beam_rows import deflection
from receptance_numpy import update_receptance_numpy

from twin.identify.linear.receptance import layer_ports, lowest_modes_basis
from twin.identify.linear.structural_modification import update_receptance
from twin.structure import layer_points

TWINS = (update_receptance, update_receptance_numpy)
OMEGA = 2 * np.pi * np.array([5.0, 26.4, 100.0, 157.0, 300.0, 471.0, 700.0, 895.0, 1000.0])


def random_ports(seed, size=12, ports=9, frequencies=4):
    """Complex symmetric dynamic stiffnesses (f, n, n), ports (p, n), and springs (f, 4) on ports 2 ... 5."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((frequencies, size, size))
    Z = A @ A.swapaxes(1, 2) + np.eye(size) + 1j * np.diag(rng.uniform(0.1, 1.0, size)) - 2.0 * np.eye(size)
    springs = rng.standard_normal((frequencies, 4)) + 1j * rng.uniform(0, 1, (frequencies, 4))
    return Z, rng.standard_normal((ports, size)), springs


@pytest.mark.parametrize("update", TWINS)
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_springs_on_ports_are_springs_in_the_matrix(update, scale):
    Z, P, springs = random_ports(1)
    springs = scale * springs
    L = P[2:6]
    before = P @ np.linalg.inv(Z) @ P.T
    after = P @ np.linalg.inv(Z + L.T @ (springs[:, :, None] * L)) @ P.T
    # Inverting loses what the matrices' conditions say; the springs make it worse by their size.
    np.testing.assert_allclose(
        update(before, slice(2, 6), springs), after, rtol=1e-8, atol=1e-11 * np.abs(before).max()
    )


@pytest.mark.parametrize("update", TWINS)
def test_what_is_updated_stays_as_it_was_and_no_springs_change_nothing(update):
    Z, P, springs = random_ports(2)
    before = P @ np.linalg.inv(Z) @ P.T
    kept, asked = before.copy(), springs.copy()
    update(before, slice(2, 6), springs)
    np.testing.assert_array_equal(before, kept)
    np.testing.assert_array_equal(springs, asked)
    np.testing.assert_allclose(update(before, slice(2, 6), 0 * springs), before, rtol=1e-9)


@pytest.mark.parametrize("update", TWINS)
def test_adding_springs_and_taking_them_off_again_gives_the_start(update):
    Z, P, springs = random_ports(3)
    before = P @ np.linalg.inv(Z) @ P.T
    there = update(before, slice(2, 6), springs)
    assert np.max(np.abs(there - before)) > 0.1 * np.max(np.abs(before))
    np.testing.assert_allclose(update(there, slice(2, 6), -springs), before, rtol=1e-7, atol=1e-10)


@pytest.mark.parametrize("share", [-0.999, -0.66, 0.05, 30.0])
def test_compiled_and_plain_agree_on_the_rigs_layer(steel_model, other_base, share):
    """Over the whole range of stiffness that a joint may lose or gain, at a resonance and away from it."""
    ports = steel_model.ports
    R = steel_model.basis.receptance(ports.rows, OMEGA)
    normal, shear = (np.ones((len(OMEGA), len(parts[0]))) for parts in (ports.normals, ports.shears))
    S = np.hstack([share * other_base.E * (1 + 0.01j) * normal, (1e8 + 2e8j) * shear])
    compiled, plain = (update(R, ports.soft, S) for update in TWINS)
    size = np.max(np.abs(plain), axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(compiled / size, plain / size, atol=1e-10)


def test_layer_ports_hold_the_layers_whole_stiffness_at_its_rank(steel_model):
    s = steel_model.structure
    for Q, K in zip(layer_ports(s.joints[0]), (s.joints[0].KE, s.joints[0].KG), strict=True):
        np.testing.assert_allclose(Q.T @ Q, K, atol=1e-12 * np.max(K))
        assert len(Q) == np.linalg.matrix_rank(K) < len(K)


def test_kept_modes_and_static_remainder_are_the_dense_receptance(steel_model, steel_dense, other_base):
    """Eighteen modes and the rest as statics with a first correction: parts in a million up to 1 kHz."""
    P = steel_model.ports.rows
    dense = steel_dense.field(P, OMEGA, other_base) @ P.T
    R = steel_model.receptance(OMEGA, other_base)
    size = np.max(np.abs(dense), axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(R / size, dense / size, atol=2e-6)
    np.testing.assert_allclose(R, R.swapaxes(1, 2), rtol=1e-9, atol=1e-12 * np.max(size))


def test_the_remainder_is_needed_and_falls_with_the_frequency_as_stated(steel_model):
    """Left out of the flexibility: terms of the order (omega / omega_r)^4 of the omitted modes."""
    s = steel_model.structure
    K = s.stiffness(steel_model.reference_E, steel_model.reference_G)
    P = np.array([deflection(s, x) for x in (0.05, 0.3, 0.42)])
    basis = lowest_modes_basis(s.M, K, np.array([1e-9]), kept=6)
    whole = lowest_modes_basis(s.M, K, np.array([1e-9]), kept=len(s.M))
    omega = 2 * np.pi * np.array([200.0, 400.0])
    error = np.abs(basis.receptance(P, omega) - whole.receptance(P, omega)).max(axis=(1, 2))
    assert error[1] / error[0] == pytest.approx(2**4, rel=0.1)
    modes_alone = (P @ basis.Phi / basis.omega**2) @ (P @ basis.Phi).T
    assert np.max(np.abs(modes_alone - P @ np.linalg.inv(K) @ P.T)) > 1e3 * error[0]


def test_field_is_the_displacement_of_every_degree_of_freedom(steel_model, steel_dense, other_base):
    """With changed moduli, and with what the law does at the layer's points."""
    dE, dG = -0.1 * other_base.E, 1e8j
    points = layer_points(steel_model.structure, 3)
    springs = points.weights * np.array([-1e8, -2e8, -5e7, 3e8j, 1e7j, 2e8j])
    model = steel_model.with_points(points.rows)
    at = np.arange(len(steel_model.ports.outer), len(model.ports.outer))
    field = model.output_field(OMEGA, other_base, dE, dG, at=at, springs=np.tile(springs, (len(OMEGA), 1)))
    held = points.rows.T @ (springs[:, None] * points.rows)
    dense = steel_dense.field(steel_model.ports.rows[steel_model.ports.outputs], OMEGA, other_base, dE, dG, held)
    size = np.max(np.abs(dense), axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(field / size, dense / size, atol=2e-6)
