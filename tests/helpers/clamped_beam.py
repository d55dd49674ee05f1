"""A clamped beam with six listed masses, and its responses from a finer mesh in closed form over its modes."""

from types import SimpleNamespace

import numpy as np

from recordings.responses import End, FoundResponse, Responses
from recordings.toml_input import parse_toml
from twin.rigs import StructureRig
from twin.structure import assemble, normal_modes

MASSES = "".join(
    f'[[mass]]\npart = "beam"\nat = {at}\nname = "m{n}"\nmass = 0.12\n'
    for n, at in enumerate((0.1, 0.2, 0.3, 0.4, 0.5, 0.6), 1)
)
BEAM = f"""
format = 2
name = "six"
[[part]]
name = "beam"
kind = "beam"
start = [0.0, 0.0]
end = [0.7, 0.0]
width = 0.04
thickness = 0.01
youngs_modulus = 200e9
density = 7850.0
elements = 28
[[support]]
part = "beam"
at = 0.0
fix = ["x", "y", "rz"]
{MASSES}
[damping]
modal_ratio = [0.004]
[drive]
part = "beam"
at = 0.06
direction = "+y"
[[sensor]]
channel = "force"
quantity = "force"
part = "beam"
at = 0.06
range = 50.0
[[sensor]]
channel = "mid"
quantity = "acceleration"
part = "beam"
at = 0.35
direction = "+y"
range = 500.0
[[sensor]]
channel = "tip"
quantity = "acceleration"
part = "beam"
at = 0.66
direction = "+y"
range = 500.0
"""
F = np.arange(8, 3600) * 0.25


def responses(rig, rng, *, scatter=0.0, shown=0.0, noise=0.003, channels=("tip",), path="a.uff"):
    """As a file would have them; natural frequencies and what is shown of each mode are off by chance."""
    structure = assemble(rig)
    modes = normal_modes(structure.M, structure.stiffness([], []))
    omega, W = modes.omega * (1 + scatter * rng.standard_normal(len(modes.omega))), 2 * np.pi * F[:, None]
    zeta = rig.damping.modal_ratio[-1]
    D = omega**2 - W**2 + 2j * zeta * omega * W
    drive = structure.row(rig.drive_place) @ modes.Phi
    found = []
    for channel in channels:
        read = structure.row(rig.place_of(channel)) @ modes.Phi * (1 + shown * rng.standard_normal(len(omega)))
        H = -(W[:, 0] ** 2) * ((read * drive) / D).sum(axis=1)
        H = H * (1 + noise * (rng.standard_normal(len(F)) + 1j * rng.standard_normal(len(F))) / 2**0.5)
        ends = {"response": End(channel), "reference": End("force"), "quantity": "acceleration"}
        found.append(FoundResponse(place=channel, frequency_Hz=F, H=H, **ends))
    return Responses(path=path, responses=tuple(found))


def with_modulus(rig, factor, elements=28):
    part = rig.part[0]
    changed = {"youngs_modulus": factor * part.youngs_modulus, "elements": elements}
    return rig.model_copy(update={"part": [part.model_copy(update=changed)]})


def without(rig, name):
    return rig.model_copy(update={"mass": [mass for mass in rig.mass if mass.name != name]})


LAB = SimpleNamespace(
    rig=parse_toml(BEAM.encode(), StructureRig, source="six"),
    responses=responses,
    with_modulus=with_modulus,
    without=without,
)
"""What the tests need."""
