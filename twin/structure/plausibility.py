"""What of a rig is implausible: usual slips of pen in a rig file, each told in a line."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from recordings.directions import AXES
from twin.arrays import Array
from twin.rigs import BeamPart, Place, Rig
from twin.structure.drawn import drawn_parts
from twin.structure.mesh import BeamMesh
from twin.structure.modelled_rig import ModelledRig


@dataclass(frozen=True)
class Plausible:
    """What is usual of structures on a shaker: from where on a rig file is likely to be mistyped."""

    modulus_Pa: tuple[float, float] = (1e6, 1.3e12)
    density_kg_m3: tuple[float, float] = (10.0, 23e3)
    """From foam to diamond; from foam to osmium."""
    sound_m_s: tuple[float, float] = (30.0, 2e4)
    """Speed of sound along a bar: from rubber to diamond."""
    length_m: tuple[float, float] = (1e-3, 30.0)
    """Of a beam on a shaker; metres that are millimetres lie beyond."""
    first_mode_Hz: tuple[float, float] = (1.0, 2e4)
    """What a shaker drives and accelerometers measure."""
    stout: float = 10.0
    """Length over thickness below which shear is felt in the first bending mode, by a per cent and more."""
    heavy: float = 0.05
    """Share of the structure's mass from which a sensor's is unusual."""
    damped: float = 0.1
    """Modal damping ratio beyond which a structure hardly resonates."""
    coarse: int = 2
    """Elements for each half wave of the highest mode that is told: with two its frequency is half a per cent off."""
    still: float = 0.01
    """Motion in a mode, over the largest of any place, below which a place counts as a node of it."""
    stiff: float = 1e3
    """Shear over normal modulus of a layer from which they are likely to be exchanged or mistyped; and the other
    way."""
    unlike: float = 1.5
    """Height of a layer over the distance of the axes that it joins, from which one of them is likely to be
    mistyped."""
    looked_at: int = 4
    """Modes in which a drive or a sensor should move."""


USUAL = Plausible()


def implausible(modelled: ModelledRig) -> tuple[str, ...]:
    """A line for everything that a rig file is unlikely to mean."""
    return (*unlikely_units(modelled.rig), *(line for check in CHECKS for line in check(modelled)))


def unlikely_units(rig: Rig) -> tuple[str, ...]:
    """The same of what the file alone shows, nothing assembled: numbers that are not in SI units, most likely."""
    return (*_materials(rig), *_lengths(rig))


def _lengths(rig: Rig) -> Iterator[str]:
    for beam in rig.layout().beams:
        if not USUAL.length_m[0] <= beam.length <= USUAL.length_m[1]:
            yield f"part {beam.name!r}: {beam.length:g} m long; metres are asked for, no millimetres"


def _first_mode(m: ModelledRig) -> Iterator[str]:
    first = float(m.modes.frequency_Hz[0]) if len(m.modes.omega) else 0.0
    if not USUAL.first_mode_Hz[0] <= first <= USUAL.first_mode_Hz[1]:
        yield f"mode 1 at {first:.3g} Hz is beyond what a shaker drives; SI units are asked for"


def _materials(rig: Rig) -> Iterator[str]:
    for beam in rig.layout().beams:
        for name, value, (low, high), unit in (
            ("youngs_modulus", beam.youngs_modulus, USUAL.modulus_Pa, "N/m2"),
            ("density", beam.density, USUAL.density_kg_m3, "kg/m3"),
        ):
            if not low <= value <= high:
                yield f"part {beam.name!r}: {name} {value:g} {unit} is no solid's; SI units are asked for"
        sound = (beam.youngs_modulus / beam.density) ** 0.5
        if not USUAL.sound_m_s[0] <= sound <= USUAL.sound_m_s[1]:
            yield f"part {beam.name!r}: sound would run at {sound:.3g} m/s in it, which is no solid's"


def _slenderness(m: ModelledRig) -> Iterator[str]:
    for beam in m.rig.layout().beams:
        if beam.length < USUAL.stout * beam.thickness and beam.shear_ratio == 0:
            yield (
                f"part {beam.name!r}: {beam.length / beam.thickness:.2g} times as long as thick; without a shear_ratio "
                "(about 3 for a metal) it bends too little"
            )


def _layers(m: ModelledRig) -> Iterator[str]:
    for joint in m.rig.joints:
        for name, moduli in joint.preload.items():
            ratio = moduli.shear_modulus / moduli.normal_modulus
            if not 1 / USUAL.stiff < ratio < USUAL.stiff:
                yield f"joint {joint.name!r}, preload {name}: G' is {ratio:.2g} times E'"


def _heights(m: ModelledRig) -> Iterator[str]:
    layout = m.rig.layout()
    for joint in layout.joints:
        first, second = (layout.part(name) for name in joint.between)
        if isinstance(first, BeamPart) and isinstance(second, BeamPart):
            apart = abs(float((second.origin - first.origin) @ np.array(first.normal)))
            # both axes drawn as one line is the usual way to draw a single lap joint
            if apart > 0 and not 1 / USUAL.unlike < joint.layer_height / apart < USUAL.unlike:
                yield (
                    f"joint {joint.name!r}: layer_height {joint.layer_height:g} m, and the axes of {first.name!r} and "
                    f"{second.name!r} lie {apart:.4g} m apart; it is measured from neutral axis to neutral axis"
                )


def _motions(m: ModelledRig) -> Iterator[str]:
    held = 0 if m.rig.layout().supports else _of_one_body(m)
    if m.rigid > held:
        loose = m.rigid - held
        yield (
            f"{loose} motion{'s' if loose > 1 else ''} of parts that nothing holds: a part without joint, tie or "
            "support, or a support or tie that leaves one free"
        )


def _of_one_body(m: ModelledRig) -> int:
    plane = all(isinstance(mesh, BeamMesh) and not mesh.part.in_space for mesh in m.structure.meshes.values())
    return 3 if plane else 6


def _damping(m: ModelledRig) -> Iterator[str]:
    for number, ratio in enumerate(m.rig.damping.modal_ratio, start=1):
        if ratio > USUAL.damped:
            yield f"damping.modal_ratio: {ratio:g} of mode {number}; a ratio, not per cent, is asked for"


def _masses(m: ModelledRig) -> Iterator[str]:
    # a part that its own matrices hold follows a translation only as far as its modes do: the best axis tells most
    along = [m.structure.rigid_translation(axis) for axis in AXES.values()]
    whole = max(float(motion @ m.structure.M @ motion) for motion in along)
    for sensor in m.rig.sensor:
        if sensor.mass > USUAL.heavy * whole > 0:
            yield f"sensor {sensor.channel!r}: {1e3 * sensor.mass:.3g} g, {sensor.mass / whole:.0%} of the structure"


def _still_places(m: ModelledRig) -> Iterator[str]:
    largest = largest_motion(m, USUAL.looked_at)
    strained = _largest_strains(m)
    for name, place in _places(m.rig):
        row = m.structure.row(place)
        if place.reads == "strain":
            if np.any(np.abs(row @ m.modes.Phi[:, : USUAL.looked_at]) < USUAL.still * strained):
                yield f"{name}: hardly strained in one of the first modes"
            continue
        if not np.any(row):
            yield f"{name}: nothing moves there in its direction"
            continue
        still = np.flatnonzero(np.abs(row @ m.modes.Phi[:, : USUAL.looked_at]) < USUAL.still * largest)
        if len(still):
            numbers = ", ".join(str(number + 1) for number in still)
            yield f"{name}: at a node of mode{'s' if len(still) > 1 else ''} {numbers}, or across its motion"


def largest_motion(m: ModelledRig, count: int) -> Array:
    """Largest displacement of any place along an axis in each of the first modes, (count,)."""
    rows = np.concatenate([part.rows.reshape(-1, len(m.structure.M)) for part in drawn_parts(m.structure)])
    return np.asarray(np.max(np.abs(rows @ m.modes.Phi[:, :count]), axis=0))


def _largest_strains(m: ModelledRig) -> Array:
    """Largest strain of any beam's surface in each of the first modes, (USUAL.looked_at,)."""
    rows = [
        m.structure.row(Place(mesh.part.name, s, mesh.part.normal, reads="strain"))
        for mesh in m.structure.meshes.values() if isinstance(mesh, BeamMesh)
        for s in mesh.s
    ]  # fmt: skip
    shapes = m.modes.Phi[:, : USUAL.looked_at]
    return np.max(np.abs(np.array(rows) @ shapes), axis=0) if rows else np.zeros(shapes.shape[1])


def _places(rig: Rig):  # type: ignore[no-untyped-def]
    for name, place in rig.drives.items():
        yield "drive" if len(rig.drives) == 1 else f"drive {name!r}", place
    for sensor in rig.response_sensors:
        yield f"sensor {sensor.channel!r}", rig.place_of(sensor.channel)


def _meshes(m: ModelledRig) -> Iterator[str]:
    highest = max(float(m.modes.omega[min(9, len(m.modes.omega) - 1)]), np.finfo(float).tiny)
    for mesh in m.structure.meshes.values():
        if isinstance(mesh, BeamMesh):
            beam = mesh.part
            wave = (beam.youngs_modulus * beam.second_moment / (beam.density * beam.area * highest**2)) ** 0.25
            longest = float(np.max(np.diff(mesh.s)))
            if longest * USUAL.coarse > np.pi * wave:
                yield (
                    f"part {beam.name!r}: elements of {1e3 * longest:.3g} mm are coarse for mode 10 at "
                    f"{highest / (2 * np.pi):.4g} Hz; give it more"
                )


CHECKS: tuple[Callable[[ModelledRig], Iterator[str]], ...] = (
    _first_mode, _slenderness, _layers, _heights, _motions, _damping, _masses, _still_places, _meshes,
)  # fmt: skip
