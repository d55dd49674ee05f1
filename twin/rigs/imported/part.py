"""One part from another program's files, in SI units."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recordings.errors import InputError, blamed_on
from twin.rigs.imported.units import UNITS, Units, model_scale
from twin.rigs.layout import DOFS
from twin.rigs.limits import LIMITS
from twin.rigs.matrices.found import FoundMatrix
from twin.rigs.matrix_files import PartMatrices, labelled_rows, read_matrix_pair
from twin.rigs.node_tables import NodeTable, read_node_table

NODES_BESIDE = {".sti": ".inp", ".pch": ".pch"}
"""Where the nodes stand if no file of them is given, by the stiffness's suffix: the program's own input."""


@dataclass(frozen=True)
class PartFiles:
    """What a part is read from; no table of nodes if the matrices' program left it beside them."""

    name: str
    mass: Path
    stiffness: Path
    nodes: Path | None = None


@dataclass(frozen=True, eq=False)
class ImportedPart:
    """A part in SI units, and what was assumed of it."""

    files: PartFiles
    matrices: PartMatrices
    units: Units
    notes: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def name(self) -> str:
        """Of the part."""
        return self.files.name

    @property
    def mass_kg(self) -> float:
        """What moves along with a unit translation along x, or along the first axis that has rows."""
        for axis in DOFS[:3]:
            rigid = np.zeros(self.matrices.M.shape[0])
            rigid[[row for (_, dof), row in self.matrices.rows.items() if dof == axis]] = 1.0
            if np.any(rigid):
                return float(rigid @ (self.matrices.M @ rigid))
        return 0.0

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Along x, y and z, m."""
        x, y, z = np.ptp(self.matrices.coordinates, axis=0).tolist()
        return x, y, z


def read_part(files: PartFiles, units: str | None) -> ImportedPart:
    """Read a part and convert it.

    InputError if a file cannot be read, the rows are nobody's, or the units cannot be guessed.

    Parameters
    ----------
    units
        One of `UNITS`; guessed if None.
    """
    M, K = read_matrix_pair(files.mass, files.stiffness)
    notes: list[str] = []
    table = _table(files, K, notes)
    rows = table.rows if K.labels is None else labelled_rows(K, table.nodes)
    if rows is None:
        rows = _in_order(files, table, K.matrix.shape[0], notes)
    rows = {key: row for key, row in rows.items() if row not in set(K.held.tolist())}
    moving = {node for node, _ in rows}
    if not moving:
        raise InputError(
            files.nodes or files.stiffness, "", "no node of it has a row", "give the nodes of these matrices"
        )
    kept = np.isin(table.nodes, sorted(moving))
    nodes, coordinates = table.nodes[kept], table.coordinates[kept]
    if len(K.held):
        notes.append(f"{len(K.held)} rows are held at rest in {files.stiffness.name}, and stay so")
    scale = model_scale(M.matrix, K.matrix, coordinates, rows)
    chosen = UNITS[units] if units else scale.guess()
    if chosen is None:
        raise InputError(
            files.stiffness, "", "its units cannot be guessed from its size and its speed of sound",
            f"say --units {' or '.join(UNITS)}",
        )  # fmt: skip
    if not units:
        notes.append(
            f"units {chosen.name}, guessed: {scale.size * chosen.length_m:.3g} m long, sound runs at about "
            f"{scale.sound * chosen.length_m / chosen.time_s:.2g} m/s, steel's density is {chosen.density:.3g}; "
            "--units says otherwise"
        )
    mass, stiffness = chosen.to_si(M.matrix, K.matrix, rows)
    exchanged = f"are {files.mass.name} and {files.stiffness.name} exchanged, or the units others?"
    with blamed_on(files.stiffness, "", exchanged):
        doubt = scale.doubt(chosen)
    return ImportedPart(
        files, PartMatrices(mass, stiffness, nodes, coordinates * chosen.length_m, rows), chosen, tuple(notes),
        (doubt,) if doubt else (),
    )  # fmt: skip


def _table(files: PartFiles, K: FoundMatrix, notes: list[str]) -> NodeTable:
    """The nodes that were given, or those beside the matrices, or all at the origin where nobody says their places."""
    order = K.matrix.shape[0]
    if files.nodes is not None:
        return read_node_table(files.nodes, order=order)
    suffix = NODES_BESIDE.get(files.stiffness.suffix.lower())
    beside = files.stiffness.with_suffix(suffix) if suffix else None
    if beside is not None and beside.is_file() and (beside.suffix != ".pch" or b"GRID" in beside.read_bytes()):
        notes.append(f"nodes from {beside.name}")
        return read_node_table(beside, order=order)
    if K.labels is None:
        reason = "does not say whose its rows are"
        raise InputError(files.stiffness, "", reason, "give --nodes: a CSV with node, dof, row, x_m, y_m, z_m")
    node, component = np.divmod(K.labels, LIMITS.found_components)
    nodes = np.unique(node[(component >= 1) & (component <= len(DOFS)) & (node >= 0)])
    notes.append("no table of nodes: all lie at the origin, drawings show nothing, and places are node numbers")
    return NodeTable(nodes, np.zeros((len(nodes), 3)))


def _in_order(files: PartFiles, table: NodeTable, order: int, notes: list[str]) -> dict[tuple[int, str], int]:
    """Rows node by node, three or six of each, if so many there are."""
    each = order // len(table.nodes)
    if each * len(table.nodes) != order or each not in (3, 6):
        reason = f"has {len(table.nodes)} nodes for {order} rows: neither three nor six each"
        raise InputError(files.nodes or files.stiffness, "", reason, "add the columns dof and row")
    notes.append(
        f"rows taken node by node, {each} of each, in rising order of the nodes; columns dof and row say otherwise"
    )
    return {
        (node, dof): each * at + k for at, node in enumerate(table.nodes.tolist()) for k, dof in enumerate(DOFS[:each])
    }
