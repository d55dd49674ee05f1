"""Abaqus and CalculiX: assembled matrices, substructures, and whose the rows are."""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from recordings import InputError
from twin.rigs.imported import EXAMPLE
from twin.rigs.matrices import read_matrix
from twin.rigs.matrices.found import labels_of
from twin.rigs.matrix_files import read_matrix_pair

SUBSTRUCTURE = Path(__file__).parents[3] / "data" / "matrices" / "calculix-substructure.mtx"
ASSEMBLED = "** of instance A\n1,1, 1,1, 3.0e+06\n2,1, 1,1, -2.0\n2,1, 2,1, 5.0\n2,6, 2,1, -3.0\n2,6, 2,6, 3.5\n"
K = np.array([[3.0e6, -2.0, 0.0], [-2.0, 5.0, -3.0], [0.0, -3.0, 3.5]])
CCX_Hz = [135.9155, 533.8358, 919.1058, 2747.871, 3008.722, 3448.810, 8234.929, 8648.414, 9598.106, 10264.21]
"""Natural frequencies that CalculiX 2.20 itself finds of its example, from a step without MATRIXSTORAGE."""


def written(tmp_path, text, name="K.mtx"):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_calculix_and_its_matrices_have_the_same_natural_frequencies():
    M, K = read_matrix_pair(EXAMPLE / "beam.mas", EXAMPLE / "beam.sti")
    inverse = eigh(M.matrix.toarray(), K.matrix.toarray(), eigvals_only=True)[::-1]
    np.testing.assert_allclose(1 / np.sqrt(inverse[:10]) / (2 * np.pi), CCX_Hz, rtol=1e-6)
    assert (K.labels[0], K.labels[-1]) == tuple(labels_of(np.array([5, 32]), np.array([1, 3])))


def test_a_substructure_names_its_rows():
    found = read_matrix(SUBSTRUCTURE, "stiffness")
    np.testing.assert_array_equal(found.labels, labels_of(np.repeat([2, 3], 3), np.tile([1, 2, 3], 2)))
    matrix = found.matrix.toarray()
    assert matrix[0, 0] == 0.2306410256410e7
    assert matrix[3, 0] == matrix[0, 3] == 0.5294871794872e6
    assert matrix[5, 5] == 0.3374358974359e7
    with pytest.raises(InputError, match="holds the matrices STIFFNESS, no mass; write TYPE=MASS as well"):
        read_matrix(SUBSTRUCTURE, "mass")


def test_lists_of_degrees_of_freedom_hold_until_there_is_another(tmp_path):
    text = (
        "*USER ELEMENT, NODES=3, LINEAR\n** ELEMENT NODES\n**  11, 12,\n**  13\n 1, 2\n 3, 6\n"
        "*MATRIX, TYPE=STIFFNESS\n1.,\n0., 2.,\n0., 0., 3.,\n0., 0., 0., 4.,\n0., 0., 0., 0.,\n5.\n"
        "*MATRIX, TYPE=MASS\n" + "1.,\n" * 15
    )
    found = read_matrix(written(tmp_path, text), "stiffness")
    np.testing.assert_array_equal(found.labels, labels_of(np.array([11, 11, 12, 12, 13]), np.array([1, 2, 1, 2, 6])))
    np.testing.assert_array_equal(found.matrix.diagonal(), [1, 2, 3, 4, 5])
    np.testing.assert_array_equal(read_matrix(tmp_path / "K.mtx", "mass").matrix.toarray(), np.ones((5, 5)))
    with pytest.raises(InputError, match="STIFFNESS: 14 entries; 5 degrees of freedom need 15 of one triangle"):
        read_matrix(written(tmp_path, text.replace("5.\n", "\n")), "stiffness")


@pytest.mark.parametrize("whole", [False, True])
def test_assembled_matrices_with_labels_of_one_triangle_or_both(tmp_path, whole):
    mirrored = "1,1, 2,1, -2.0\n2,1, 2,6, -3.0\n" if whole else ""
    found = read_matrix(written(tmp_path, ASSEMBLED + mirrored), "stiffness")
    np.testing.assert_array_equal(found.matrix.toarray(), K)
    np.testing.assert_array_equal(found.labels, labels_of(np.array([1, 2, 2]), np.array([1, 1, 6])))


def test_assembled_matrices_by_rows_and_columns(tmp_path):
    text = "1 1 3.0D+06\n2 1 -2.0\n2 2 5.0\n3 2 -3.0\n3 3 3.5\n"
    found = read_matrix(written(tmp_path, text), "stiffness")
    np.testing.assert_array_equal(found.matrix.toarray(), K)
    assert found.labels is None


def test_what_abaqus_holds_stays_held(tmp_path):
    stiffness = written(tmp_path, ASSEMBLED.replace("3.0e+06", "1.0e+36"))
    mass = written(tmp_path, "1,1,1,1,1.0\n2,1,2,1,2.0\n", "M.mtx")
    M, K = read_matrix_pair(mass, stiffness)
    np.testing.assert_array_equal(K.held, [0])
    np.testing.assert_array_equal(K.matrix.toarray(), [[0, 0, 0], [0, 5, -3], [0, -3, 3.5]])
    np.testing.assert_array_equal(M.matrix.diagonal(), [0, 2, 0])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("5.0\n", "5.o\n", "line 4: '5.o' is not a number"),
        ("5.0\n", "\n", "line 4: has 4 values where 5 are expected"),
        ("2,6, 2,6", "2.5,6, 2,6", "is not a whole number"),
        ("2,6, 2,6", "2,600, 2,6", "a degree of freedom beyond all that Abaqus has"),
        ("2,6, 2,6", "2,1, 2,1", "an entry stands twice"),
    ],
)
def test_damaged_files_are_refused_in_one_line(tmp_path, old, new, message):
    with pytest.raises(InputError) as caught:
        read_matrix(written(tmp_path, ASSEMBLED.replace(old, new)), "stiffness")
    assert message in str(caught.value)


def test_calculix_needs_its_rows(tmp_path):
    lonely = written(tmp_path, "1 1 2.0\n", "K.sti")
    with pytest.raises(InputError, match=r"K.dof: there is no such file"):
        read_matrix(lonely, "stiffness")
    (tmp_path / "K.dof").write_text("7.1\n7.x\n")
    with pytest.raises(InputError, match=r"K.dof: line 2: '7.x' is not node.direction"):
        read_matrix(lonely, "stiffness")
    with pytest.raises(InputError, match="is a stiffness of CalculiX, given as the mass"):
        read_matrix(lonely, "mass")
