"""Receptances with a softer or stiffer layer in one pass, against a plain twin and matrices inverted whole."""

import numpy as np
import pytest
from receptance_numpy import softened_receptance_numpy

from twin.identify.linear.structural_modification import PortPairs

OMEGA = 2 * np.pi * np.array([5.0, 26.4, 100.0, 157.0, 300.0, 471.0, 700.0, 895.0, 1000.0])


def springs(model, base, share):
    """Stiffness (f, r) on the layer's strains: a share of E' with little loss, and a G' that is mostly loss."""
    normal, shear = (np.ones((len(OMEGA), len(parts[0]))) for parts in (model.ports.normals, model.ports.shears))
    return np.hstack([share * base.E * (1 + 0.01j) * normal, (1e8 + 2e8j) * shear])


def softened_first(ports):
    return np.vstack([*ports.normals, *ports.shears, ports.outer, ports.modes])


def relative(found, expected):
    return np.abs(found - expected) / np.max(np.abs(expected), axis=(1, 2), keepdims=True)


@pytest.mark.parametrize("share", [-0.999, -0.66, 0.0, 0.05, 30.0])
def test_compiled_and_plain_agree(steel_model, other_base, share):
    """Over the whole range of stiffness that a joint may lose or gain, at a resonance and away from it."""
    rows, S = softened_first(steel_model.ports), springs(steel_model, other_base, share)
    basis = steel_model.basis.with_damping(other_base.zeta, other_base.frequency_discrepancy)
    pairs = PortPairs.of(steel_model.basis, rows, np.arange(len(rows)), outer=len(rows))
    plain = softened_receptance_numpy(basis, rows, OMEGA, S)
    assert np.max(relative(pairs.receptance(basis, OMEGA, S, inner=True), plain)) < 1e-10


def test_no_springs_are_the_modal_sum(steel_model):
    """But for rounding, which mode 1 at 26.46 Hz magnifies some 240 times at 26.4 Hz."""
    rows = softened_first(steel_model.ports)
    pairs = PortPairs.of(steel_model.basis, rows, np.arange(len(rows)), outer=len(rows))
    found = pairs.receptance(steel_model.basis, OMEGA, np.zeros((len(OMEGA), 3)), inner=True)
    assert np.max(relative(found, steel_model.basis.receptance(rows, OMEGA))) < 1e-13


def test_only_the_wanted_receptances_come_out(steel_model, other_base):
    """Without the layer's strains and the modal coordinates the others are the same."""
    outer = slice(0, len(steel_model.ports.outer))
    whole = steel_model.receptance(OMEGA, other_base, dE=-0.5 * other_base.E)
    part = steel_model.receptance(OMEGA, other_base, dE=-0.5 * other_base.E, inner=False)
    np.testing.assert_allclose(part, whole[:, outer, outer], rtol=1e-9)


def test_the_modal_coordinates_may_be_left_out_alone(steel_model, other_base):
    whole = steel_model.receptance(OMEGA, other_base, dE=-0.5 * other_base.E)
    part = steel_model.receptance(OMEGA, other_base, dE=-0.5 * other_base.E, modal=False)
    left_out = np.zeros(part.shape[1], bool)
    left_out[steel_model.ports.modal] = True
    kept = np.ix_(np.arange(len(OMEGA)), ~left_out, ~left_out)
    assert np.max(relative(part[kept], whole[kept])) < 1e-12
    assert np.isfinite(part).sum() == part[kept].size


def test_springs_are_springs_in_the_dense_matrices(steel_model, steel_dense, other_base):
    dE, dG = -0.5 * other_base.E, 3e8j
    P = steel_model.ports.rows
    dense = steel_dense.field(P, OMEGA, other_base, dE, dG) @ P.T
    found = steel_model.receptance(OMEGA, other_base, dE=dE, dG=dG)
    assert np.max(relative(found, dense)) < 2e-6
