"""Nastran's direct matrix input at points, DMIG, as a punch file holds it; every row is named by its grid point."""

from pathlib import Path
from typing import BinaryIO

import numpy as np

from recordings.errors import InputError
from twin.rigs.limits import LIMITS
from twin.rigs.matrices.bulk import Entry, entries
from twin.rigs.matrices.found import NODE_LIMIT, FoundMatrix, Role, from_labelled, labels_of, name_for


def read_dmig(path: Path, stream: BinaryIO, role: Role) -> FoundMatrix:
    """The matrix in a punch file; of several the one that is named like a mass or a stiffness.

    Components 1 to 6 of a grid point are its degrees of freedom in its own displacement system; 0 is a scalar point.
    """
    found = list(entries(path, stream.read(), "DMIG"))
    heads = {entry.text(0): entry for entry in found if entry.text(1) == "0"}
    name = name_for(path, heads, role)
    head = heads[name]
    if (form := head.integer(2)) not in (LIMITS.dmig_symmetric, LIMITS.dmig_square):
        reason = f"{name} is of form {form}, not square (1) or symmetric (6)"
        raise InputError(path, f"line {head.line}", reason, "punch a mass or stiffness")
    if head.integer(3) not in LIMITS.dmig_real:
        raise InputError(path, f"line {head.line}", f"{name} is complex", "needs a real matrix")
    keys, values = [], []
    for entry in found:
        if entry.text(0) != name or entry is head:
            continue
        column = _point(entry, 1)
        for at in range(4, len(entry.fields), 4):
            if entry.text(at):
                keys.append((*_point(entry, at), *column))
                values.append(entry.number(at + 2))
    if not keys:
        raise InputError(path, f"line {head.line}", f"{name} has no entries", "export it again")
    points = np.array(keys, np.int64)
    row, column_of = labels_of(points[:, 0], points[:, 1]), labels_of(points[:, 2], points[:, 3])
    return from_labelled(path, row, column_of, np.array(values))


def _point(entry: Entry, at: int) -> tuple[int, int]:
    """A grid point and its component."""
    point, component = entry.integer(at), entry.integer(at + 1, default=0)
    if not 0 < point < NODE_LIMIT:
        raise entry.refusal(at, "no grid point's number")
    if not 0 <= component < LIMITS.found_components:
        raise entry.refusal(at + 1, "no component")
    return point, component
