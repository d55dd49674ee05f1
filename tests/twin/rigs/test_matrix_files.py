"""Parts given by matrices: what other programs write is read, and what cannot be a part is refused in one line."""

import io
import struct
import zipfile

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy import sparse
from scipy.io import mmwrite

from recordings import InputError
from twin.rigs.matrices import found
from twin.rigs.matrix_files import read_pairs, read_part_matrices

M = np.diag([2.0, 1.0, 0.0])
K = np.array([[3.0, -2.0, 0.0], [-2.0, 5.0, -3.0], [0.0, -3.0, 3.5]])
NODES = "node,dof,row,x_m,y_m,z_m\n12,x,0,0.0,0.1,0.2\n7,y,1,0.5,0.0,0.0\n12,rz,2,0.0,0.1,0.2\n"
PAIRS = "node_a,node_b,area_m2,nx,ny,nz\n1,11,1e-4,0,0,1\n2,12,2e-4,0.6,0.8004,0\n"


@pytest.fixture
def files(tmp_path):
    """Good files of one part."""
    sparse.save_npz(tmp_path / "mass.npz", sparse.csr_array(M))
    sparse.save_npz(tmp_path / "stiffness.npz", sparse.csr_array(K))
    (tmp_path / "nodes.csv").write_text(NODES)
    return {name: tmp_path / file for name, file in
            (("mass", "mass.npz"), ("stiffness", "stiffness.npz"), ("nodes", "nodes.csv"))}  # fmt: skip


def stiffness_of(files, path):
    return read_part_matrices(**{**files, "stiffness": path}).K.toarray()


def refused(files, **other):
    """The one line of the error."""
    with pytest.raises(InputError) as caught:
        read_part_matrices(**{**files, **other})
    return str(caught.value)


def test_a_part_and_its_nodes(files):
    part = read_part_matrices(**files)
    np.testing.assert_array_equal(part.M.toarray(), M)
    np.testing.assert_array_equal(part.K.toarray(), K)
    assert part.nodes.tolist() == [7, 12]
    np.testing.assert_array_equal(part.coordinates, [[0.5, 0, 0], [0, 0.1, 0.2]])
    assert part.rows == {(12, "x"): 0, (7, "y"): 1, (12, "rz"): 2}
    assert (part.rows.get((12, "rz")), part.rows.get((12, "y")), part.rows.get((99, "x"))) == (2, None, None)
    np.testing.assert_array_equal(part.coordinates_of(12), [0, 0.1, 0.2])
    for unknown in (1, 8, 99):
        with pytest.raises(KeyError):
            part.coordinates_of(unknown)


def test_internal_rows_further_columns_and_numbers_as_spreadsheets_write_them(files):
    files["nodes"].write_text("# exported\nrow, name ,dof,node,z_m,y_m,x_m\n1.0, tip ,y,7.0,3,2,1e0\n\n")
    part = read_part_matrices(**files)
    assert part.rows == {(7, "y"): 1}
    np.testing.assert_array_equal(part.coordinates, [[1, 2, 3]])


@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
@pytest.mark.parametrize("form", ["coordinate", "array"])
@pytest.mark.parametrize("field", ["real", "integer"])
def test_matrix_market_files(files, tmp_path, symmetry, form, field):
    path = tmp_path / "K.MTX"
    whole = np.rint(K)
    with path.open("wb") as stream:
        mmwrite(stream, whole if form == "array" else sparse.coo_array(whole), symmetry=symmetry, field=field)
    assert path.read_text().startswith(f"%%MatrixMarket matrix {form} {field} {symmetry}")
    np.testing.assert_array_equal(stiffness_of(files, path), whole)


@pytest.mark.parametrize("form", ["csr", "csc", "coo", "bsr", "dia"])
@pytest.mark.parametrize("kind", ["array", "matrix"])
def test_scipy_files_of_every_format(files, tmp_path, form, kind):
    matrix = getattr(sparse, f"{form}_{kind}")(K.astype(np.float32))
    sparse.save_npz(tmp_path / "K.npz", matrix, compressed=form == "csr")
    np.testing.assert_array_equal(stiffness_of(files, tmp_path / "K.npz"), K)


def test_rounding_across_the_diagonal_is_split(files, tmp_path):
    rounded = K.copy()
    rounded[0, 1] += 4e-6
    sparse.save_npz(tmp_path / "K.npz", sparse.csr_array(rounded))
    found = stiffness_of(files, tmp_path / "K.npz")
    assert found[0, 1] == found[1, 0] == pytest.approx(K[0, 1] + 2e-6, abs=1e-12)


HEAD = "%%MatrixMarket matrix coordinate real general\n% exported\n"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("K.csv", "1,2\n", "'.csv' is not a suffix of a matrix; use .mtx, .npz, .op4, .pch, .sti or .mas"),
        ("K", "1,2\n", "'' is not a suffix of a matrix; use .mtx, .npz, .op4, .pch, .sti or .mas"),
        ("K.mtx", "1,1,3.4,0\n", "holds neither 'node, dof, node, dof, value' nor 'row, column, value'; write it with"),
        ("K.mtx", "", "holds neither 'node, dof, node, dof, value'"),
        ("K.mtx", HEAD[:30] + "\n", "cannot be read as a Matrix Market file: Line 1: "),
        ("K.mtx", HEAD + "3 3 2\n1 1 1\n", "Truncated file"),
        ("K.mtx", HEAD + "3 3 1\n0 1 1\n", "Row index out of bounds"),
        ("K.mtx", HEAD + "3 3 9000\n1 1 1\n", "says it has 9000 entries, more than the file can hold"),
        ("K.mtx", HEAD + "3 3 1\n1 1 nan\n", "line 4: 'n' does not belong to a number"),
        (
            "K.mtx",
            HEAD + "3 3 2\n1 1 1.0\n2 2 1.0D+03\n",
            "line 5: 'D' does not belong to a number; write numbers like",
        ),
        ("K.mtx", HEAD + "3 3 1\n1 1 3,5\n", "line 4: ',' does not belong to a number"),
        ("K.mtx", HEAD + "3 3 1\n1 1 1e999\n", "row 0 (from 0): an entry is not finite; export it again"),
        ("K.mtx", HEAD + "3 2 1\n1 1 1\n", "is 3 x 2, not square; give the whole matrix"),
        ("K.mtx", HEAD + "200001 200001 1\n1 1 1\n", "is of order 200001; 1 to 200000 are allowed"),
        ("K.mtx", HEAD + "0 0 0\n", "is of order 0"),
        ("K.mtx", HEAD.replace("real", "complex") + "3 3 1\n1 1 1 0\n", "line 1: complex general; needs a real"),
        ("K.mtx", HEAD.replace("real", "pattern") + "3 3 1\n1 1\n", "line 1: pattern general; needs a real"),
        ("K.mtx", HEAD.replace("general", "skew-symmetric") + "3 3 1\n2 1 1\n", "line 1: real skew-symmetric"),
        ("K.mtx", HEAD.replace("general", "symmetric") + "3 3 2\n2 1 1\n1 2 1\n", "an entry stands twice though"),
        (
            "K.mtx",
            HEAD + "3 3 4\n1 1 9\n3 2 -2\n2 2 9\n3 3 9\n",
            "row 1, column 2 (from 0): not symmetric: differs by 2",
        ),
        ("K.mtx", HEAD + "2 2 1\n1 1 1\n", "is of order 2, and the mass mass.npz of order 3; give both in the same"),
        ("K.mtx", HEAD + "3 3 2\n1 1 4\n2 2 -1e-3\n", "row 1 (from 0): the diagonal's entry -0.001 is negative"),
        ("K.npz", "not a zip", "cannot be read as a sparse matrix of scipy's: File is not a zip file; export it again"),
    ],
)
def test_what_cannot_be_a_matrix_is_refused_in_one_line(files, tmp_path, name, text, message):
    path = tmp_path / name
    path.write_text(text)
    line = refused(files, stiffness=path)
    assert line.startswith(f"{path}: ")
    assert message in line
    assert "\n" not in line


def test_files_that_are_missing_or_no_files(files, tmp_path):
    for name in files:
        gone = tmp_path / f"gone{files[name].suffix}"
        assert refused(files, **{name: gone}) == f"{gone}: there is no such file"
    (tmp_path / "folder.npz").mkdir()
    assert "is not a file" in refused(files, mass=tmp_path / "folder.npz")


def test_masses_that_cannot_be(files, tmp_path):
    sparse.save_npz(tmp_path / "M.npz", sparse.csr_array(np.diag([1.0, -0.5, 1.0])))
    assert "row 1 (from 0): the diagonal's entry -0.5 is negative" in refused(files, mass=tmp_path / "M.npz")
    sparse.save_npz(tmp_path / "M.npz", sparse.csr_array((3, 3)))
    assert "every entry is zero" in refused(files, mass=tmp_path / "M.npz")


def test_a_rigid_part_has_no_stiffness(files, tmp_path):
    sparse.save_npz(tmp_path / "K.npz", sparse.csr_array((3, 3)))
    assert not np.any(stiffness_of(files, tmp_path / "K.npz"))


def test_large_files(files, tmp_path, monkeypatch):
    huge = tmp_path / "huge.npz"
    with huge.open("wb") as stream:
        stream.truncate(found.SIZE_LIMIT_BYTES + 1)
    assert "larger than 512 MiB, the limit for matrices" in refused(files, stiffness=huge)
    monkeypatch.setattr(found, "SIZE_LIMIT_BYTES", 1 << 20)
    packed = tmp_path / "packed.npz"
    sparse.save_npz(packed, sparse.csr_array(np.ones((400, 400))), compressed=True)
    assert packed.stat().st_size < 1 << 20
    assert "holds more than 1 MiB" in refused(files, stiffness=packed)


CSR = {"format": b"csr", "shape": (3, 3), "data": np.ones(3), "indices": np.arange(3), "indptr": np.arange(4)}


@pytest.mark.parametrize(
    "change",
    [
        {"indptr": np.array([0, 9_000_000_000_000, 0, 3])},
        {"indptr": np.array([0, 900_000, 0, 0]), "data": np.ones(0), "indices": np.arange(0)},
        {"indptr": np.array([0, 1, 2, -3])},
        {"indptr": np.array([0, 1, 2, 9])},
        {"indices": np.array([0, 1, 1 << 40])},
        {"indices": np.array([0, 1, -7])},
        {"indices": np.array([0.0, np.nan, 1.0])},
        {"data": np.array([print, len, max], dtype=object)},
        {"data": np.array(["a", "b", "c"])},
        {"data": np.array([1j, 1, 1])},
        {"data": np.array([True, True, True])},
        {"shape": (1 << 50, 1 << 50)},
        {"shape": (3,)},
        {"shape": (-3, -3)},
        {"format": b"xyz"},
        {"format": np.zeros(7)},
        {"format": b"bsr", "data": np.ones((3, 0, 0))},
        {"format": b"coo", "row": np.array([0, 1, 1 << 60]), "col": np.arange(3)},
        {"format": b"coo"},
    ],
)
def test_npz_files_that_lie(files, tmp_path, change):
    path = tmp_path / "K.npz"
    np.savez(path, **{**CSR, **change})
    assert refused(files, stiffness=path).startswith(f"{path}: ")


def test_offsets_of_diagonals_beyond_the_matrix_hold_nothing(files, tmp_path):
    offsets = np.array([-(1 << 30), 0, 1 << 30])
    np.savez(tmp_path / "K.npz", format=b"dia", shape=(3, 3), data=np.ones((3, 9)), offsets=offsets)
    np.testing.assert_array_equal(stiffness_of(files, tmp_path / "K.npz"), np.eye(3))


def test_an_array_that_claims_more_than_it_holds(files, tmp_path):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (1 << 58,)})
    np.savez(tmp_path / "K.npz", **CSR)
    with zipfile.ZipFile(tmp_path / "K.npz") as good, zipfile.ZipFile(tmp_path / "liar.npz", "w") as bad:
        for name in good.namelist():
            bad.writestr(name, header.getvalue() if name == "data.npy" else good.read(name))
    assert "cannot be read as a sparse matrix" in refused(files, stiffness=tmp_path / "liar.npz")


def good_file(suffix, folder):
    """A whole file of each format."""
    if suffix == ".npz":
        sparse.save_npz(folder / "good.npz", sparse.coo_array(K), compressed=False)
        return (folder / "good.npz").read_bytes()
    if suffix == "market.mtx":
        stream = io.BytesIO()
        mmwrite(stream, sparse.coo_array(K))
        return stream.getvalue()
    return {".op4": OP4, "text.op4": OP4_TEXT, ".pch": DMIG, ".sti": STI, ".mtx": ABAQUS, "sub.mtx": SUBSTRUCTURE}[
        suffix
    ]


def words(*numbers):
    """A Fortran record of integers, of four bytes each, and floats, of eight."""
    body = b"".join(struct.pack("<d" if isinstance(n, float) else "<i", n) for n in numbers)
    return struct.pack("<i", len(body)) + body + struct.pack("<i", len(body))


OP4 = (
    struct.pack("<5i8si", 24, 3, 3, 6, 2, b"KAA     ", 24) + words(1, 1, 4, 3.0, -2.0)
    + words(2, 0, 5, 5 * 65536 + 2, 5.0, -3.0) + words(3, 3, 2, 3.5) + words(4, 1, 2, 1.0)
)  # fmt: skip
OP4_TEXT = b"""\
       3       3       6       2KAA     1P,3E23.16
       1       1       2
 3.0000000000000000E+00-2.0000000000000000E+00
       2       0       5
  327682
 5.0000000000000000E+00-3.0000000000000000E+00
       3       3       1
 3.5000000000000000E+00
       4       1       1
 1.0000000000000000E+00
"""
DMIG = b"""\
DMIG    KAAX    0       6       1       0
DMIG*   KAAX                          12               1
*                     12               1 3.000000000D+00
DMIG    KAAX    12      6               12      6       3.5
DMIG,KAAX,7,2,,12,1,-2.,
,7,2,5.0,,12,6,-3.
"""
STI = b"1 1 3.0e0\n1 2 -2.0e0\n2 2 5.0e0\n2 3 -3.0e0\n3 3 3.5e0\n"
ABAQUS = b"** rows\n12,1,12,1,3.0\n12,1,7,2,-2.0\n7,2,7,2,5.0\n7,2,12,6,-3.0\n12,6,12,6,3.5\n"
SUBSTRUCTURE = (
    b"*USER ELEMENT,NODES=3,LINEAR\n** ELEMENT NODES\n**12,7,12\n1\n2,2\n3,6\n*MATRIX,TYPE=STIFFNESS\n"
    b"3.,\n-2.,5.,\n0.,-3.,3.5\n"
)
SUFFIXES = ["market.mtx", ".npz", ".op4", "text.op4", ".pch", ".sti", ".mtx", "sub.mtx"]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_one_stiffness_in_every_format(files, tmp_path, suffix):
    path = tmp_path / f"good{suffix}"
    path.write_bytes(good_file(suffix, tmp_path))
    (tmp_path / "good.dof").write_text("12.1\n7.2\n12.6\n")
    part = read_part_matrices(**{**files, "stiffness": path})
    rows = [part.rows[key] for key in ((12, "x"), (7, "y"), (12, "rz"))]
    np.testing.assert_array_equal(part.K.toarray()[np.ix_(rows, rows)], K)


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), suffix=st.sampled_from(SUFFIXES))
def test_damaged_files_are_read_or_refused(files, tmp_path, data, suffix):
    path = tmp_path / f"damaged{suffix}"
    (tmp_path / "damaged.dof").write_text("12.1\n7.2\n12.6\n")
    raw = bytearray(good_file(suffix, tmp_path))
    for at, byte in data.draw(st.lists(st.tuples(st.integers(0, len(raw) - 1), st.integers(0, 255)), max_size=4)):
        raw[at] = byte
    path.write_bytes(bytes(raw[: data.draw(st.integers(0, len(raw)))]) if data.draw(st.booleans()) else bytes(raw))
    try:
        part = read_part_matrices(**{**files, "stiffness": path})
    except InputError:
        return
    assert np.all(np.isfinite(part.K.data))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (NODES, "", "is empty"),
        ("dof,row", "axis,row", "line 1: no column 'dof'; the columns are 'node', 'axis', 'row', 'x_m', 'y_m', 'z_m'"),
        ("dof,row", "row,row", "line 1: column 'row' stands twice"),
        ("7,y,1", "7,y,1,5", "line 3: has 7 values for 6 columns"),
        ("7,y,1", "seven,y,1", "line 3, column node: 'seven' is not a number"),
        ("7,y,1", "7.5,y,1", "line 3, column node: '7.5' is not a whole number from 0 up"),
        ("7,y,1", "-7,y,1", "line 3, column node: '-7' is not a whole number from 0 up"),
        ("7,y,1", "1e300,y,1", "line 3, column node: '1e300' is not a whole number from 0 up"),
        ("7,y,1", "7,Y,1", "line 3, column dof: 'Y' is not a degree of freedom; use x, y, z, rx, ry, rz"),
        ("7,y,1", "7,y,3", "line 3, column row: '3' is beyond the matrices' last row, 2; rows are counted from 0"),
        ("7,y,1", "7,y,0", "line 3, column row: row 0 has a degree of freedom already; give each row once"),
        ("12,rz,2", "12,x,2", "line 4, column dof: x of node 12 stands twice; give each once"),
        ("12,rz,2,0.0", "12,rz,2,0.001", "line 4, column x_m: node 12 is elsewhere on another line"),
        ("0.5,0.0", "nan,0.0", "line 3, column x_m: 'nan' is not a number"),
    ],
)
def test_tables_of_nodes_that_do_not_fit(files, old, new, message):
    files["nodes"].write_text(NODES.replace(old, new))
    line = refused(files)
    assert line.startswith(f"{files['nodes']}: ")
    assert message in line


def test_pairs(tmp_path):
    path = tmp_path / "pairs.csv"
    path.write_text(PAIRS)
    pairs = read_pairs(path)
    assert (pairs.a.tolist(), pairs.b.tolist(), pairs.area_m2.tolist()) == ([1, 2], [11, 12], [1e-4, 2e-4])
    np.testing.assert_allclose(np.linalg.norm(pairs.normal, axis=1), 1.0, rtol=1e-15)
    np.testing.assert_allclose(pairs.normal, [[0, 0, 1], [0.6, 0.8, 0]], atol=4e-4)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PAIRS.partition("\n")[0], "has 0 rows below the column names; 1 to 10000 are allowed"),
        (PAIRS + "3,13,1e-4,0,0,1\n" * 9999, "has 10001 rows below the column names; 1 to 10000 are allowed"),
        (PAIRS.replace("area_m2", "area"), "line 1: no column 'area_m2'"),
        (PAIRS.replace("1,11", "1,b"), "line 2, column node_b: 'b' is not a number"),
        (PAIRS.replace("2e-4", "0"), "line 3, column area_m2: '0' is not above zero"),
        (PAIRS.replace("2e-4", "-1"), "line 3, column area_m2: '-1' is not above zero"),
        (PAIRS.replace("0.8004", "0.9"), "line 3, column nx: the normal is 1.08167 long; give a unit vector"),
        (PAIRS.replace("0,0,1", "0,0,0"), "line 2, column nx: the normal is 0 long"),
        (PAIRS.replace("0,0,1", "0,0,inf"), "line 2, column nz: 'inf' is not a number"),
    ],
)
def test_pairs_that_cannot_be(tmp_path, text, message):
    path = tmp_path / "pairs.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_pairs(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)
