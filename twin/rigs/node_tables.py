"""Where a part's nodes are, and which row is whose: our own CSV, or a list of nodes from another program.

A list of nodes gives their places only: a CSV with columns node, x_m, y_m, z_m (or x, y, z), a universal file (data
sets 15 and 2411), the ``*NODE`` lines of an Abaqus or CalculiX input, GRID entries of Nastran.
"""

import csv
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recordings.columns import Columns
from recordings.errors import InputError
from recordings.reader import open_input
from twin.arrays import Array
from twin.rigs.layout import DOFS
from twin.rigs.matrices.bulk import entries
from twin.rigs.matrices.found import NODE_LIMIT, ORDER_LIMIT
from twin.rigs.matrices.numbers import fortran_number

Place = tuple[int, float, float, float]
"""Number of a node and its coordinates."""

SIZE_LIMIT_BYTES = 256 << 20
"""Of a model's file with nodes in it."""
AXES = (("x_m", "y_m", "z_m"), ("x", "y", "z"))
"""Columns of coordinates, in metres or in the unit of a model that is to be converted."""
ROWS_OF_NODES = ("node", "dof", "row", *AXES[0])
"""Columns of a table that also says whose the matrices' rows are."""


@dataclass(frozen=True, eq=False)
class NodeTable:
    """Nodes, and rows of the matrices where the table gives them."""

    nodes: Array
    """Rising, (k,)."""
    coordinates: Array
    """(k, 3)."""
    rows: dict[tuple[int, str], int] | None = None
    """Row of (node, dof), dof one of `DOFS`."""


def write_table(path: Path, head: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write rows as CSV; of nodes below :data:`ROWS_OF_NODES`."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        csv.writer(stream, lineterminator="\n").writerows([head, *rows])


def read_node_table(path: Path, *, order: int) -> NodeTable:
    """Read a table of nodes, in any format, for matrices of an order.

    InputError with the place, if the file cannot be read or a value is missing or impossible.
    """
    path = Path(path)
    reader = LISTS.get(path.suffix.lower())
    if reader is None:
        return _csv(path, order)
    with open_input(path) as stream:
        data = stream.read(SIZE_LIMIT_BYTES + 1)
    if len(data) > SIZE_LIMIT_BYTES:
        raise InputError(path, "", f"larger than {SIZE_LIMIT_BYTES >> 20} MiB", "write the nodes alone")
    return listed(path, reader(path, data))


def listed(path: Path, places: list[Place]) -> NodeTable:
    """The table of a list of nodes; InputError where it is empty, too long, or gives a node two places."""
    if not 1 <= len(places) <= ORDER_LIMIT:
        raise InputError(path, "", f"holds {len(places)} nodes", f"1 to {ORDER_LIMIT} are allowed")
    numbers = np.array([place[0] for place in places], np.int64)
    coordinates = np.array([place[1:] for place in places])
    if np.any(bad := (numbers < 0) | (numbers >= NODE_LIMIT) | ~np.isfinite(coordinates).all(axis=1)):
        raise InputError(path, f"node {numbers[int(np.argmax(bad))]}", "has no number or no place", "export it again")
    nodes, first, index = np.unique(numbers, return_index=True, return_inverse=True)
    if np.any(moved := np.any(coordinates != coordinates[first][index], axis=1)):
        raise InputError(path, f"node {numbers[int(np.argmax(moved))]}", "has two places", "give a node one place")
    return NodeTable(nodes, coordinates[first])


def _grids(path: Path, data: bytes) -> list[Place]:
    """GRID entries, whose places and displacements must be in the basic coordinate system."""
    found = []
    for entry in entries(path, data, "GRID"):
        for at in (1, 5):
            if entry.integer(at, default=0):
                raise entry.refusal(at, "a coordinate system of its own; the basic one, 0, is asked for")
        x, y, z = (entry.number(at, default=0.0) for at in (2, 3, 4))
        found.append((entry.integer(0), x, y, z))
    return found


def _input_deck(path: Path, data: bytes) -> list[Place]:
    """The lines under ``*NODE`` of an Abaqus or CalculiX input."""
    found, inside = [], False
    for line, text in enumerate(data.decode("latin-1").splitlines(), 1):
        if text.startswith("**") or not text.strip():
            continue
        if text.lstrip().startswith("*"):
            inside = text.strip().upper().partition(",")[0].rstrip() == "*NODE"
        elif inside:
            found.append(_place(path, line, text.rstrip().rstrip(",").split(",")))
    return found


def _universal(path: Path, data: bytes) -> list[Place]:
    """Data sets 15, a node on each line, and 2411, on two."""
    found: list[Place] = []
    kind, waiting = None, None
    for line, text in enumerate(data.decode("latin-1").splitlines(), 1):
        if text.strip() == "-1":
            kind = None if kind is not None else ""
        elif kind == "":
            kind = text.strip()
        elif kind == "15":
            words = text.split()
            found.append(_place(path, line, [*words[:1], *words[4:]]))
        elif kind == "2411":
            if waiting is None:
                waiting = (text.split() or [""])[0]
            else:
                found.append(_place(path, line, [waiting, *text.split()]))
                waiting = None
    return found


def _place(path: Path, line: int, words: list[str]) -> Place:
    """A node's number and two or three coordinates."""
    try:
        x, y, z = [*map(fortran_number, words[1:]), *[0.0] * (4 - len(words))]
        return int(words[0]), x, y, z
    except ValueError:
        raise InputError(path, f"line {line}", "is no node with its coordinates", "export it again") from None


LISTS: dict[str, Callable[[Path, bytes], list[Place]]] = {
    **dict.fromkeys((".uff", ".unv"), _universal),
    ".inp": _input_deck,
    **dict.fromkeys((".bdf", ".nas", ".dat", ".pch", ".asm", ".blk"), _grids),
}
"""Readers of lists of nodes by suffix; any other is a CSV."""


def _csv(path: Path, order: int) -> NodeTable:
    """Node numbers, their coordinates, and rows by (node, dof) if the table has the columns dof and row."""
    table = Columns(path, most_rows=ORDER_LIMIT)
    axes = AXES[1] if set(AXES[1]) <= set(table.names) else AXES[0]
    if "dof" not in table.names and "row" not in table.names:
        table.need("node", *axes)
        return listed(
            path, list(zip(table.integers("node").tolist(), *(table.numbers(a).tolist() for a in axes), strict=True))
        )
    table.need("node", "dof", "row", *axes)
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
    place = np.column_stack([table.numbers(name) for name in axes])
    nodes, first, index = np.unique(node, return_index=True, return_inverse=True)
    if np.any(moved := np.abs(place - place[first][index]).max(axis=1) > 1e-9):
        at = int(np.argmax(moved))
        table.refuse(at, axes[0], f"node {node[at]} is elsewhere on another line", "give a node one place")
    return NodeTable(nodes, place[first], rows)
