"""Sparse matrices of scipy's, ``.npz``."""

import zipfile
from pathlib import Path
from typing import BinaryIO

import numpy as np
from scipy.sparse import coo_array, csr_array, load_npz

from recordings.errors import InputError
from twin.rigs.matrices import found
from twin.rigs.matrices.found import FoundMatrix, Role, check_shape


def read_npz(path: Path, stream: BinaryIO, role: Role) -> FoundMatrix:
    """The matrix in scipy's file."""
    with zipfile.ZipFile(stream) as archive:
        if sum(member.file_size for member in archive.infolist()) > found.SIZE_LIMIT_BYTES:
            raise InputError(path, "", f"holds more than {found.SIZE_LIMIT_BYTES >> 20} MiB, the limit for matrices")
    stream.seek(0)
    matrix = load_npz(stream)
    check_shape(path, matrix.shape)
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
    return FoundMatrix(csr_array(coo_array(matrix), dtype=float))
