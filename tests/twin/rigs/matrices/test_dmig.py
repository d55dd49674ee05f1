"""DMIG entries: small, large and free fields, symmetric and square, grid and scalar points."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from recordings import InputError
from twin.rigs.matrices import read_matrix
from twin.rigs.matrices.found import labels_of

K = np.array([[3.0e6, -2.0, 0.0], [-2.0, 5.0, -3.0], [0.0, -3.0, 3.5]])
"""Of grid 7 along x and about z, and of scalar point 20."""
LARGE = """$ punched
DMIG    KAAX           0       6       2       0                       3
DMIG*   KAAX                           7               1
*                      7               1 3.000000000D+06
DMIG*   KAAX                           7               6
*                      7               1-2.000000000D+00
*                      7               6 5.000000000D+00
DMIG*   KAAX                          20               0
*                      7               6-3.000000000D+00
*                     20               0 3.500000000D+00
"""
SMALL = """DMIG    KAAX    0       6       1       0
DMIG    KAAX    7       1               7       1       3.+6
DMIG    KAAX    7       6               7       1       -2.             +A
+A      7       6       5.0
DMIG    KAAX    20      0               7       6       -3.
        20              3.5
GRID    7               1.0     2.0     3.0
"""
FREE = """DMIG,KAAX,0,6,1,0
DMIG,KAAX,7,1,,7,1,3.0E6
DMIG,KAAX,7,6,,7,1,-2.0,,
,7,6,5.0
DMIG,KAAX,20,0,,7,6,-3.,
,20,0,3.5
"""


@pytest.mark.parametrize("text", [LARGE, SMALL, FREE], ids=["large", "small", "free"])
def test_one_matrix_in_every_width_of_fields(tmp_path, text):
    path = tmp_path / "K.pch"
    path.write_text(text)
    found = read_matrix(path, "stiffness")
    np.testing.assert_array_equal(found.matrix.toarray(), K)
    np.testing.assert_array_equal(found.labels, labels_of(np.array([7, 7, 20]), np.array([1, 6, 0])))


def test_punched_matrices_are_read_as_pyyeti_reads_them(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        bulk = pytest.importorskip("pyyeti.nastran.bulk")
        source = Path(bulk.__file__).parents[1] / "tests" / "nastran_dmig_data" / "matrix_factory.pch"
        expected = bulk.rddmig(str(source))
    for name in ("patrn", "ident", "randm"):
        blocks = source.read_text().split("DMIG")
        path = tmp_path / f"{name}.pch"
        path.write_text("".join(f"DMIG{block}" for block in blocks if block.lstrip("*").split()[:1] == [name.upper()]))
        whole = expected[name].to_numpy()
        if np.allclose(whole, whole.T):
            found = read_matrix(path, "mass")
            np.testing.assert_array_equal(found.matrix.toarray(), whole)
            grid, component = np.array(expected[name].index.to_list()).T
            np.testing.assert_array_equal(found.labels, labels_of(grid, component))
        else:
            with pytest.raises(InputError, match="not symmetric"):
                read_matrix(path, "mass")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("5.000000000D+00", "5.0X", "line 5, DMIG field 12: '5.0X' is not a number"),
        ("       6       2       0", "       9       2       0", "KAAX is of form 9, not square (1) or symmetric (6)"),
        ("       6       2       0", "       6       4       0", "line 2: KAAX is complex; needs a real matrix"),
        ("20               0\n*  ", "20             900\n*  ", "line 8, DMIG field 4: '900' is no component"),
        (
            "*                      7               6 5",
            "*                     -7               6 5",
            "'-7' is no grid point's",
        ),
        ("               6 5.0", "               1 5.0", "an entry stands twice; write each once"),
    ],
)
def test_damaged_entries_are_refused_in_one_line(tmp_path, old, new, message):
    path = tmp_path / "K.pch"
    assert old in LARGE
    path.write_text(LARGE.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_matrix(path, "stiffness")
    assert message in str(caught.value)
