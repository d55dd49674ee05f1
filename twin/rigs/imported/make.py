"""The whole import: parts, joints, places, and all files written together."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.sparse import save_npz

from recordings.errors import InputError, blamed_on
from recordings.whole import check_writable, whole_file
from twin.rigs.imported.facing import facing_pairs
from twin.rigs.imported.part import ImportedPart, PartFiles, read_part
from twin.rigs.imported.places import NodePlace, place_and_direction, support_at, usual_drive
from twin.rigs.imported.text import FoundJoint, RigContents, rig_text
from twin.rigs.limits import LIMITS
from twin.rigs.matrix_files import NodePairs, PartMatrices
from twin.rigs.node_tables import ROWS_OF_NODES, write_table
from twin.rigs.store import parse_rig


@dataclass(frozen=True)
class ImportRequest:
    """What was asked for."""

    parts: tuple[PartFiles, ...]
    out: Path
    units: str | None = None
    """One of `UNITS`; guessed if None."""
    drive: str | None = None
    """``PLACE:+y``; a soft place if None."""
    sensors: tuple[str, ...] = ()
    supports: tuple[str, ...] = ()
    """``NAME=PLACE:+y`` or ``PLACE:+y``, and ``PLACE`` or ``PLACE:x,y``."""
    modes_to_Hz: float = 2000.0


@dataclass(frozen=True, eq=False)
class Imported:
    """A rig that was written: what is in it, what its user must know, and its files."""

    contents: RigContents
    warnings: tuple[str, ...]
    files: tuple[Path, ...]


def imported_rig(request: ImportRequest, *, overwrite: bool = False) -> Imported:
    """Write a rig file of format 2 and, beside it, its parts' matrices and tables in SI units; all of them or none.

    InputError if something cannot be read or written, a place does not exist, or the rig would not be one.
    """
    if request.out.suffix.lower() != ".toml":
        raise InputError(request.out, "", "a rig file ends in .toml", f"name it {request.out.stem or 'rig'}.toml")
    check_writable(request.out, overwrite=overwrite)
    parts = [read_part(files, request.units) for files in request.parts]
    warnings = [f"{part.name}: {line}" for part in parts for line in part.warnings]
    joints = _joints(parts, warnings)
    supports = [support_at(parts, text, "--support") for text in request.supports]
    drive = (
        usual_drive(parts, [place for place, _ in supports])
        if request.drive is None
        else place_and_direction(parts, request.drive, "--drive")
    )
    sensors = [_sensor(parts, number, text) for number, text in enumerate(request.sensors, 1)] or [("acc1", *drive)]
    size = float(np.linalg.norm(np.ptp(np.vstack([part.matrices.coordinates for part in parts]), axis=0)))
    for place in [place for place, _ in supports] + [drive[0]] + [place for _, place, _ in sensors]:
        if place.away_m > LIMITS.places_far * size:  # another place was meant
            warnings.append(f"{place.told} is {1e3 * place.away_m:.4g} mm from where it was asked for")
    stem = request.out.stem
    names = {(p.name, kind): f"{stem}-{p.name}-{kind}.{end}" for p in parts for kind, end in KINDS.items()}
    names |= {(joint.name, "pairs"): f"{stem}-{joint.name}-pairs.csv" for joint in joints}
    contents = RigContents(
        stem, parts, joints, supports, drive, request.drive is None, sensors, request.modes_to_Hz, names
    )
    text = rig_text(contents).encode()
    parse_rig(text, source=str(request.out))
    paths = [request.out, *(request.out.with_name(name) for name in names.values())]
    check_writable(*paths, overwrite=overwrite)
    with ExitStack() as stack:
        places = [stack.enter_context(whole_file(path)) for path in paths]
        places[0].write_bytes(text)
        targets = dict(zip(names, places[1:], strict=True))
        for part in parts:
            _write_part(part.matrices, *(targets[part.name, kind] for kind in KINDS))
        for joint in joints:
            _write_pairs(joint.pairs, targets[joint.name, "pairs"])
    return Imported(contents, tuple(warnings), tuple(paths))


KINDS = {"mass": "npz", "stiffness": "npz", "nodes": "csv"}
"""Files of a part and their suffixes."""


def _joints(parts: Sequence[ImportedPart], warnings: list[str]) -> list[FoundJoint]:
    """A joint wherever two parts have facing nodes; a part that has none is told."""
    found = []
    for a, b in combinations(parts, 2):
        with blamed_on(b.files.nodes or b.files.stiffness, "", "join them in the file by hand"):
            pairs = facing_pairs(a, b)
        if pairs is not None:
            found.append(FoundJoint(f"{a.name}-{b.name}", a, b, pairs))
    joined = {part.name for joint in found for part in (joint.a, joint.b)}
    if len(parts) > 1:
        warnings += [
            f"{part.name}: faces no other part, so no joint holds it" for part in parts if part.name not in joined
        ]
    return found


def _sensor(parts: Sequence[ImportedPart], number: int, text: str) -> tuple[str, NodePlace, str]:
    name, equals, rest = text.partition("=")
    place, direction = place_and_direction(parts, rest if equals else text, "--sensor")
    return name.strip() if equals else f"acc{number}", place, direction


def _write_part(part: PartMatrices, mass: Path, stiffness: Path, nodes: Path) -> None:
    for path, matrix in ((mass, part.M), (stiffness, part.K)):
        with path.open("wb") as stream:
            save_npz(stream, matrix, compressed=False)
    places = dict(zip(part.nodes.tolist(), part.coordinates.tolist(), strict=True))
    by_row = sorted(part.rows.items(), key=lambda item: item[1])
    rows = ((node, dof, row, *(f"{x:.12g}" for x in places[node])) for (node, dof), row in by_row)
    write_table(nodes, ROWS_OF_NODES, rows)


def _write_pairs(pairs: NodePairs, path: Path) -> None:
    each = zip(pairs.a, pairs.b, pairs.area_m2, pairs.normal, strict=True)
    rows = ((a, b, f"{area:.12g}", *(f"{x:.12g}" for x in normal)) for a, b, area, normal in each)
    write_table(path, ("node_a", "node_b", "area_m2", "nx", "ny", "nz"), rows)
