"""Matrix Market files, ``.mtx``."""

from pathlib import Path
from typing import BinaryIO

import numpy as np
from scipy.io import mminfo, mmread
from scipy.sparse import csr_array

from recordings.errors import InputError
from twin.rigs.matrices.found import FoundMatrix, Role, check_shape

BANNER = b"%%MatrixMarket"
_NUMERIC = b"0123456789+-.eE \t\r\n"


def read_matrix_market(path: Path, stream: BinaryIO, role: Role) -> FoundMatrix:
    """The matrix in a Matrix Market file."""
    rows, columns, entries, form, field, symmetry = mminfo(str(path))
    check_shape(path, (rows, columns))
    if field not in ("real", "double", "integer", "unsigned-integer") or symmetry not in ("general", "symmetric"):
        raise InputError(path, "line 1", f"{field} {symmetry}", "needs a real or integer matrix, symmetric or general")
    size = stream.seek(0, 2)
    if entries > size:
        raise InputError(path, "", f"says it has {entries} entries, more than the file can hold", "export it again")
    _check_numbers(path, stream)
    matrix = mmread(str(path))  # of a stream it reads ahead and cannot go back
    if form == "array":
        return FoundMatrix(csr_array(np.asarray(matrix, dtype=float)))
    whole = csr_array(matrix, dtype=float)
    if symmetry == "symmetric" and whole.nnz < matrix.nnz:
        reason = "an entry stands twice though the first line says 'symmetric'"
        raise InputError(path, "", reason, "write one triangle only, or both and say 'general'")
    return FoundMatrix(whole)


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
