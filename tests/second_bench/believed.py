"""What the experimenter believes of the rig: a rig file, and the specimen that it describes."""

from __future__ import annotations

from dataclasses import dataclass

from tests.second_bench.mechanics.beams import Beam
from tests.second_bench.mechanics.specimen import Layer, Specimen

PRELOAD = "120N"
"""Name of the joint's preload in the rig file."""


@dataclass(frozen=True, kw_only=True)
class Transducer:
    """A channel as the rig file has it; SI, `noise_density` per square root of hertz."""

    channel: str
    quantity: str
    unit: str
    position: float
    mass: float
    range: float
    noise_density: float


HIGH_PASS_Hz = 0.1
"""Of every channel's coupling."""
BITS = 24
TRANSDUCERS = (
    Transducer(
        channel="force", quantity="force", unit="N", position=0.05, mass=0.0, range=50.0, noise_density=2.0e-4
    ),
    Transducer(
        channel="acc1", quantity="acceleration", unit="m/s^2", position=0.30, mass=0.002, range=490.0,
        noise_density=5.0e-4,
    ),
    Transducer(
        channel="acc2", quantity="acceleration", unit="m/s^2", position=0.42, mass=0.022, range=490.0,
        noise_density=5.0e-4,
    ),
)  # fmt: skip
"""The force cell at the drive first, then the accelerometers."""
ELEMENTS = 41
"""Of the two beams in the rig file's own mesh; a weak section is one of them long."""


@dataclass(frozen=True)
class Shaker:
    """Behind the force cell: the armature, its suspension and the stinger; SI."""

    armature_mass: float = 0.020
    suspension_stiffness: float = 3150.0
    stinger_stiffness: float = 1.0e6


SHAKER = Shaker()
BELIEVED = Specimen(
    lower=Beam(0.0, 0.235, 0.0254, 0.00636, 198e9, 7880.0),
    upper=Beam(0.185, 0.235, 0.0254, 0.00636, 198e9, 7880.0),
    elements=(26, 23),
    layer=Layer(
        begin=0.185, end=0.235, width=0.0254, height=0.00636, normal_modulus=3.9e8, shear_modulus=7.6e7, points=5,
        softening=0.75, opening_m=1.5e-6, early=0.2, friction=1.2e9, slip_m=2.0e-6, travel_m=1.5e-7,
    ),
    drive_position=TRANSDUCERS[0].position,
    sensors={t.channel: t.position for t in TRANSDUCERS[1:]},
    masses=tuple((t.position, t.mass) for t in TRANSDUCERS[1:]),
    modal_ratio=(0.0023, 0.002, 0.002, 0.003),
)  # fmt: skip
"""The steel rig; of the joint's law the rig file says nothing."""


def rig_text() -> str:
    """The rig file, format 1."""
    lines = ['name = "second-bench"']
    for name, beam in (("lower", BELIEVED.lower), ("upper", BELIEVED.upper)):
        lines += [
            "", f"[{name}]", f"length = {beam.length}", f"width = {beam.width}", f"thickness = {beam.thickness}",
            f"youngs_modulus = {beam.modulus}", f"density = {beam.density}",
        ]  # fmt: skip
    layer = BELIEVED.layer
    lines += [
        "", "[joint]", f"overlap = {layer.end - layer.begin:.6g}", f"layer_height = {layer.height}",
        "layer_elements = 3", "", f'[joint.preload."{PRELOAD}"]', f"normal_modulus = {layer.normal_modulus}",
        f"shear_modulus = {layer.shear_modulus}", "", "[mesh]", f"beam_elements = {ELEMENTS}", "", "[damping]",
        f"modal_ratio = {list(BELIEVED.modal_ratio)}", "", "[drive]", f"position = {BELIEVED.drive_position}",
        f"armature_mass = {SHAKER.armature_mass}", f"suspension_stiffness = {SHAKER.suspension_stiffness}",
        "force_factor = 5.5", "coil_resistance = 1.5", "coil_inductance = 0.0002",
        f"stinger_stiffness = {SHAKER.stinger_stiffness}",
    ]  # fmt: skip
    for t in TRANSDUCERS:
        lines += [
            "", "[[sensor]]", f'channel = "{t.channel}"', f'quantity = "{t.quantity}"', f"position = {t.position}",
            f"mass = {t.mass}", f"range = {t.range}", f"noise_density = {t.noise_density}",
            f"high_pass = {HIGH_PASS_Hz}",
        ]  # fmt: skip
    return "\n".join([*lines, "", "[acquisition]", f"bits = {BITS}", ""])
