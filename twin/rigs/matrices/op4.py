"""Nastran's OUTPUT4 files, ``.op4``: text, or binary in either order of bytes; its rows have no names."""

from pathlib import Path
from typing import BinaryIO

import numpy as np
from scipy.sparse import coo_array, csr_array

from recordings.errors import InputError
from twin.arrays import Array
from twin.rigs.matrices.found import FoundMatrix, Role, check_shape, from_entries, name_for
from twin.rigs.matrices.op4_binary import binary_matrices
from twin.rigs.matrices.op4_matrix import SYMMETRIC, Op4Matrix
from twin.rigs.matrices.op4_text import text_matrices


def read_op4(path: Path, stream: BinaryIO, role: Role) -> FoundMatrix:
    """The matrix in a file; of several the one that is named like a mass or a stiffness."""
    data = stream.read()
    found: dict[str, Op4Matrix] = {}
    for matrix in (binary_matrices if b"\0" in data[:24] else text_matrices)(path, data):
        if matrix.name in found:
            raise InputError(path, "", f"holds {matrix.name!r:.20} twice", "write one matrix of a name")
        found[matrix.name] = matrix
    one = found[name_for(path, found, role)]
    check_shape(path, one.shape)
    if one.kind not in (1, 2):
        raise InputError(path, "", f"{one.name} is complex", "needs a real matrix")
    row, column, value = _entries(path, one)
    if one.form == SYMMETRIC:
        return FoundMatrix(from_entries(path, row, column, value, one.shape[0]))
    return FoundMatrix(csr_array(coo_array((value, (row, column)), shape=one.shape)))


def _entries(path: Path, matrix: Op4Matrix) -> tuple[Array, Array, Array]:
    """Rows, columns and values of all that stands in the file."""
    pieces = [(0, 0, np.zeros(0)), *matrix.strings]
    row = np.concatenate([np.arange(first, first + len(values)) for _, first, values in pieces])
    column = np.concatenate([np.full(len(values), column) for column, _, values in pieces])
    value = np.concatenate([values for *_, values in pieces])
    if len(row) and not (row.min() >= 0 and row.max() < matrix.shape[0] and column.max() < matrix.shape[1]):
        reason = f"{matrix.name} has entries outside its {matrix.shape[0]} rows"
        raise InputError(path, "", reason, "export it again")
    kept = value != 0
    return row[kept], column[kept], value[kept]
