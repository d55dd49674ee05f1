"""Rigs of every kind that a rig file allows, and procedures so short that each can be taken through every command."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from drawn_frames import CLAMP, SHAKER, beam
from scipy import sparse

from twin.rigs import RIG_FILES, load_rig, save_rig

__all__ = ["DRAWN", "HIDDEN", "rig_file", "write_procedures"]

STEEL = {"width": 0.0254, "thickness": 0.00636, "youngs_modulus": 198e9, "density": 7880.0}
LENGTH_m, NODES = 0.3, 21
DRAWN = ("beam-clamped", "beam-hung", "matrices-clamped", "matrices-hung", "bars-in-space")
"""A beam without a joint, and the same as a plane part given by matrices, rows x, y and rz; two bolted bars in space,
each triaxial sensor three channels, with a lump on one of them, a spring and a damper between them."""
HIDDEN = {
    "beam-clamped": {"part": "bar", "position_m": 0.22, "mass_kg": 0.03},
    "beam-hung": {"part": "bar", "position_m": 0.22, "mass_kg": 0.03},
    "matrices-clamped": {"part": "bar", "node": 16, "mass_kg": 0.03},
    "matrices-hung": {"part": "bar", "node": 16, "mass_kg": 0.03},
    "bars-in-space": {"part": "upper", "position_m": 0.15, "mass_kg": 0.03},
    "hung-lap-joint": {"part": "upper", "position_m": 0.2, "mass_kg": 0.03},
    "hybrid-joint": {"position_m": 0.5, "mass_kg": 0.05},
    "l-frame": {"part": "arm", "position_m": 0.2, "mass_kg": 0.03},
    "shaking-base": {"part": "blade", "position_m": 0.2, "mass_kg": 0.03},
    "steel-lap-joint": {"position_m": 0.35, "mass_kg": 0.03},
    "steel-lap-joint-light-sensors": {"position_m": 0.35, "mass_kg": 0.03},
    "stiffened-plate": {"part": "plate", "node": 18, "mass_kg": 0.04},
    "two-lap-joints": {"part": "end", "position_m": 0.1, "mass_kg": 0.03},
}
"""A mass on each."""


def rig_file(name: str, folder: Path, *, effect: dict[str, Any] | None = None) -> Path:
    """Write a shipped or a drawn rig into a folder, a cause hidden in it if there is one."""
    path = folder / f"{name}.toml"
    if name in RIG_FILES:
        save_rig(load_rig(name), path)
    else:
        path.write_text(tomli_w.dumps(_in_space() if name == "bars-in-space" else _bar(name, folder)))
    if effect is not None:
        table = tomllib.loads(path.read_text())
        path.write_text(tomli_w.dumps({**table, "effect": [*table.get("effect", []), effect]}))
    return path


def write_procedures(folder: Path, first_Hz: float) -> tuple[Path, Path]:
    """Noise of six seconds, and a sweep of five short steps about a resonance, each awaited for 400 of its periods."""
    random = {
        "procedure": "random", "target_channel": "force", "band": [5.0, 1000.0], "rms": 0.5, "duration": 6.0,
        "sample_rate": 5120.0,
    }  # fmt: skip
    sweep = {
        "procedure": "stepped-sine", "target_channel": "force", "control": "force", "amplitudes": [0.1, 0.2],
        "sample_rate": 2048.0, "frequencies": np.round(first_Hz * np.array([0.97, 0.99, 1.0, 1.01, 1.03]), 3).tolist(),
        "settle": {"maximum": round(400.0 / first_Hz, 1)}, "measure": {"seconds": 0.5},
    }  # fmt: skip
    paths = folder / "random.toml", folder / "sweep.toml"
    for path, table in zip(paths, (random, sweep), strict=True):
        path.write_text(tomli_w.dumps(table))
    return paths


def _bar(name: str, folder: Path) -> dict[str, Any]:
    """A steel bar driven near its middle, as a beam or by matrices, clamped at its start or hung free."""
    kind, held = name.split("-")
    at = {"beam": (0.075, 0.18, 0.3), "matrices": (6, 13, 21)}[kind]
    clamp = {"part": "bar", "at": {"beam": 0.0, "matrices": 1}[kind], "fix": CLAMP}
    sensor = {"part": "bar", "quantity": "acceleration", "mass": 0.002, "range": 4900.0, "noise_density": 5e-4}
    drive = {"part": "bar", "at": at[0], "direction": "+y"}
    return {
        "format": 2, "name": name,
        "part": [beam("bar", (0.0, 0.0), (LENGTH_m, 0.0), STEEL) if kind == "beam" else _by_matrices(folder)],
        "support": [clamp] if held == "clamped" else [],
        "damping": {"modal_ratio": [0.01]},
        "drive": {**SHAKER, **drive},
        "sensor": [
            {**drive, "channel": "force", "quantity": "force", "range": 50.0, "noise_density": 2e-4},
            *({**sensor, "channel": f"acc{n}", "at": at[n], "direction": "+y"} for n in (1, 2)),
        ],
    }  # fmt: skip


def _in_space() -> dict[str, Any]:
    """A post that leans, a bar bolted onto its side, a triaxial accelerometer on the bar's end."""
    lean = np.array([0.0, 0.28, 0.96])
    face = np.array([0.0, -0.96, 0.28])
    aside = (0.00636 * face).tolist()
    section = {**STEEL, "thickness_direction": face.tolist()}
    place = {"part": "post", "at": 0.06, "direction": face.tolist()}
    sensor = {"quantity": "acceleration", "mass": 0.001, "range": 4900.0, "noise_density": 5e-4}
    upper = [[a + s * along for a, along in zip(aside, lean, strict=True)] for s in (0.15, 0.35)]
    return {
        "format": 2, "name": "bars-in-space",
        "part": [
            beam("post", (0.0, 0.0, 0.0), tuple(0.2 * lean), section), beam("upper", *map(tuple, upper), section),
        ],
        "support": [{"part": "post", "at": 0.0, "fix": ["x", "y", "z", "rx", "ry", "rz"]}],
        "joint": [{
            "name": "lap", "kind": "thin-layer", "between": ["post", "upper"], "from": 0.15, "to": 0.2,
            "layer_height": 0.00636, "preload": {"120N": {"normal_modulus": 3.9e8, "shear_modulus": 7.6e7}},
        }],
        "mass": [{"part": "upper", "at": 0.1, "mass": 0.01, "inertia": {"rx": 1e-6}}],
        "spring": [{"between": ["post", "upper"], "at": [0.1, 0.02], "stiffness": {"x": 500.0, "ry": 1.0}}],
        "damper": [{"between": ["post", "upper"], "at": [0.1, 0.02], "damping": {"x": 0.2}}],
        "damping": {"modal_ratio": [0.01]},
        "drive": {**SHAKER, **place},
        "sensor": [
            {**place, "channel": "force", "quantity": "force", "range": 50.0, "noise_density": 2e-4},
            {**sensor, "part": "post", "at": 0.14, "channel": "acc1", "direction": face.tolist()},
            *(
                {**sensor, "part": "upper", "at": 0.2, "channel": f"end-{axis}", "direction": f"+{axis}"}
                for axis in "xyz"
            ),
        ],
    }  # fmt: skip


def _by_matrices(folder: Path) -> dict[str, Any]:
    """The bar's Euler-Bernoulli elements, written as files."""
    L, area = LENGTH_m / (NODES - 1), STEEL["width"] * STEEL["thickness"]
    EA, EI = STEEL["youngs_modulus"] * area, STEEL["youngs_modulus"] * area * STEEL["thickness"] ** 2 / 12
    m = STEEL["density"] * area * L
    stretch, bend = np.ix_([0, 3], [0, 3]), np.ix_([1, 2, 4, 5], [1, 2, 4, 5])
    k_e, m_e = np.zeros((2, 6, 6))
    k_e[stretch], m_e[stretch] = EA / L * np.array([[1, -1], [-1, 1]]), m / 6 * np.array([[2, 1], [1, 2]])
    k_e[bend] = EI / L**3 * np.array([
        [12, 6 * L, -12, 6 * L], [6 * L, 4 * L**2, -6 * L, 2 * L**2],
        [-12, -6 * L, 12, -6 * L], [6 * L, 2 * L**2, -6 * L, 4 * L**2],
    ])  # fmt: skip
    m_e[bend] = m / 420 * np.array([
        [156, 22 * L, 54, -13 * L], [22 * L, 4 * L**2, 13 * L, -3 * L**2],
        [54, 13 * L, 156, -22 * L], [-13 * L, -3 * L**2, -22 * L, 4 * L**2],
    ])  # fmt: skip
    K, M = np.zeros((2, 3 * NODES, 3 * NODES))
    for n in range(NODES - 1):
        own = slice(3 * n, 3 * n + 6)
        K[own, own] += k_e
        M[own, own] += m_e
    sparse.save_npz(folder / "mass.npz", sparse.csr_array(M))
    sparse.save_npz(folder / "stiffness.npz", sparse.csr_array(K))
    rows = [
        f"{n + 1},{dof},{3 * n + d},{n * L:.6f},0,0" for n in range(NODES) for d, dof in enumerate(("x", "y", "rz"))
    ]
    (folder / "nodes.csv").write_text("\n".join(["node,dof,row,x_m,y_m,z_m", *rows]) + "\n")
    return {
        "name": "bar", "kind": "matrices", "mass": "mass.npz", "stiffness": "stiffness.npz", "nodes": "nodes.csv",
        "modes_to_Hz": 2000.0,
    }  # fmt: skip
