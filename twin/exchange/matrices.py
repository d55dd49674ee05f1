"""A rig's mass and stiffness matrices for other programs, with a table of whose rows they are.

The sensors' masses are in the mass, joints in the stiffness at their moduli of one preload.
"""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import BinaryIO

import numpy as np
from scipy.io import mmwrite
from scipy.sparse import csr_array, save_npz

from recordings.errors import InputError
from recordings.whole import refuse_existing, whole_file
from twin.arrays import Array
from twin.rigs import Rig, moduli_values
from twin.rigs.matrices.op4 import SYMMETRIC
from twin.rigs.node_tables import ROWS_OF_NODES, write_table
from twin.structure import assemble, named_rows

DIGITS = 3
"""Numbers on a line of an OUTPUT4 file."""
REAL_DOUBLE = 2
"""Type of a matrix in OUTPUT4."""


def write_matrices(
    rig: Rig, mass: Path, stiffness: Path, nodes: Path, *, preload: str | None = None, overwrite: bool = False
) -> int:
    """Write mass, stiffness (Matrix Market, scipy's ``.npz`` or OUTPUT4, by suffix) and the table of nodes (CSV).

    All files appear, or none; the number of rows of the matrices.

    Raises
    ------
    InputError
        If a suffix is unknown, a file exists, or a part was reduced when it was loaded: it has rows of no node.
    """
    for path in (mass, stiffness):
        if path.suffix.lower() not in SUFFIXES:
            raise InputError(path, "", f"{path.suffix!r} is no matrix's suffix", f"one of {', '.join(SUFFIXES)}")
    for path in (mass, stiffness, nodes):
        refuse_existing(path, overwrite=overwrite)
    structure = assemble(rig)
    if structure.reductions:
        reduced = structure.reductions[0].part.name
        raise InputError(
            rig.name, f"part {reduced}", "was reduced when it was loaded: its rows belong to no node",
            "its own matrices are the files that the rig file names",
        )  # fmt: skip
    K = structure.stiffness(*moduli_values(rig, preload))
    with ExitStack() as files:
        parts = [files.enter_context(whole_file(path)) for path in (mass, stiffness, nodes)]
        for path, part, name, matrix in ((mass, parts[0], "M", structure.M), (stiffness, parts[1], "K", K)):
            with part.open("wb") as stream:
                SUFFIXES[path.suffix.lower()](stream, name, (matrix + matrix.T) / 2)
        write_table(parts[2], ROWS_OF_NODES, named_rows(structure))
    return len(K)


def _op4(stream: BinaryIO, name: str, matrix: Array) -> None:
    """As text, column by column from the first to the last number that is not zero."""
    n = len(matrix)
    lines = [f"{n:8d}{n:8d}{SYMMETRIC:8d}{REAL_DOUBLE:8d}{name:<8s}1P,{DIGITS}E23.16"]
    for column in range(n):
        filled = np.flatnonzero(matrix[:, column])
        if len(filled):
            first, values = int(filled[0]), matrix[filled[0] : filled[-1] + 1, column]
            lines.append(f"{column + 1:8d}{first + 1:8d}{len(values):8d}")
            texts = [f"{value:23.16E}" for value in values]
            lines += ["".join(texts[at : at + DIGITS]) for at in range(0, len(texts), DIGITS)]
    lines += [f"{n + 1:8d}{1:8d}{1:8d}", f"{1.0:23.16E}"]
    stream.write(("\n".join(lines) + "\n").encode("ascii"))


SUFFIXES: dict[str, Callable[[BinaryIO, str, Array], None]] = {
    ".mtx": lambda to, name, A: mmwrite(to, csr_array(A), comment=name, symmetry="symmetric", precision=17),
    ".npz": lambda to, _, A: save_npz(to, csr_array(A)),
    ".op4": _op4,
}
"""Writers of matrices."""
