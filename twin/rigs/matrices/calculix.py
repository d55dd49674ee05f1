"""CalculiX: stiffness ``.sti``, mass ``.mas`` and their rows ``.dof``, of a step with ``SOLVER=MATRIXSTORAGE``."""

from pathlib import Path
from typing import BinaryIO

import numpy as np

from recordings.errors import InputError
from recordings.reader import open_input
from twin.arrays import Array
from twin.rigs.limits import LIMITS
from twin.rigs.matrices.found import NODE_LIMIT, ORDER_LIMIT, FoundMatrix, Role, by_label, from_entries, labels_of
from twin.rigs.matrices.numbers import number_table, whole_numbers

ROLES = {".mas": "mass", ".sti": "stiffness"}


def read_calculix(path: Path, stream: BinaryIO, role: Role) -> FoundMatrix:
    """The matrix; row, column and value stand in each line, of one triangle, and row.dof names every row's node.

    The rows come out in rising order of node and component, as of all formats that name them.
    """
    if (other := ROLES[path.suffix.lower()]) != role:
        raise InputError(
            path, "", f"is a {other} of CalculiX, given as the {role}", "the mass is .mas, the stiffness .sti"
        )
    table = number_table(path, stream.read(), columns=3)
    places = whole_numbers(path, table[:, :2], "row or column") - 1
    labels = _labels(path.with_suffix(".dof"))
    matrix = from_entries(path, places[:, 0], places[:, 1], table[:, 2], len(labels))
    return by_label(path.with_suffix(".dof"), matrix, labels)


def _labels(path: Path) -> Array:
    """Node and direction of each row, as ``node.direction``."""
    with open_input(path) as stream:
        text = stream.read(ORDER_LIMIT * 64).decode("latin-1")  # characters a line at most
    found = []
    for line, entry in enumerate(text.splitlines(), 1):
        node, dot, component = entry.strip().partition(".")
        if not (dot and node.isdecimal() and component.isdecimal()):
            raise InputError(path, f"line {line}", f"{entry.strip()[:30]!r} is not node.direction", "export it again")
        if int(node) >= NODE_LIMIT or int(component) >= LIMITS.found_components:
            raise InputError(path, f"line {line}", f"{entry.strip()[:30]!r} is no degree of freedom", "export it again")
        found.append((int(node), int(component)))
    numbers = np.array(found, np.int64).reshape(-1, 2)
    return labels_of(numbers[:, 0], numbers[:, 1])
