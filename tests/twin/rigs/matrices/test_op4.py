"""OUTPUT4: what Nastran wrote is read as an independent reader reads it, and what is damaged is refused."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from recordings import InputError
from twin.rigs.matrices import read_matrix
from twin.rigs.matrices.op4 import op4_matrices

K = np.array([[3.0, -2.0, 0.0], [-2.0, 5.0, -3.0], [0.0, -3.0, 3.5]])
DENSE = (
    "       3       3       6       2KAA     1P,3E23.16\n       1       1       2\n"
    " 3.0000000000000000E+00-2.0000000000000000E+00\n       2       1       3\n"
    "-2.0000000000000000E+00 5.0000000000000000E+00-3.0000000000000000E+00\n       3       2       2\n"
    "-3.0000000000000000E+00 3.5000000000000000D+00\n       4       1       1\n 1.0000000000000000E+00\n"
)


@pytest.fixture
def yeti():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip("pyyeti.nastran.op4")


def test_files_of_nastran_in_every_form_are_read_as_pyyeti_reads_them(yeti):
    folder = Path(yeti.__file__).parents[1] / "tests" / "nastran_op4_data"
    read = set()
    for form in ("dense", "bigmat", "nonbigmat"):
        for path in sorted(folder.glob(f"*le_{form}_*.op4")) + sorted(folder.glob(f"double_{form}_*.op4")):
            data = path.read_bytes()
            if path.stem.endswith("badname"):
                continue
            found = {m.name: m for m in op4_matrices(path, data)}
            for name, expected in zip(*yeti.read(str(path), into="list")[:2], strict=True):
                if np.iscomplexobj(expected):
                    continue
                matrix = np.zeros(found[name.upper()].shape)
                for column, row, values in found[name.upper()].strings:
                    matrix[row : row + len(values), column] = values
                np.testing.assert_array_equal(matrix, expected)
                read.add(path.name)
    assert len(read) >= 18


def test_the_matrices_of_a_superelement_are_found_by_their_names(yeti):
    path = Path(yeti.__file__).parents[1] / "tests" / "nas2cam_extseout" / "outboard.op4"
    names, matrices = yeti.read(str(path), into="list")[:2]
    for role, name in (("mass", "mxx"), ("stiffness", "kxx")):
        found = read_matrix(path, role).matrix.toarray()
        expected = matrices[names.index(name)]
        np.testing.assert_allclose(found, (expected + expected.T) / 2, rtol=0, atol=1e-6 * abs(expected).max())


def test_what_another_program_writes_in_words_of_either_order(yeti, tmp_path):
    for number, options in enumerate(
        {"binary": binary, "endian": endian, "sparse": sparse}
        for binary in (True, False)
        for endian in "<>"
        for sparse in ("dense", "bigmat", "nonbigmat")
    ):
        path = tmp_path / f"{number}.op4"
        yeti.write(str(path), ["kaa"], [K], forms=[6], **options)
        np.testing.assert_allclose(read_matrix(path, "stiffness").matrix.toarray(), K, rtol=1e-15)


def test_one_triangle_of_a_symmetric_matrix_is_enough(tmp_path):
    path = tmp_path / "K.op4"
    path.write_text(DENSE)
    np.testing.assert_array_equal(read_matrix(path, "stiffness").matrix.toarray(), K)
    lines = DENSE.splitlines()
    lines[4] = "-0.0000000000000000E+00" + lines[4][23:]
    lines[5:7] = ["       3       3       1", " 3.5000000000000000E+00"]
    path.write_text("\n".join(lines) + "\n")
    np.testing.assert_array_equal(read_matrix(path, "stiffness").matrix.toarray(), K)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("3.5000000000000000D+00", "3.5", "line 7: not OUTPUT4: 2 values in column 3"),
        ("       3       2       2\n", "       3       2       3\n", "2 values in column 3, which says 3"),
        ("       4       1       1\n 1.0000000000000000E+00\n", "", "ends in the middle of a matrix"),
        ("       3       2       2\n", "       3       2\n", "line 6: not OUTPUT4: 2 words where 3 whole numbers are"),
        ("       6       2KAA ", "       6       4KAA ", "KAA is complex; needs a real matrix"),
        ("       3       3       6", "       3 2000001       6", "is 2000001 x 3, not square"),
        ("       3       2       2\n", "       3       3       2\n", "KAA has entries outside its 3 rows"),
    ],
)
def test_damaged_text_is_refused_in_one_line(tmp_path, old, new, message):
    path = tmp_path / "K.op4"
    text = DENSE.replace(old, new)
    assert text != DENSE
    if message.startswith("line 7"):
        text = text.replace("-3.0000000000000000E+00 3.5", "-3.0000000000000000E+00 x.5")
        message = "could not convert string to float: 'x.5'"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_matrix(path, "stiffness")
    assert str(caught.value).startswith(f"{path}: ")
    assert message.upper() in str(caught.value).upper()


def test_two_that_could_be_the_mass_are_told(tmp_path):
    path = tmp_path / "both.op4"
    path.write_text(DENSE.replace("KAA", "M1 ") + DENSE.replace("KAA", "M2 "))
    with pytest.raises(InputError, match="holds the matrices M1, M2; which is the mass"):
        read_matrix(path, "mass")
