"""What a reader of matrices found in a file, and what every one of them checks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array, tril, triu

from recordings.errors import InputError
from twin.arrays import Array
from twin.rigs.limits import LIMITS

Role = Literal["mass", "stiffness"]

SIZE_LIMIT_BYTES = 512 << 20
"""Of a matrix's file, and of what it holds after decompression."""
ORDER_LIMIT = 200_000
NODE_LIMIT = 10**15


@dataclass(frozen=True, eq=False)
class FoundMatrix:
    """A matrix, and whose its rows are if its format knows."""

    matrix: csr_array
    """Both halves, in the file's units, (n, n)."""
    labels: Array | None = None
    """Node times `found_components` plus component of every row, rising, (n,); components 1 to 6 are x, y, z, rx, ry,
    rz, any other is internal."""
    held: Array = field(default_factory=lambda: np.zeros(0, np.int64))
    """Rows that the program holds at rest; their entries are zero."""

    def among(self, labels: Array) -> FoundMatrix:
        """The same matrix between the rows of these labels, which are its own and others."""
        assert self.labels is not None
        at, entries = np.searchsorted(labels, self.labels), self.matrix.tocoo()
        places = (at[entries.row], at[entries.col])
        whole = csr_array(coo_array((entries.data, places), shape=(len(labels), len(labels))))
        return replace(self, matrix=whole, labels=labels, held=at[self.held])

    def at_rest(self, held: Array) -> FoundMatrix:
        """The same with these rows held at rest: marked, and empty."""
        free = np.ones(self.matrix.shape[0])
        free[held] = 0.0
        return replace(self, matrix=scaled(self.matrix, free) if len(held) else self.matrix, held=held)


def check_shape(path: Path, shape: Sequence[int]) -> None:
    """Refuse what is not square, or of an order that no part may have."""
    if len(shape) != 2 or shape[0] != shape[1]:
        raise InputError(path, "", f"is {' x '.join(map(str, shape))}, not square", "give the whole matrix")
    if not 0 < shape[0] <= ORDER_LIMIT:
        raise InputError(path, "", f"is of order {shape[0]}; 1 to {ORDER_LIMIT} are allowed", "reduce the part first")


def from_entries(path: Path, row: Array, column: Array, value: Array, order: int) -> csr_array:
    """The whole symmetric matrix from entries of it, or of one triangle of it in any order of the rows.

    InputError if the order is not allowed, an entry lies outside or stands twice.
    """
    check_shape(path, (order, order))
    if np.any(outside := (row < 0) | (row >= order) | (column < 0) | (column >= order)):
        at = int(np.argmax(outside))
        place = f"row {row[at] + 1}, column {column[at] + 1}"
        raise InputError(path, place, f"lies outside a matrix of order {order}", "export it again")
    whole = csr_array(coo_array((value, (row, column)), shape=(order, order)))
    if whole.nnz < len(value):
        raise InputError(path, "", "an entry stands twice", "write each once, in one triangle or in both")
    stands = csr_array((np.ones(whole.nnz, np.int8), whole.indices, whole.indptr), shape=whole.shape)
    lower, upper = csr_array(tril(stands, -1)), csr_array(triu(stands, 1).T)
    if lower.multiply(upper).nnz == 0:
        whole = csr_array(whole + tril(whole, -1).T + triu(whole, 1).T)
    return whole


def from_labelled(path: Path, row: Array, column: Array, value: Array) -> FoundMatrix:
    """The matrix of entries between labels, see :class:`FoundMatrix`."""
    labels, index = np.unique(np.concatenate([row, column]), return_inverse=True)
    return FoundMatrix(from_entries(path, index[: len(row)], index[len(row) :], value, len(labels)), labels)


def by_label(path: Path, matrix: csr_array, labels: Array, place: str = "") -> FoundMatrix:
    """A matrix whose rows have these labels, in their rising order; InputError at `place` if one stands twice."""
    if len(np.unique(labels)) < len(labels):
        raise InputError(path, place, "a degree of freedom stands twice", "export it again")
    order = np.argsort(labels)
    return FoundMatrix(matrix[order][:, order], labels[order])


def scaled(matrix: csr_array, factor: Array) -> csr_array:
    """The matrix between coordinates that are so many times the former ones, (n,); its zeros removed."""
    whole = csr_array(diags_array(factor) @ matrix @ diags_array(factor))
    whole.eliminate_zeros()
    return whole


def labels_of(nodes: Array, components: Array) -> Array:
    """The labels of nodes and components."""
    return nodes * LIMITS.found_components + components


def name_for(path: Path, names: Iterable[str], role: Role) -> str:
    """Of the matrices of a file the only one, or the only one that is named like a mass (M...) or a stiffness (K...).

    InputError if there is none, or the names leave a choice.
    """
    names = list(dict.fromkeys(names))
    if len(names) == 1:
        return names[0]
    letter = {"mass": "M", "stiffness": "K"}[role]
    usual = [name for name in names if name.upper().startswith(letter)]
    for narrower in (usual, [name for name in usual if name.upper() in {letter + set_ * 2 for set_ in "AGX"}]):
        if len(narrower) == 1:
            return narrower[0]
    listed = ", ".join(names)[:120] or "none"
    raise InputError(
        path, "", f"holds the matrices {listed}; which is the {role}?", f"keep one {letter}... in the file"
    )
