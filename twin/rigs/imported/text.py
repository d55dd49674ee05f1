"""The rig file of an import: TOML with a comment on every field that the user must check."""

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.rigs.imported.part import ImportedPart
from twin.rigs.imported.places import NodePlace
from twin.rigs.limits import LIMITS
from twin.rigs.matrix_files import NodePairs


@dataclass(frozen=True, eq=False)
class FoundJoint:
    """Two parts whose nodes face each other."""

    name: str
    a: ImportedPart
    b: ImportedPart
    pairs: NodePairs

    @property
    def height_m(self) -> float:
        """Mean distance of facing nodes, or a chosen height where they coincide."""
        a, b = (
            np.array([part.matrices.coordinates_of(int(node)) for node in nodes])
            for part, nodes in ((self.a, self.pairs.a), (self.b, self.pairs.b))
        )
        gap = float(np.linalg.norm(b - a, axis=1).mean())
        return gap if gap > LIMITS.coincident_height_m / 10 else LIMITS.coincident_height_m


@dataclass(frozen=True, eq=False)
class RigContents:
    """All that the file says."""

    name: str
    parts: Sequence[ImportedPart]
    joints: Sequence[FoundJoint]
    supports: Sequence[tuple[NodePlace, tuple[str, ...]]]
    drive: tuple[NodePlace, str]
    drive_chosen: bool
    sensors: Sequence[tuple[str, NodePlace, str]]
    modes_to_Hz: float
    files: dict[tuple[str, str], str]
    """Of each part its mass, stiffness and nodes, of each joint its pairs, by (name, kind)."""


def rig_text(rig: RigContents) -> str:
    """The file."""
    head = [
        f"# {rig.name}: from another program's matrices, by twin rig import.  SI throughout.",
        "# Read every line that says 'check': its value was guessed or is only usual.",
        "format = 2",
        f"name = {_quoted(rig.name)}",
    ]
    blocks = [head, *(_part(rig, part) for part in rig.parts), *(_support(*support) for support in rig.supports)]
    if not rig.supports:
        blocks.append(["# No [[support]]: it hangs free, or is held where the matrices hold it."])
    blocks += [block for joint in rig.joints for block in _joint(rig, joint)]
    blocks.append(
        [
            "[damping]",
            "modal_ratio = [0.002]            # check: usual of bolted steel; the last one for all higher modes",
        ]
    )
    blocks += [_drive(rig), _sensor("force", "force", *rig.drive)]
    blocks += [_sensor(name, "acceleration", place, direction) for name, place, direction in rig.sensors]
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _part(rig: RigContents, part: ImportedPart) -> list[str]:
    files = part.files
    size = " x ".join(f"{1e3 * side:.4g}" for side in part.size_m)
    return [
        f"# From {_plain(files.mass.name)} and {_plain(files.stiffness.name)}, read in {part.units.name}.",
        f"# check: {part.mass_kg:.4g} kg, {size} mm, {len(part.matrices.nodes)} nodes, {part.matrices.M.shape[0]} rows",
        *(f"# {_plain(note)}" for note in (*part.notes, *part.warnings)),
        "[[part]]",
        f"name = {_quoted(part.name)}",
        'kind = "matrices"',
        *(f"{kind} = {_quoted(rig.files[part.name, kind])}" for kind in ("mass", "stiffness", "nodes")),
        f"modes_to_Hz = {rig.modes_to_Hz!r}            # check: above the band of the test; what its reduction keeps",
    ]


def _support(place: NodePlace, dofs: tuple[str, ...]) -> list[str]:
    return [
        f"# {_plain(place.told)}",
        "[[support]]",
        f"part = {_quoted(place.part.name)}",
        f"at = {place.node}",
        f"fix = [{', '.join(map(_quoted, dofs))}]           # check; or stiffness = {{ y = 1e6 }}, N/m and N m/rad",
    ]


def _joint(rig: RigContents, joint: FoundJoint) -> list[list[str]]:
    area = 1e6 * joint.pairs.area_m2.sum()
    return [
        [
            f"# {len(joint.pairs.a)} pairs of facing nodes.  check: {area:.4g} mm2 in all; keep what is in contact",
            "[[joint]]",
            f"name = {_quoted(joint.name)}",
            'kind = "thin-layer"',
            f"between = [{_quoted(joint.a.name)}, {_quoted(joint.b.name)}]",
            f"pairs = {_quoted(rig.files[joint.name, 'pairs'])}",
            f"layer_height = {joint.height_m:.6g}",
        ],
        [
            '[joint.preload."nominal"]',
            "normal_modulus = 1.0e9          # check: E', N/m2; usual of a bolted zone, twin identify finds it",
            "shear_modulus = 2.0e8           # check: G', N/m2",
        ],
    ]


def _drive(rig: RigContents) -> list[str]:
    place, direction = rig.drive
    chosen = "chosen where the structure is soft" if rig.drive_chosen else "the node nearest to what was asked for"
    return [
        f"# check: {chosen}: {_plain(place.told)}; shaker as of a usual one of 20 N",
        "[drive]",
        f"part = {_quoted(place.part.name)}",
        f"at = {place.node}",
        f"direction = {_quoted(direction)}",
        "armature_mass = 0.020           # check: kg, behind the force cell",
        "suspension_stiffness = 3150.0   # check: N/m",
        "force_factor = 5.5              # check: N/A",
        "coil_resistance = 1.5           # check: ohm",
        "coil_inductance = 0.0002        # check: H",
        "stinger_stiffness = 1.0e6       # check: N/m, axial",
    ]


def _sensor(name: str, quantity: str, place: NodePlace, direction: str) -> list[str]:
    force = quantity == "force"
    return [
        f"# {_plain(place.told)}",
        "[[sensor]]",
        f"channel = {_quoted(name)}",
        f'quantity = "{quantity}"',
        f"part = {_quoted(place.part.name)}",
        f"at = {place.node}",
        *([] if force else [f"direction = {_quoted(direction)}"]),
        f"mass = {'0.0  ' if force else '0.002'}                    # check: kg, what the structure feels of it",
        f"range = {'50.0  ' if force else '4900.0'}                  # check: {'N' if force else 'm/s2'}",
        f"noise_density = {'2.0e-4' if force else '2.0e-3'}          # check: {'N' if force else '(m/s2)'}/sqrt(Hz)",
        "high_pass = 0.1                 # check: Hz",
    ]


def _quoted(text: str) -> str:
    """A TOML string."""
    return json.dumps(text, ensure_ascii=False)


def _plain(text: str) -> str:
    """A text that cannot end its comment."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
