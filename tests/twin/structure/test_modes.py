"""Modes found as the largest inverses: the same as by stiffness over mass, and with masses taken away."""

import numpy as np
import pytest

from twin.rigs import load_rig, moduli_at, moduli_values
from twin.structure import assemble, normal_modes, rigid_motions
from twin.structure.modes import counted_modes, shifted_modes


@pytest.mark.parametrize("name", ["steel-lap-joint", "hung-lap-joint", "l-frame"])
def test_inverses_give_the_same_modes_with_rigid_motions_first(name):
    rig = load_rig(name)
    structure = assemble(rig)
    K = structure.stiffness(*moduli_values(rig))
    plain, found = normal_modes(structure.M, K, 10), shifted_modes(structure.M, K, 10, shift=1.0)
    rigid = rigid_motions(plain.omega)
    assert rigid_motions(found.omega) == rigid
    assert found.omega[rigid:] == pytest.approx(plain.omega[rigid:], rel=1e-6)
    assert found.Phi.T @ structure.M @ found.Phi == pytest.approx(np.eye(10), abs=1e-6)


def test_a_chain_of_masses_with_one_that_is_negative_keeps_its_low_modes():
    """The last mass of three pulls back; the other modes are the roots of the determinant."""
    M, K = np.diag([1.0, 1.0, -0.05]), np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    found = shifted_modes(M, K, 3, shift=1e-4)
    assert len(found.omega) == 2  # the third does not oscillate
    for value in found.omega**2:
        assert np.linalg.det(K - value * M) == pytest.approx(0.0, abs=1e-9)


def test_rigid_motions_are_no_counted_modes():
    rig = load_rig("hung-lap-joint")
    structure = assemble(rig)
    K = structure.stiffness(moduli_at(rig)[0].normal_modulus, moduli_at(rig)[0].shear_modulus)
    lowest = counted_modes(structure.M, K, structure.counted, least=2).omega[0]
    assert lowest == pytest.approx(normal_modes(structure.M, K, 6).omega[3], rel=1e-6)
