"""A weakened section that covers elements in part."""

from itertools import pairwise

import numpy as np
import pytest
from beam_rows import curvature
from scipy.linalg import eigh

from twin.diagnose.models import CAUSES
from twin.structure import assemble


@pytest.mark.parametrize("position_m", [0.0571, 0.0585, 0.0612, 0.0626])
def test_a_large_stiffness_loss_softens_as_much_wherever_it_lies_in_an_element(by_hand, structure, position_m):
    """Against a mesh eight times as fine, of which whole elements are weakened."""
    rig, factor = by_hand.rig, 0.6
    half = (rig.lower.length + rig.upper.length) / rig.mesh.beam_elements / 2
    nominal = rig.joint.preload["120N"]
    E, G = nominal.normal_modulus, nominal.shear_modulus
    omega = np.array([160.0, 170.0])
    evidence = by_hand.evidence(omega, np.ones((2, 3), complex))
    modification = CAUSES["stiffness-loss"].modification(evidence, {}, {"factor": factor, "position_m": position_m})
    (attachment,) = modification.attachments
    rows, lost = attachment.rows(structure), attachment.stiffness(omega)[0]
    K = structure.stiffness(E, G)
    found = np.sqrt(eigh(K + rows.T @ np.diag(lost) @ rows, structure.M, eigvals_only=True)[:4])
    found = found / np.sqrt(eigh(K, structure.M, eigvals_only=True)[:4]) - 1

    fine = assemble(rig, layout=rig.layout(beam_elements=8 * rig.mesh.beam_elements))
    x, w = np.polynomial.legendre.leggauss(3)
    EI = rig.lower.youngs_modulus * rig.lower.second_moment
    nodes = fine.meshes["lower"].s
    edges = np.unique([position_m - half, position_m + half, *nodes[np.abs(nodes - position_m) < half]])
    Kf = fine.stiffness(E, G)
    weaker = Kf.copy()
    for a, b in pairwise(edges):
        for xi, weight in zip(x, w, strict=True):
            row = curvature(fine, (a + b) / 2 + (b - a) / 2 * xi)
            weaker -= (1 - factor) * EI * weight * (b - a) / 2 * np.outer(row, row)
    expected = np.sqrt(eigh(weaker, fine.M, eigvals_only=True)[:4] / eigh(Kf, fine.M, eigvals_only=True)[:4]) - 1
    assert found == pytest.approx(expected, rel=0.02, abs=1e-3 * np.max(np.abs(expected)))
