"""Lists of nodes of other programs."""

import warnings

import numpy as np
import pytest
import pyuff

from recordings import InputError
from twin.rigs.node_tables import read_node_table

NODES, PLACES = np.array([3, 7, 12]), np.array([[0.0, 0.1, -0.2], [1.5, 0.0, 0.0], [2.0, -3.0, 4.0]])


def check(path):
    table = read_node_table(path, order=9)
    np.testing.assert_array_equal(table.nodes, NODES)
    np.testing.assert_allclose(table.coordinates, PLACES, atol=1e-6)
    assert table.rows is None


@pytest.mark.parametrize("kind", [15, 2411])
def test_universal_files_of_pyuff(tmp_path, kind):
    path = tmp_path / "nodes.unv"
    x, y, z = PLACES.T
    same = np.zeros(3, int)
    heads = {15: {"node_nums": NODES, "def_cs": same, "disp_cs": same, "color": same},
             2411: {"grid_global": NODES, "export_cs_number": same, "grid_n": NODES, "cs_number": same, "disp_cs": same,
                    "def_cs": same, "color": same, "node_nums": NODES}}  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        pyuff.UFF(str(path)).write_sets([{"type": kind, **heads[kind], "x": x, "y": y, "z": z}], mode="add")
    check(path)


INPUT = "*HEADING\n1,2\n*Node, nset=A\n 3, 0., .1, -0.2\n** between\n7, 1.5\n12, 2.,-3.,4.,\n*ELEMENT\n1,2\n"
GRIDS = """\
GRID    3               0.      .1      -.2
GRID,7,,1.5,0.,
GRID*                 12               0 0.200000000E+01-0.300000000E+01
*        0.4000000000+01
CBAR    1       2
"""


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("n.csv", "node,x,y,z\n12,2,-3,4\n3,0,0.1,-0.2\n7,1.5,0,0\n"),
        ("n.csv", "z_m,node,x_m,y_m\n4,12,2,-3\n-0.2,3,0,0.1\n0,7,1.5,0\n"),
        ("n.inp", INPUT),
        ("n.bdf", GRIDS),
    ],
)
def test_lists_in_text(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    check(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("n.inp", "*NODE\n1, x, 2, 3\n", "line 2: is no node with its coordinates"),
        ("n.inp", "*ELEMENT\n1, 2\n", "holds 0 nodes"),
        ("n.inp", "*NODE\n1,0,0,0\n1,1,0,0\n", "node 1: has two places; give a node one place"),
        ("n.inp", "*NODE\n1,nan,0,0\n", "node 1: has no number or no place"),
        (
            "n.bdf",
            "GRID    1       5       0.      0.      0.\n",
            "line 1, GRID field 3: '5' is a coordinate system of",
        ),
        ("n.csv", "node,x,y\n1,2,3\n", "no column 'x_m'"),
    ],
)
def test_what_is_no_list_of_nodes_is_refused_in_one_line(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError) as caught:
        read_node_table(tmp_path / name, order=9)
    assert message in str(caught.value)
