"""Coupling, decoupling, expansion and synthesis against assembled matrices, and against pyFBS where it is installed."""

from __future__ import annotations

import numpy as np
import pytest
from circular_noise import circular
from scipy.linalg import block_diag
from three_beams import BEAMS, LINES_HZ, POINTS, Beam, accelerance, measured_part, noisy

from twin.substructuring.coupling import couple
from twin.substructuring.expansion import Expansion
from twin.substructuring.synthesis import synthesise

OMEGA = 2 * np.pi * LINES_HZ[::40]


@pytest.fixture(scope="module")
def exact():
    """Receptances of the second beam between its points."""
    return -measured_part() / (2 * np.pi * LINES_HZ[:, None, None]) ** 2


def chains(rng):
    """Two random structures of three masses each."""
    found = []
    for _ in range(2):
        root = rng.standard_normal((3, 3))
        found.append((np.diag(rng.uniform(1, 2, 3)), 1e6 * (root @ root.T + np.eye(3)) * (1 + 0.02j)))
    return found


def receptance(M, K):
    return np.linalg.inv(K - OMEGA[:, None, None] ** 2 * M)


def test_a_joint_a_damper_and_a_rigid_gap_are_those_of_the_assembled_matrices():
    (M1, K1), (M2, K2) = chains(np.random.default_rng(1))
    B = np.zeros((3, 6))
    B[[0, 1, 2], [0, 1, 2]], B[[0, 1, 2], [3, 4, 5]] = -1, 1
    k, c = 3e5 * (1 + 0.1j), 40.0
    F = np.stack([np.full(len(OMEGA), 1 / k), 1 / (1j * OMEGA * c), np.zeros(len(OMEGA))], axis=1)
    found = couple(receptance(block_diag(M1, M2), block_diag(K1, K2)), B, F)
    # In primal form: the rigid gap removes a coordinate.
    T = np.delete(np.eye(6), 5, axis=1)
    T[5, 2] = 1
    K = block_diag(K1, K2) + k * np.outer(B[0], B[0])
    Z = K + 1j * OMEGA[:, None, None] * c * np.outer(B[1], B[1]) - OMEGA[:, None, None] ** 2 * block_diag(M1, M2)
    assert found.receptance == pytest.approx(T @ np.linalg.inv(T.T @ Z @ T) @ T.T, rel=1e-6, abs=1e-14)


def test_decoupling_takes_off_what_was_coupled():
    (M1, K1), (M2, K2) = chains(np.random.default_rng(2))
    Y1, Y2 = receptance(M1, K1), receptance(M2, K2)
    both = np.zeros((len(OMEGA), 6, 6), complex)
    both[:, :3, :3], both[:, 3:, 3:] = Y1, Y2
    B = np.hstack([-np.eye(3)[:2], np.eye(3)[:2]])
    rigid = np.zeros((len(OMEGA), 2), complex)
    both[:, :3, :3] = couple(both, B, rigid).receptance[:, :3, :3]
    both[:, 3:, 3:] = -Y2
    # The residual structure moves with the whole at all its coordinates, so that it can be told from the rest.
    left = couple(both, B, rigid).receptance[:, :3, :3]
    assert left == pytest.approx(Y1, rel=1e-4, abs=1e-12)


def test_a_gap_closed_where_nothing_moves_is_singular():
    with pytest.raises(ValueError, match="singular"):
        couple(np.zeros((1, 2, 2), complex), np.array([[1.0, -1.0]]), np.zeros((1, 1)))


def test_a_synthesis_is_nearer_to_the_truth_than_what_was_measured(exact):
    rng = np.random.default_rng(3)
    measured = noisy(exact, rng)
    measured = (measured + np.swapaxes(measured, 1, 2)) / 2
    std = 1e-3 * np.abs(exact) / np.where(np.eye(len(POINTS)), 1, np.sqrt(2))
    found = synthesise(LINES_HZ, measured, std)
    Y = found.receptance(2 * np.pi * LINES_HZ)
    assert found.rigid == 2
    assert found.chi2_per_dof == pytest.approx(1, abs=0.03)
    assert np.sqrt(np.mean(np.abs(Y / exact - 1) ** 2)) < 2e-4
    # Its derivatives are those of small steps.
    left, right = (circular(rng, 1.0, (len(OMEGA), *shape)) for shape in ((2, len(POINTS)), (len(POINTS),)))
    J = found.derivatives(OMEGA, left, right)
    for n in range(0, len(found.vector), 9):
        step = np.zeros(len(found.vector))
        step[n] = 1e-5 * max(abs(found.vector[n]), 1e-9)
        moved = [
            (left @ type(found)(**{**vars_of(found), "vector": found.vector + s * step}).receptance(OMEGA)
             @ right[..., None])[..., 0]
            for s in (1, -1)
        ]  # fmt: skip
        slope = (moved[0] - moved[1]) / (2 * step[n])
        assert J[..., n] == pytest.approx(slope, rel=1e-3, abs=2e-4 * np.abs(slope).max())


def vars_of(found):
    names = ("modes", "rigid", "points", "band", "information")
    return {name: getattr(found, name) for name in names}


def other_model(points):
    """Receptances of a model of the second beam which is too long by a per cent, with a slope among its ports."""
    beam = Beam(0.3232, 24, clamped=False)
    slope = (beam.rows(np.array([0.0301])) - beam.rows(np.array([0.0299]))) / 2e-4
    rows = np.vstack([beam.rows(points), slope])
    return -accelerance(beam.M, beam.C, beam.K + 0j, rows, rows) / (2 * np.pi * LINES_HZ[:, None, None]) ** 2


def true_slope():
    beam = BEAMS[1]
    slope = (beam.rows(np.array([0.0301])) - beam.rows(np.array([0.0299]))) / 2e-4
    return -accelerance(beam.M, beam.C, beam.K + 0j, slope, slope)[:, 0, 0] / (2 * np.pi * LINES_HZ) ** 2


def test_expansion_brings_a_rotation_that_nobody_measured(exact):
    model = other_model(np.array(POINTS))
    expanded = Expansion.by_model(model, np.arange(len(POINTS))).receptance(exact)
    assert expanded[:, :-1, :-1] == pytest.approx(exact, rel=1e-6, abs=1e-16)
    truth = true_slope()
    before, after = (np.median(np.abs(Y[:, -1, -1] / truth - 1)) for Y in (model, expanded))
    assert before > 0.03
    assert after < 0.015


def test_expansion_is_that_of_pyfbs(exact):
    """Its extra of its own: it brings Qt and VTK."""
    expansion = pytest.importorskip("pyfbs.expansion")
    pandas = pytest.importorskip("pandas")
    model = other_model(np.array(POINTS))
    columns = [*(f"Position_{n}" for n in (1, 2, 3)), *(f"Direction_{n}" for n in (1, 2, 3))]
    ports = pandas.DataFrame([[n, 0, 0, 0, 1, 0] for n in range(len(POINTS) + 1)], columns=columns)
    theirs = expansion.semm(model, exact, ports, ports, ports[:-1], ports[:-1], semm_type="basic")
    ours = Expansion.by_model(model, np.arange(len(POINTS))).receptance(exact)
    assert ours == pytest.approx(theirs, rel=1e-6, abs=1e-12 * np.abs(theirs).max())
