"""Any matrix file: which format it has, and what holds for the matrices of all of them."""

import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np
from scipy.sparse import csr_array

from recordings.errors import InputError
from recordings.reader import open_input
from twin.rigs.limits import LIMITS
from twin.rigs.matrices import found
from twin.rigs.matrices.abaqus import read_abaqus
from twin.rigs.matrices.calculix import read_calculix
from twin.rigs.matrices.dmig import read_dmig
from twin.rigs.matrices.found import FoundMatrix, Role
from twin.rigs.matrices.market import BANNER, read_matrix_market
from twin.rigs.matrices.npz import read_npz
from twin.rigs.matrices.op4 import read_op4

Reader = Callable[[Path, BinaryIO, Role], FoundMatrix]


FORMATS: dict[str, tuple[str, Reader]] = {
    ".mtx": ("an Abaqus matrix or a Matrix Market file", read_abaqus),
    ".npz": ("a sparse matrix of scipy's", read_npz),
    ".op4": ("a Nastran OUTPUT4 file", read_op4),
    ".pch": ("Nastran's DMIG entries", read_dmig),
    ".sti": ("a matrix of CalculiX", read_calculix),
    ".mas": ("a matrix of CalculiX", read_calculix),
}
"""What a suffix stands for; ``.mtx`` is two formats, told apart by their first line."""


def read_matrix(path: Path, role: Role) -> FoundMatrix:
    """A symmetric matrix of finite numbers; what rounding left between its halves is split.

    Raises
    ------
    InputError
        If the file cannot be read, is too large, or holds no such matrix.
    """
    path = Path(path)
    if (named := FORMATS.get(path.suffix.lower())) is None:
        reason = f"{path.suffix!r:.20} is not a suffix of a matrix"
        raise InputError(path, "", reason, f"use {', '.join(list(FORMATS)[:-1])} or {list(FORMATS)[-1]}")
    what, reader = named
    with open_input(path) as stream:
        if stream.seek(0, 2) > found.SIZE_LIMIT_BYTES:
            raise InputError(path, "", f"larger than {found.SIZE_LIMIT_BYTES >> 20} MiB, the limit for matrices")
        stream.seek(0)
        if reader is read_abaqus and stream.read(len(BANNER)).lower() == BANNER.lower():
            what, reader = "a Matrix Market file", read_matrix_market
        stream.seek(0)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                one = reader(path, stream, role)
        except InputError:
            raise
        except Exception as error:  # the libraries let through whatever a broken file provokes
            raise InputError(path, "", f"cannot be read as {what}: {str(error)[:120]}", "export it again") from error
    return replace(one, matrix=_symmetric(path, one.matrix))


def _symmetric(path: Path, matrix: csr_array) -> csr_array:
    if not np.all(np.isfinite(matrix.data)):
        row = int(np.searchsorted(matrix.indptr, np.argmin(np.isfinite(matrix.data)), side="right")) - 1
        raise InputError(path, f"row {row} (from 0)", "an entry is not finite", "export it again")
    apart = abs(matrix - matrix.T).tocoo()
    if apart.nnz and (worst := apart.data.max()) > LIMITS.read_asymmetry * abs(matrix).max():
        at = int(np.argmax(apart.data))
        place = f"row {apart.row[at]}, column {apart.col[at]} (from 0)"
        reason = f"not symmetric: differs by {worst:g} from the entry across the diagonal"
        raise InputError(path, place, reason, "a file of one triangle says 'symmetric' in its first line")
    whole = csr_array(matrix / 2 + matrix.T / 2)
    whole.eliminate_zeros()
    whole.sort_indices()
    return whole
