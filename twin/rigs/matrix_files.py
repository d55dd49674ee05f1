"""Parts given by matrices: mass and stiffness, the table of their nodes, and tables of pairs of nodes."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array

from recordings.columns import Columns
from recordings.errors import InputError
from twin.arrays import Array
from twin.rigs.layout import DOFS, Layout, MatricesPart
from twin.rigs.limits import LIMITS
from twin.rigs.matrices import FoundMatrix, read_matrix
from twin.rigs.node_tables import read_node_table

PAIR_LIMIT = 10_000


@dataclass(frozen=True, eq=False)
class PartMatrices:
    """A part by its matrices."""

    M: csr_array
    K: csr_array
    """Symmetric mass and stiffness, (n, n); kg and N/m, for rotations kg m2 and N m/rad."""
    nodes: Array
    """Numbers of the nodes, rising, (k,)."""
    coordinates: Array
    """Where they are, m, (k, 3)."""
    rows: dict[tuple[int, str], int]
    """Row of the matrices of (node, dof), dof one of `DOFS`; rows of no node are internal."""

    def coordinates_of(self, node: int) -> Array:
        """Where a node is, (3,), m; KeyError if there is no such node."""
        at = int(np.searchsorted(self.nodes, node))
        if at == len(self.nodes) or self.nodes[at] != node:
            raise KeyError(node)
        return self.coordinates[at]


@dataclass(frozen=True, eq=False)
class NodePairs:
    """Pairs of nodes that a joint or a tie connects."""

    a: Array
    b: Array
    """Node numbers on the first and on the second part, (m,)."""
    area_m2: Array
    """What a pair stands for, (m,)."""
    normal: Array
    """Unit vectors from a to b, (m, 3)."""


def part_matrices(layout: Layout, part: MatricesPart) -> PartMatrices:
    """The matrices of a layout's part; InputError as of :func:`read_part_matrices`."""
    mass, stiffness, nodes = (layout.file(name, part.name) for name in (part.mass, part.stiffness, part.nodes))
    return read_part_matrices(mass, stiffness, nodes)


def read_part_matrices(mass: Path, stiffness: Path, nodes: Path) -> PartMatrices:
    """Read a part's matrices, in a format of :mod:`twin.rigs.matrices`, and the table of its nodes.

    Where a format names node and degree of freedom of every row, the table need give the nodes' places only.
    InputError if a file cannot be read, is too large, or is not what a mass, a stiffness or a table of nodes can be.
    """
    M, K = read_matrix_pair(mass, stiffness)
    own_mass, own_stiffness = M.matrix.diagonal(), K.matrix.diagonal()
    if np.all(own_stiffness < own_mass * LIMITS.matrix_files_slowest_rad_per_s**2):
        slowest = LIMITS.matrix_files_slowest_rad_per_s / (2 * np.pi)
        reason = f"no row of it would reach {slowest:.3f} Hz with the mass {Path(mass).name}"
        raise InputError(stiffness, "", reason, "are mass and stiffness exchanged, or not in SI units?")
    table = read_node_table(nodes, order=M.matrix.shape[0])
    rows = table.rows if K.labels is None else labelled_rows(K, table.nodes)
    if rows is None:
        raise InputError(nodes, "", "gives no rows, and the matrices name none", "add the columns dof and row")
    held = set(K.held.tolist())
    return PartMatrices(
        M.matrix, K.matrix, table.nodes, table.coordinates, {key: row for key, row in rows.items() if row not in held}
    )


def read_matrix_pair(mass: Path, stiffness: Path) -> tuple[FoundMatrix, FoundMatrix]:
    """A part's mass and stiffness over the same rows, with those that are held at rest in both.

    InputError as :func:`read_part_matrices`.
    """
    M, K = read_matrix(mass, "mass"), read_matrix(stiffness, "stiffness")
    if M.labels is not None and K.labels is not None:
        both = np.union1d(M.labels, K.labels)
        M, K = M.among(both), K.among(both)
    elif M.matrix.shape != K.matrix.shape:
        reason = f"is of order {K.matrix.shape[0]}, and the mass {Path(mass).name} of order {M.matrix.shape[0]}"
        raise InputError(stiffness, "", reason, "give both in the same degrees of freedom")
    for path, one in ((mass, M), (stiffness, K)):
        diagonal, largest = one.matrix.diagonal(), abs(one.matrix).max()
        if largest == 0 and one is M:
            raise InputError(path, "", "every entry is zero", "check the export and the file's name")
        if np.any(bad := diagonal < -LIMITS.matrix_files_negative * largest):
            row = int(np.argmax(bad))
            reason = f"the diagonal's entry {diagonal[row]:g} is negative, which no mass or stiffness has"
            raise InputError(path, f"row {row} (from 0)", reason, "check the export and its signs")
    if M.matrix.nnz == K.matrix.nnz and not (M.matrix != K.matrix).nnz:
        reason = "is the same matrix as the mass: every natural frequency would be 0.159 Hz"
        raise InputError(stiffness, "", reason, f"give the mass in place of {Path(mass).name}, or the stiffness here")
    labels = K.labels if M.labels is None else M.labels
    held = np.union1d(M.held, K.held)
    M, K = (replace(one.at_rest(held), labels=labels) for one in (M, K))
    return M, K


def labelled_rows(matrix: FoundMatrix, nodes: Array) -> dict[tuple[int, str], int]:
    """Rows by (node, dof) of the nodes of a table, from the labels of a matrix that has them."""
    assert matrix.labels is not None
    node, component = np.divmod(matrix.labels, LIMITS.found_components)
    placed = np.flatnonzero(np.isin(node, nodes) & (component >= 1) & (component <= len(DOFS)))
    return {(int(node[row]), DOFS[component[row] - 1]): int(row) for row in placed}


def read_pairs(path: Path) -> NodePairs:
    """Read pairs of nodes: columns node_a, node_b, area_m2, nx, ny, nz; others are ignored.

    InputError with line and column, if the file cannot be read or a value is missing or impossible.
    """
    table = Columns(path, "node_a", "node_b", "area_m2", "nx", "ny", "nz", most_rows=PAIR_LIMIT)
    a, b, area = table.integers("node_a"), table.integers("node_b"), table.numbers("area_m2", above=0)
    normal = np.column_stack([table.numbers(name) for name in ("nx", "ny", "nz")])
    length = np.linalg.norm(normal, axis=1)
    if np.any(wrong := np.abs(length - 1) > 1e-3):
        at = int(np.argmax(wrong))
        table.refuse(at, "nx", f"the normal is {length[at]:g} long", "give a unit vector from node_a to node_b")
    return NodePairs(a, b, area, normal / length[:, None])
