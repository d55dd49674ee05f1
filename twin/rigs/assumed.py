"""What a rig file leaves out, and what stands for it: every report begins with it."""

from collections.abc import Iterator

from twin.rigs.beam import BeamRig
from twin.rigs.beam_part import BeamSection
from twin.rigs.rig import Rig
from twin.rigs.store import AnyRig
from twin.rigs.tables import Acquisition, Drift, LawOfRig

LIMITS = {"voltage_limit": "voltage", "current_limit": "current", "force_limit": "force", "stroke_limit": "stroke"}


def assumed(rig: AnyRig, *, law: bool = True, bench: bool = True) -> tuple[str, ...]:
    """A line for everything that stands for what the file of `rig` does not say, what matters most first.

    Parameters
    ----------
    law
        Whether the file's law acts; an identification finds its own.
    bench
        Whether shaker, noise, converter and drift act; a model has none.
    """
    if isinstance(rig, BeamRig):
        return tuple(_without_shear({"the beam": rig.beam}))
    if not isinstance(rig, Rig):
        return ()
    found = [*(_laws(rig) if law else ()), *(_drive(rig) if bench else ()), *_model(rig)]
    return (*found, *(_instruments(rig) if bench else ()))


def _model(rig: Rig) -> Iterator[str]:
    layout = rig.layout()
    if not layout.supports:
        yield "no support: it hangs free"
    yield from _without_shear({beam.name: beam for beam in layout.beams})
    ratios = rig.damping.modal_ratio
    yield f"modes above {len(ratios)}: damped as mode {len(ratios)}, {ratios[-1]:g}"
    sensors = rig.sensor
    for told, channels in (
        ("no mass", [s.channel for s in sensors if s.mass == 0]),
        ("no high-pass", [s.channel for s in sensors if s.high_pass == 0]),
        ("mounted rigidly", [s.channel for s in rig.response_sensors if s.mounting_frequency is None]),
    ):
        if channels:
            yield f"{', '.join(channels)}: {told}"


def _instruments(rig: Rig) -> Iterator[str]:
    if silent := [s.channel for s in rig.sensor if s.noise_density == 0]:
        yield f"{', '.join(silent)}: no noise"
    if rig.acquisition == Acquisition():
        yield f"converter: {rig.acquisition.bits} bits, an exact clock, an anti-aliasing filter"
    if rig.drift == Drift():
        yield "no drift of temperature or preload"


def _laws(rig: Rig) -> Iterator[str]:
    linear = [joint.name for joint in rig.joints if joint.law is None]
    if linear:
        yield f"{', '.join(linear)}: no law, so linear"
    for joint in rig.joints:
        if isinstance(joint.law, LawOfRig):
            yield f"{joint.name}: the law calibrated on {joint.law.of}, scaled to its own E'"


def _drive(rig: Rig) -> Iterator[str]:
    shaker = rig.shaker
    if shaker.ideal:
        yield "no shaker: an ideal force, one newton for each volt of the generator"
        return
    free = [name for field, name in LIMITS.items() if getattr(shaker, field) is None]
    if free:
        yield f"shaker: no limit of its {', '.join(free)}"
    if shaker.half_force_stroke is None:
        yield "shaker: the same force per ampere at any stroke"


def _without_shear(beams: dict[str, BeamSection]) -> Iterator[str]:
    stiff = [name for name, beam in beams.items() if beam.shear_ratio == 0]
    if stiff:
        yield f"{', '.join(stiff)}: no shear, bent as Euler and Bernoulli have it"
