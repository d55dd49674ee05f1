"""A structure of many coordinates is the same sparse as it is dense, and grows with its nodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_array, issparse

from twin.bench import BenchSetup, open_bench
from twin.rigs import Effect, load_rig, moduli_values
from twin.structure import assemble, normal_modes
from twin.structure.limits import LIMITS
from twin.structure.sparse import handy, solved, with_coordinate, with_square

RIG = load_rig("steel-lap-joint")


@pytest.mark.parametrize("form", [np.asarray, csr_array], ids=["dense", "sparse"])
def test_changes_of_a_matrix_are_those_of_numpy(form):
    rng = np.random.default_rng(2)
    A, row = np.diag(rng.uniform(1.0, 2.0, 6)), np.array([0.0, 1.0, 0.0, -2.0, 0.0, 0.0])
    assert issparse(form(A)) is (form is csr_array)

    def dense(found):
        assert issparse(found) is (form is csr_array)
        return found.toarray() if issparse(found) else found

    np.testing.assert_allclose(dense(with_square(form(A), 3.0, row)), A + 3.0 * np.outer(row, row))
    expected = np.pad(A, (0, 1))
    expected[-1, -1] = 7.0
    np.testing.assert_allclose(dense(with_coordinate(form(A), 7.0)), expected)
    right = rng.standard_normal((6, 2))
    np.testing.assert_allclose(A @ solved(form(A), right), right)


def test_lanczos_finds_the_modes_that_lapack_finds_with_rigid_ones_among_them():
    layout = replace(RIG.layout(beam_elements=200), supports=())
    structure = assemble(RIG, layout=layout)
    assert structure.size > LIMITS.dense_up_to
    K = structure.stiffness(*moduli_values(RIG, "120N"))
    found = normal_modes(structure.sparse_M, csr_array(K), 12)
    values = eigh(K, structure.M, eigvals_only=True, subset_by_index=(0, 11))
    np.testing.assert_allclose(found.omega[3:], np.sqrt(values[3:]), rtol=1e-6)
    assert found.omega[2] < 1e-3 * found.omega[3]
    np.testing.assert_allclose(found.Phi.T @ structure.M @ found.Phi, np.eye(12), atol=1e-8)


def test_a_bench_of_many_coordinates_is_that_of_few(monkeypatch):
    """With effects on mass, stiffness and damping, and a resonator of one more coordinate."""
    layout = RIG.layout(beam_elements=190, layer_elements=6)
    effects = [
        Effect(cause="added-mass", parameters={"position_m": 0.3, "mass_kg": 0.02}),
        Effect(cause="stinger-stiffness", parameters={"stiffness_N_per_m": 900.0}),
        Effect(cause="stiffness-loss", parameters={"position_m": 0.1, "factor": 0.7}),
        Effect(cause="viscous-damper", parameters={"position_m": 0.35, "damping_Ns_per_m": 0.4}),
        Effect(
            cause="attached-resonator",
            parameters={"position_m": 0.4, "mass_kg": 0.01, "frequency_Hz": 90.0, "damping_ratio": 0.02},
        ),
    ]
    found = []
    for most in (LIMITS.dense_up_to, 10_000):
        monkeypatch.setattr("twin.structure.sparse.LIMITS", replace(LIMITS, dense_up_to=most))
        built = open_bench(RIG, effects=effects, setup=BenchSetup(layout=layout)).built
        first = built.locals + built.auxiliaries
        found.append(built.rig(0.0, 51200.0).transfer(np.linspace(20.0, 400.0, 30))[:, first:, 0])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-5, atol=1e-7 * np.abs(found[1]).max())


def test_no_matrix_of_a_fine_mesh_is_dense():
    structure = assemble(RIG, layout=RIG.layout(beam_elements=800, layer_elements=4))
    assert structure.size == pytest.approx(2400, abs=60)
    layers = [each for joint in structure.joints for each in joint.sparse]
    for matrix in (structure.sparse_M, structure.sparse_K0, structure.sparse_basis, *layers):
        assert matrix.nnz < 15 * structure.size
        assert issparse(handy(matrix))
