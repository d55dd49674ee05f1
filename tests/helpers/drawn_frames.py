"""Rig files of format 2 as tables, drawn otherwise, and the natural frequencies that the project gives them."""

from __future__ import annotations

from typing import Any

import numpy as np
import tomli_w
from exact_frames import at_angle
from scipy.linalg import eigh

from twin.rigs import Rig, moduli_at, parse_rig
from twin.structure import Structure, assemble

__all__ = [
    "CLAMP", "FLAT", "THICK", "beam", "drawn", "found_Hz", "lowest_modes", "read", "reversed_part", "tie", "turned",
]  # fmt: skip

FLAT = {"width": 0.0254, "thickness": 0.00636, "youngs_modulus": 198e9, "density": 7880.0}
THICK = {"width": 0.020, "thickness": 0.010, "youngs_modulus": 70e9, "density": 2700.0}
CLAMP = ["x", "y", "rz"]
SHAKER = {
    "armature_mass": 0.02, "suspension_stiffness": 3000.0, "force_factor": 5.5, "coil_resistance": 1.5,
    "coil_inductance": 2e-4, "stinger_stiffness": 1e6, "direction": "+x",
}  # fmt: skip

Table = dict[str, Any]


def beam(name: str, start: tuple, end: tuple, section: dict = FLAT, elements: int = 20) -> Table:
    return {"name": name, "kind": "beam", "start": list(start), "end": list(end), "elements": elements, **section}


def tie(one: str, at_one: float, other: str, at_other: float) -> Table:
    return {"between": [one, other], "at": [at_one, at_other]}


def drawn(parts: list[Table], supports: list[Table] = (), ties: list[Table] = (), joints: list[Table] = ()) -> Table:
    """A rig file of these, with a shaker somewhere."""
    place = {"part": parts[0]["name"], "at": 0.0}
    return {
        "format": 2, "name": "frame", "part": parts, "support": list(supports), "joint": list(joints),
        "tie": list(ties), "damping": {"modal_ratio": [0.001]}, "drive": {**place, **SHAKER},
        "sensor": [{**place, "channel": "force", "quantity": "force", "range": 50.0}],
    }  # fmt: skip


def read(table: Table) -> Rig:
    return parse_rig(tomli_w.dumps(table).encode(), source="frame.toml")


def lowest_modes(structure: Structure, K: np.ndarray, count: int, rigid: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Elastic natural frequencies in Hz and shapes, from the inverse problem, which keeps all digits of the lowest."""
    shift = (2 * np.pi * 10.0) ** 2 if rigid else 0.0
    mu, Phi = eigh(structure.M, K + shift * structure.M)
    squares, wanted = 1 / mu[::-1][: rigid + count] - shift, slice(rigid, rigid + count)
    assert np.all(np.abs(squares[:rigid]) < 1e-3 * shift), "rigid motions cost no energy"
    assert np.all(squares[wanted] > shift / 100), "no more rigid motions than these"
    return np.sqrt(squares[wanted]) / (2 * np.pi), Phi[:, ::-1][:, wanted] * np.sqrt(mu[::-1][wanted]) ** -1


def found_Hz(table: Table, count: int = 5, rigid: int = 0, preload: str | None = None) -> np.ndarray:
    """The first elastic natural frequencies of a rig file, without its sensors' masses."""
    rig = read(table)
    structure, moduli = assemble(rig, sensor_masses=False), moduli_at(rig, preload) if rig.joints else ()
    K = structure.stiffness([m.normal_modulus for m in moduli], [m.shear_modulus for m in moduli])
    return lowest_modes(structure, K, count, rigid)[0]


def turned(table: Table, angle: float) -> Table:
    """The same drawing at an angle; only where what is held is held in x and y alike."""
    axes = {"+x": (1, 0), "-x": (-1, 0), "+y": (0, 1), "-y": (0, -1)}

    def aimed(placed: Table) -> Table:
        return {**placed, "direction": [*at_angle(angle, *axes[placed.get("direction", "+y")]), 0.0]}

    parts = [
        {**part, "start": list(at_angle(angle, *part["start"])), "end": list(at_angle(angle, *part["end"]))}
        for part in table["part"]
    ]
    return {**table, "part": parts, "drive": aimed(table["drive"]), "sensor": [aimed(s) for s in table["sensor"]]}


def reversed_part(table: Table, name: str) -> Table:
    """The same drawing with a part's start and end swapped, and with it all that is measured along it."""
    part = next(part for part in table["part"] if part["name"] == name)
    length = float(np.hypot(*np.subtract(part["end"], part["start"])))

    def along(where: str, at: float) -> float:
        return length - at if where == name else at

    def placed(one: Table) -> Table:
        return {**one, "at": along(one["part"], one["at"])}

    def layer(one: Table) -> Table:
        return {**one, "from": length - one["to"], "to": length - one["from"]} if one["between"][0] == name else one

    return {
        **table,
        "part": [{**p, "start": p["end"], "end": p["start"]} if p is part else p for p in table["part"]],
        "support": [placed(support) for support in table["support"]],
        "joint": [layer(joint) for joint in table["joint"]],
        "tie": [{**t, "at": [along(*pair) for pair in zip(t["between"], t["at"], strict=True)]} for t in table["tie"]],
        "drive": placed(table["drive"]),
        "sensor": [placed(sensor) for sensor in table["sensor"]],
    }
