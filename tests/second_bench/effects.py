"""What can be hidden in a rig.  Each effect makes, of a size, the changed rig and the parameters that tell the truth.

Names and parameters are those of the recording contract.  The `UNLISTED` ones are on no list: the right answer to them
is `unknown`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tests.second_bench.believed import BELIEVED, ELEMENTS
from tests.second_bench.channels import Wiring
from tests.second_bench.mechanics.beams import WeakStretch
from tests.second_bench.mechanics.laws import Kind
from tests.second_bench.mechanics.specimen import GroundElement, Specimen

Parameters = dict[str, float | str]


@dataclass(frozen=True)
class Rig:
    """A specimen and how its channels are wired."""

    specimen: Specimen
    wiring: dict[str, Wiring]


@dataclass(frozen=True)
class Effect:
    """Something hidden.

    Attributes
    ----------
    usual
        Size from which a search begins, or the size itself where `sought` is false.
    apply
        Of a sound rig and a size: the rig that has it, and its parameters.
    sought
        Whether the size is one at which the responses at resonance change by some per cent.  The others change natural
        frequencies, which other unknowns do as well, or scale a response: their sizes are drawn.
    drifts
        Whether it grows with time.
    """

    usual: float
    apply: Callable[[Rig, float], tuple[Rig, Parameters]]
    sought: bool = True
    drifts: bool = False


STICK_m = 2e-6
"""Travel of a dry contact before it slips."""
MAGNET_REACH_m, SWING_Hz, HUM_Hz = 1.5e-3, 3.0, 50.0
"""A magnet reaches a share of the tip's swing; stiffness swings slowly, or about twice in a period of mode 1."""

Maker = Callable[[np.random.Generator], Effect]


def _specimen(rig: Rig, **changes) -> Rig:
    return replace(rig, specimen=replace(rig.specimen, **changes))


def _layer(rig: Rig, **changes) -> Rig:
    return _specimen(rig, layer=replace(rig.specimen.layer, **changes))


def _wired(rig: Rig, channel: str, **changes) -> Rig:
    return replace(rig, wiring={**rig.wiring, channel: replace(rig.wiring[channel], **changes)})


def _response(rng: np.random.Generator) -> str:
    return str(rng.choice(list(BELIEVED.sensors)))


def _place(rng: np.random.Generator, low: float = 0.7, high: float = 1.0) -> float:
    return float(rng.uniform(low, high)) * BELIEVED.length


def _to_ground(
    kind: Kind,
    usual: float,
    name: str,
    of_size: Callable[[float], tuple[float, ...]] = lambda size: (size,),
    **told: float,
) -> Maker:
    """An element between the ground and a place that is drawn; `of_size` makes its parameters of its size."""

    def maker(rng: np.random.Generator) -> Effect:
        x = _place(rng)

        def apply(rig: Rig, size: float) -> tuple[Rig, Parameters]:
            element = GroundElement(kind, x, of_size(size))
            return _specimen(rig, ground=(*rig.specimen.ground, element)), {"position_m": x, name: size, **told}

        return Effect(usual, apply)

    return maker


def _ground_stop(rng: np.random.Generator) -> Effect:
    gap = float(rng.uniform(3e-4, 1.2e-3))
    return _to_ground(Kind.STOP, 100.0, "stiffness_N_per_m", lambda size: (size, gap), gap_m=gap)(rng)


def _air_drag(rng: np.random.Generator) -> Effect:
    x, weight = np.polynomial.legendre.leggauss(5)
    half = BELIEVED.length / 2

    def apply(rig: Rig, size: float) -> tuple[Rig, Parameters]:
        spread = [
            GroundElement(Kind.DRAG, half * (1 + xi), (size * w * half,))
            for xi, w in zip(x.tolist(), weight.tolist(), strict=True)
        ]
        return _specimen(rig, ground=(*rig.specimen.ground, *spread)), {"coefficient_Ns2_per_m3": size}

    return Effect(2.0, apply)


def _joint_friction(rng: np.random.Generator) -> Effect:
    last = bool(rng.integers(2))
    slip = float(rng.uniform(2e-7, 5e-7))

    def apply(rig: Rig, size: float) -> tuple[Rig, Parameters]:
        point = rig.specimen.layer.points - 1 if last else 0
        changed = _layer(rig, sliders=((point, size, size * slip),))
        return changed, {
            "layer_element": "3" if last else "1", "stiffness_N_per_m": size, "slip_force_N": size * slip,
        }  # fmt: skip

    return Effect(1e8, apply)


def _joint_slap(rng: np.random.Generator) -> Effect:
    gap = float(rng.uniform(4e-7, 1.2e-6))

    def apply(rig: Rig, size: float) -> tuple[Rig, Parameters]:
        kept = 1 - min(size, 0.9)
        return _layer(rig, gap_m=gap, slap_factor=kept), {"gap_m": gap, "stiffness_factor": kept}

    return Effect(0.3, apply)


def _rate(field: str, usual: float) -> Maker:
    def maker(_: np.random.Generator) -> Effect:
        def apply(rig: Rig, size: float) -> tuple[Rig, Parameters]:
            return _specimen(rig, **{field: size}), {"rate_per_s": size}

        return Effect(usual, apply, drifts=True)

    return maker


def _added_mass(rng: np.random.Generator) -> Effect:
    x = _place(rng, 0.6)

    def apply(rig: Rig, size: float) -> tuple[Rig, Parameters]:
        return _specimen(rig, masses=(*rig.specimen.masses, (x, size))), {"position_m": x, "mass_kg": size}

    return Effect(float(rng.uniform(0.006, 0.015)), apply, sought=False)


def _stiffness_loss(rng: np.random.Generator) -> Effect:
    # In the lower beam, clear of the clamp and of the overlap, as long as an element of the rig file's mesh.
    length = (BELIEVED.lower.length + BELIEVED.upper.length) / ELEMENTS
    x = float(rng.uniform(length, BELIEVED.layer.begin - length))

    def apply(rig: Rig, size: float) -> tuple[Rig, Parameters]:
        weak = WeakStretch(x - length / 2, x + length / 2, 1 - size)
        return _specimen(rig, weak=(*rig.specimen.weak, weak)), {"position_m": x, "factor": 1 - size}

    return Effect(float(rng.uniform(0.2, 0.5)), apply, sought=False)


def _sensor_position(rng: np.random.Generator) -> Effect:
    channel = _response(rng)
    at = BELIEVED.sensors[channel]
    sign = -1.0 if at > BELIEVED.length - 0.02 else float(rng.choice([-1.0, 1.0]))

    def apply(rig: Rig, size: float) -> tuple[Rig, Parameters]:
        specimen = rig.specimen
        moved = at + sign * size
        masses = tuple((moved if x == at else x, mass) for x, mass in specimen.masses)
        changed = _specimen(rig, sensors={**specimen.sensors, channel: moved}, masses=masses)
        return changed, {"channel": channel, "offset_m": sign * size}

    return Effect(float(rng.uniform(0.006, 0.015)), apply, sought=False)


def _channel_gain(rng: np.random.Generator) -> Effect:
    channel, sign = _response(rng), float(rng.choice([-1.0, 1.0]))

    def apply(rig: Rig, size: float) -> tuple[Rig, Parameters]:
        gain = rig.wiring[channel].gain * (1 + sign * size)
        return _wired(rig, channel, gain=gain), {"channel": channel, "factor": 1 + sign * size}

    return Effect(float(rng.uniform(0.02, 0.08)), apply, sought=False)


def _channel_delay(rng: np.random.Generator) -> Effect:
    channel = _response(rng)

    def apply(rig: Rig, size: float) -> tuple[Rig, Parameters]:
        return _wired(rig, channel, delay_s=size), {"channel": channel, "delay_s": size}

    return Effect(float(rng.uniform(3e-5, 2e-4)), apply, sought=False)


def _nothing(_: np.random.Generator) -> Effect:
    return Effect(0.0, lambda rig, size: (rig, {}), sought=False)


MAGNET_REACH_m = 1.5e-3
SWING_Hz = 3.0
HUM_Hz = 50.0

"""A magnet's reach is a share of the tip's swing; stiffness swings slowly, or twice in two periods of mode 1."""

UNLISTED: dict[str, Maker] = {
    "magnet": _to_ground(Kind.MAGNET, 20.0, "stiffness_N_per_m", lambda size: (size, MAGNET_REACH_m)),
    "swinging-stiffness": _to_ground(
        Kind.SWINGING, 20.0, "stiffness_N_per_m", lambda size: (size, 0.7 * size, SWING_Hz)
    ),
    "humming-stiffness": _to_ground(Kind.SWINGING, 20.0, "stiffness_N_per_m", lambda size: (0.0, size, HUM_Hz)),
}
LISTED: dict[str, Maker] = {
    "none": _nothing,
    "added-mass": _added_mass,
    "stiffness-loss": _stiffness_loss,
    "cubic-stiffness": _to_ground(Kind.CUBIC, 1e6, "stiffness_N_per_m3"),
    "ground-friction": _to_ground(Kind.SLIDER, 0.02, "force_N", lambda size: (size / STICK_m, size)),
    "ground-stop": _ground_stop,
    "viscous-damper": _to_ground(Kind.DASHPOT, 0.1, "damping_Ns_per_m"),
    "air-drag": _air_drag,
    "joint-slap": _joint_slap,
    "joint-friction": _joint_friction,
    "preload-loss": _rate("preload_rate", 2e-4),
    "temperature-drift": _rate("moduli_rate", 5e-6),
    "sensor-position": _sensor_position,
    "channel-gain": _channel_gain,
    "channel-delay": _channel_delay,
}
