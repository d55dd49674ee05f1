"""Parts given by matrices: mass and stiffness, the table of their nodes, and tables of pairs of nodes."""

import warnings
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from scipy.io import mminfo, mmread
from scipy.sparse import coo_array, csr_array, load_npz

from recordings.columns import Columns
from recordings.errors import InputError
from recordings.reader import open_input

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

DOFS = ("x", "y", "z", "rx", "ry", "rz")
"""Displacements along, and rotations about, the axes."""
SIZE_LIMIT_BYTES = 512 << 20
"""Of a matrix's file, and of what it holds after decompression."""
ORDER_LIMIT = 200_000
PAIR_LIMIT = 10_000
ASYMMETRY = 1e-6
"""Largest difference across the diagonal, over the largest entry, that is taken for rounding."""
NEGATIVE = 1e-12
"""By so much of the largest entry rounding may take a diagonal entry below zero."""
SAME_PLACE_m = 1e-9
NORMAL_LENGTH = 1e-3
_NUMERIC = b"0123456789+-.eE \t\r\n"


@dataclass(frozen=True, eq=False)
class PartMatrices:
    """A part by its matrices.

    Attributes
    ----------
    M, K : sparse, (n, n)
        Symmetric mass and stiffness; kg and N/m, for rotations kg m2 and N m/rad.
    nodes : ndarray of int, (k,)
        Numbers of the nodes, rising.
    coordinates : ndarray, (k, 3)
        Where they are, m.
    rows : dict
        Row of the matrices of (node, dof), dof one of `DOFS`; rows of no node are internal.
    """

    M: csr_array
    K: csr_array
    nodes: Integers
    coordinates: Array
    rows: dict[tuple[int, str], int]

    def row(self, node: int, dof: str) -> int | None:
        """Row of a node's degree of freedom; None where it has none."""
        return self.rows.get((node, dof))

    def coordinates_of(self, node: int) -> Array:
        """Where a node is, (3,), m; KeyError if there is no such node."""
        at = int(np.searchsorted(self.nodes, node))
        if at == len(self.nodes) or self.nodes[at] != node:
            raise KeyError(node)
        return self.coordinates[at]


@dataclass(frozen=True, eq=False)
class NodePairs:
    """Pairs of nodes that a joint or a tie connects.

    Attributes
    ----------
    a, b : ndarray of int, (m,)
        Node numbers on the first and on the second part.
    area_m2 : ndarray, (m,)
        What a pair stands for.
    normal : ndarray, (m, 3)
        Unit vectors from a to b.
    """

    a: Integers
    b: Integers
    area_m2: Array
    normal: Array


def read_part_matrices(mass: Path, stiffness: Path, nodes: Path) -> PartMatrices:
    """Read a part's matrices (Matrix Market ``.mtx`` or scipy's ``.npz``) and the table of its nodes.

    Raises
    ------
    InputError
        If a file cannot be read, is too large, or is not what a mass, a stiffness or a table of nodes can be.
    """
    M, K = _matrix(mass), _matrix(stiffness)
    if M.shape != K.shape:
        reason = f"is of order {K.shape[0]}, and the mass {Path(mass).name} of order {M.shape[0]}"
        raise InputError(stiffness, "", reason, "give both in the same degrees of freedom")
    for path, matrix in ((mass, M), (stiffness, K)):
        diagonal, largest = matrix.diagonal(), abs(matrix).max()
        if largest == 0 and matrix is M:
            raise InputError(path, "", "every entry is zero", "check the export and the file's name")
        if np.any(bad := diagonal < -NEGATIVE * largest):
            row = int(np.argmax(bad))
            reason = f"the diagonal's entry {diagonal[row]:g} is negative, which no mass or stiffness has"
            raise InputError(path, f"row {row} (from 0)", reason, "check the export and its signs")
    return PartMatrices(M, K, *_nodes(nodes, M.shape[0]))


def read_pairs(path: Path) -> NodePairs:
    """Read pairs of nodes: columns node_a, node_b, area_m2, nx, ny, nz; others are ignored.

    Raises
    ------
    InputError
        With line and column, if the file cannot be read or a value is missing or impossible.
    """
    table = Columns(path, "node_a", "node_b", "area_m2", "nx", "ny", "nz", most_rows=PAIR_LIMIT)
    a, b, area = table.integers("node_a"), table.integers("node_b"), table.numbers("area_m2", above=0)
    normal = np.column_stack([table.numbers(name) for name in ("nx", "ny", "nz")])
    length = np.linalg.norm(normal, axis=1)
    if np.any(wrong := np.abs(length - 1) > NORMAL_LENGTH):
        at = int(np.argmax(wrong))
        table.refuse(at, "nx", f"the normal is {length[at]:g} long", "give a unit vector from node_a to node_b")
    return NodePairs(a, b, area, normal / length[:, None])


def _matrix(path: Path) -> csr_array:
    """A symmetric matrix of finite numbers; what rounding left between its halves is split."""
    path = Path(path)
    readers = {".mtx": _matrix_market, ".npz": _npz}
    if (reader := readers.get(path.suffix.lower())) is None:
        raise InputError(path, "", f"{path.suffix!r:.20} is not a suffix of a matrix", "use .mtx or .npz")
    with open_input(path) as stream:
        if stream.seek(0, 2) > SIZE_LIMIT_BYTES:
            raise InputError(path, "", f"larger than {SIZE_LIMIT_BYTES >> 20} MiB, the limit for matrices")
        stream.seek(0)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                matrix = reader(path, stream)
        except InputError:
            raise
        except Exception as error:  # the libraries let through whatever a broken file provokes
            what = {".mtx": "a Matrix Market file", ".npz": "a sparse matrix of scipy's"}[path.suffix.lower()]
            raise InputError(path, "", f"cannot be read as {what}: {str(error)[:120]}", "export it again") from error
    if not np.all(np.isfinite(matrix.data)):
        row = int(np.searchsorted(matrix.indptr, np.argmin(np.isfinite(matrix.data)), side="right")) - 1
        raise InputError(path, f"row {row} (from 0)", "an entry is not finite", "export it again")
    apart = abs(matrix - matrix.T).tocoo()
    if apart.nnz and (worst := apart.data.max()) > ASYMMETRY * abs(matrix).max():
        at = int(np.argmax(apart.data))
        place = f"row {apart.row[at]}, column {apart.col[at]} (from 0)"
        reason = f"not symmetric: differs by {worst:g} from the entry across the diagonal"
        raise InputError(path, place, reason, "a file of one triangle says 'symmetric' in its first line")
    whole = csr_array(matrix / 2 + matrix.T / 2)
    whole.eliminate_zeros()
    whole.sort_indices()
    return whole


def _check_shape(path: Path, shape: Sequence[int]) -> None:
    if len(shape) != 2 or shape[0] != shape[1]:
        raise InputError(path, "", f"is {' x '.join(map(str, shape))}, not square", "give the whole matrix")
    if not 0 < shape[0] <= ORDER_LIMIT:
        raise InputError(path, "", f"is of order {shape[0]}; 1 to {ORDER_LIMIT} are allowed", "reduce the part first")


def _matrix_market(path: Path, stream: BinaryIO) -> csr_array:
    rows, columns, entries, form, field, symmetry = mminfo(str(path))
    _check_shape(path, (rows, columns))
    if field not in ("real", "double", "integer", "unsigned-integer") or symmetry not in ("general", "symmetric"):
        raise InputError(path, "line 1", f"{field} {symmetry}", "needs a real or integer matrix, symmetric or general")
    size = stream.seek(0, 2)
    if entries > size:
        raise InputError(path, "", f"says it has {entries} entries, more than the file can hold", "export it again")
    _check_numbers(path, stream)
    matrix = mmread(str(path))  # of a stream it reads ahead and cannot go back
    if form == "array":
        return csr_array(np.asarray(matrix, dtype=float))
    whole = csr_array(matrix, dtype=float)
    if symmetry == "symmetric" and whole.nnz < matrix.nnz:
        reason = "an entry stands twice though the first line says 'symmetric'"
        raise InputError(path, "", reason, "write one triangle only, or both and say 'general'")
    return whole


def _check_numbers(path: Path, stream: BinaryIO) -> None:
    """Refuse what scipy would read as another number, such as 1.0D+03 or 3,5, without a word."""
    stream.seek(0)
    text, line = stream.readline(), 1
    while text.startswith(b"%") or (text and not text.strip()):
        text, line = stream.readline(), line + 1
    while text:
        if strange := text.translate(None, _NUMERIC):
            line += text[: text.index(strange[:1])].count(b"\n")
            reason = f"{strange[:1].decode('latin-1')!r} does not belong to a number"
            raise InputError(path, f"line {line}", reason, "write numbers like 1.5e+03")
        line += text.count(b"\n")
        text = stream.read(1 << 20)


def _npz(path: Path, stream: BinaryIO) -> csr_array:
    with zipfile.ZipFile(stream) as archive:
        if sum(member.file_size for member in archive.infolist()) > SIZE_LIMIT_BYTES:
            raise InputError(path, "", f"holds more than {SIZE_LIMIT_BYTES >> 20} MiB, the limit for matrices")
    stream.seek(0)
    matrix = load_npz(stream)
    _check_shape(path, matrix.shape)
    if matrix.dtype.kind not in "iuf":
        raise InputError(path, "", f"holds entries of the type {matrix.dtype}", "needs real numbers")
    if matrix.format == "dia":  # scipy's own conversion trusts the offsets
        row = np.arange(matrix.data.shape[1]) - matrix.offsets.astype(np.int64)[:, None]
        column = np.broadcast_to(np.arange(matrix.data.shape[1]), row.shape)
        inside = (row >= 0) & (row < matrix.shape[0]) & (column < matrix.shape[1])
        matrix = coo_array((matrix.data[inside], (row[inside], column[inside])), shape=matrix.shape)
    elif matrix.format != "coo":
        if np.any(np.diff(matrix.indptr) < 0):
            raise ValueError("index pointers fall")
        matrix.check_format(full_check=True)
    return csr_array(coo_array(matrix), dtype=float)


def _nodes(path: Path, order: int) -> tuple[Integers, Array, dict[tuple[int, str], int]]:
    """Node numbers, their coordinates, and rows by (node, dof)."""
    table = Columns(path, "node", "dof", "row", "x_m", "y_m", "z_m", most_rows=ORDER_LIMIT)
    node, row, dof = table.integers("node"), table.integers("row"), table.texts("dof")
    table.check(row < order, "row", f"is beyond the matrices' last row, {order - 1}", "rows are counted from 0")
    table.check(np.isin(dof, DOFS), "dof", "is not a degree of freedom", f"use {', '.join(DOFS)}")
    rows: dict[tuple[int, str], int] = {}
    taken: set[int] = set()
    for at, (key, where) in enumerate(zip(zip(node.tolist(), dof, strict=True), row.tolist(), strict=True)):
        if key in rows:
            table.refuse(at, "dof", f"{key[1]} of node {key[0]} stands twice", "give each once")
        if where in taken:
            table.refuse(at, "row", f"row {where} has a degree of freedom already", "give each row once")
        rows[key] = where
        taken.add(where)
    place = np.column_stack([table.numbers(name) for name in ("x_m", "y_m", "z_m")])
    nodes, first, index = np.unique(node, return_index=True, return_inverse=True)
    if np.any(moved := np.abs(place - place[first][index]).max(axis=1) > SAME_PLACE_m):
        at = int(np.argmax(moved))
        table.refuse(at, "x_m", f"node {node[at]} is elsewhere on another line", "give a node one place")
    return nodes, place[first], rows
