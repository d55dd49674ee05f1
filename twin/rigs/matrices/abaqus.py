"""Abaqus: assembled matrices (``*MATRIX OUTPUT``) and those of a substructure or an element, ``.mtx``."""

from pathlib import Path
from typing import BinaryIO

import numpy as np

from recordings.errors import InputError
from twin.arrays import Array
from twin.rigs.limits import LIMITS
from twin.rigs.matrices.found import (
    NODE_LIMIT,
    FoundMatrix,
    Role,
    by_label,
    from_entries,
    from_labelled,
    labels_of,
)
from twin.rigs.matrices.numbers import number_table, whole_numbers

TYPES = {"mass": "MASS", "stiffness": "STIFFNESS"}


def read_abaqus(path: Path, stream: BinaryIO, role: Role) -> FoundMatrix:
    """The matrix in a file of any of three forms, told apart by what stands in it.

    ``node, dof, node, dof, value`` (FORMAT=MATRIX INPUT), ``row, column, value`` (FORMAT=COORDINATE, whose rows have
    no names), or ``*USER ELEMENT`` with ``*MATRIX, TYPE=...`` (a substructure's).
    """
    data = stream.read()
    if any(line.upper().startswith(b"*USER ELEMENT") for line in data[: 1 << 16].splitlines()):
        return _substructure(path, data, role)
    first = next((line for line in data.splitlines() if line.strip() and not line.startswith(b"*")), b"")
    columns = len(first.replace(b",", b" ").split())
    if columns not in (3, 5):
        reason = "holds neither 'node, dof, node, dof, value' nor 'row, column, value'"
        remedy = "write it with FORMAT=MATRIX INPUT; a Matrix Market file begins with %%MatrixMarket"
        raise InputError(path, "", reason, remedy)
    plain = b"\n".join(b"**" if line.startswith(b"*") else line for line in data.splitlines())
    table = number_table(path, plain, columns=columns)
    value = table[:, -1]
    keys = whole_numbers(path, table[:, :-1], "a node, degree of freedom, row or column")
    if columns == 3:
        if keys.min() < 1:
            raise InputError(path, "", "a row or column below 1", "export it again")
        row, column = keys[:, 0] - 1, keys[:, 1] - 1
        found = FoundMatrix(from_entries(path, row, column, value, int(keys.max())))
    else:
        if (
            np.abs(keys[:, ::2]).max() >= NODE_LIMIT
            or keys[:, 1::2].min() < 0
            or keys[:, 1::2].max() >= LIMITS.found_components
        ):
            raise InputError(path, "", "a degree of freedom beyond all that Abaqus has", "export it again")
        found = from_labelled(path, labels_of(keys[:, 0], keys[:, 1]), labels_of(keys[:, 2], keys[:, 3]), value)
    return found.at_rest(np.flatnonzero(found.matrix.diagonal() >= LIMITS.abaqus_held))  # by a boundary condition


def _substructure(path: Path, data: bytes, role: Role) -> FoundMatrix:
    """Lower triangle of rows that may break anywhere; nodes and their degrees of freedom stand before it."""
    nodes: list[int] = []
    dofs: dict[int, list[int]] = {}
    numbers: dict[str, list[bytes]] = {}
    current, section = "", ""
    for line, raw in enumerate(data.splitlines(), 1):
        text = raw.decode("latin-1").strip()
        upper = text.upper().replace(" ", "")
        try:
            if upper.startswith("**ELEMENTNODES"):
                section = "nodes"
            elif upper.startswith("**"):
                if section == "nodes":
                    nodes += [int(word) for word in text.strip("* ").replace(",", " ").split()]
            elif upper.startswith("*USERELEMENT"):
                if nodes:
                    raise InputError(path, f"line {line}", "a second element", "keep one in the file")
                section = "dofs"
            elif upper.startswith("*MATRIX"):
                current = upper.partition("TYPE=")[2].partition(",")[0]
                section, numbers[current] = "matrix", []
            elif upper.startswith("*"):
                section = ""
            elif section == "matrix":
                numbers[current].append(raw)
            elif section in ("dofs", "nodes") and text:
                words = [int(word) for word in text.replace(",", " ").split()]
                dofs[words[0] if dofs else 1] = words[1:] if dofs else words
        except ValueError as error:
            raise InputError(
                path, f"line {line}", f"not a substructure's: {str(error)[:80]}", "export it again"
            ) from error
    labels = _labels_of_element(path, nodes, dofs)
    if (chosen := TYPES[role]) not in numbers:
        reason = f"holds the matrices {', '.join(numbers)[:80] or 'none'}, no {role}"
        raise InputError(path, "*MATRIX", reason, f"write TYPE={chosen} as well")
    entries = b" ".join(numbers[chosen]).replace(b",", b" ").split()
    return _triangle(path, labels, number_table(path, b"\n".join(entries), columns=1)[:, 0], chosen)


def _labels_of_element(path: Path, nodes: list[int], dofs: dict[int, list[int]]) -> Array:
    """A label for each row: position by position, the last list of degrees of freedom holds until there is another."""
    active: list[int] = []
    found = []
    for position, node in enumerate(nodes, 1):
        active = dofs.get(position, active)
        found += [(node, dof) for dof in active]
    keys = np.array(found, np.int64).reshape(-1, 2)
    labels = labels_of(keys[:, 0], keys[:, 1])
    if not len(labels):
        raise InputError(path, "", "names no nodes of its element", "keep the lines from *USER ELEMENT on")
    return labels


def _triangle(path: Path, labels: Array, values: Array, name: str) -> FoundMatrix:
    n = len(labels)
    if len(values) != n * (n + 1) // 2:
        reason = f"{name}: {len(values)} entries; {n} degrees of freedom need {n * (n + 1) // 2} of one triangle"
        raise InputError(path, "*MATRIX", reason, "export it again")
    return by_label(path, from_entries(path, *np.tril_indices(n), values, n), labels, "*USER ELEMENT")
