"""Hidden causes on the bench, one a file: what each does to a rig, its joint or its measuring chain.

Names and parameters are the recording contract's.  This is the truth's side: nothing of the diagnosis is used here.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable

from twin.bench.effects.ac_coupling import ac_coupling
from twin.bench.effects.added_mass import added_mass
from twin.bench.effects.air_drag import air_drag
from twin.bench.effects.attached_resonator import attached_resonator
from twin.bench.effects.base_motion import base_motion
from twin.bench.effects.beam_modulus import beam_modulus
from twin.bench.effects.channel_delay import channel_delay
from twin.bench.effects.channel_gain import channel_gain
from twin.bench.effects.channel_polarity import channel_polarity
from twin.bench.effects.clamp_compliance import clamp_compliance
from twin.bench.effects.clipping import clipping
from twin.bench.effects.cross_talk import cross_talk
from twin.bench.effects.cubic_stiffness import cubic_stiffness
from twin.bench.effects.drive_mass import drive_mass
from twin.bench.effects.drive_position import drive_position
from twin.bench.effects.ground_friction import ground_friction
from twin.bench.effects.ground_stop import ground_stop
from twin.bench.effects.joint_friction import joint_friction
from twin.bench.effects.joint_slap import joint_slap
from twin.bench.effects.joint_stiffness import joint_stiffness
from twin.bench.effects.joint_uneven import joint_uneven
from twin.bench.effects.lost_samples import lost_samples
from twin.bench.effects.mains_hum import mains_hum
from twin.bench.effects.mounting_resonance import mounting_resonance
from twin.bench.effects.preload_loss import preload_loss
from twin.bench.effects.quantisation import quantisation
from twin.bench.effects.sample_clock import sample_clock
from twin.bench.effects.sensor_position import sensor_position
from twin.bench.effects.stiffness_loss import stiffness_loss
from twin.bench.effects.stinger_stiffness import stinger_stiffness
from twin.bench.effects.temperature_drift import temperature_drift
from twin.bench.effects.transverse_shear import transverse_shear
from twin.bench.effects.unsettled_dwell import unsettled_dwell
from twin.bench.effects.viscous_damper import viscous_damper
from twin.bench.plan import Plan
from twin.rigs import Effect

__all__ = ["EFFECTS", "apply_effects"]

EFFECTS: dict[str, Callable[..., None]] = {
    function.__name__.replace("_", "-"): function
    for function in (
        added_mass,
        beam_modulus,
        clamp_compliance,
        transverse_shear,
        stiffness_loss,
        attached_resonator,
        cubic_stiffness,
        ground_friction,
        ground_stop,
        viscous_damper,
        air_drag,
        joint_stiffness,
        joint_slap,
        joint_friction,
        joint_uneven,
        preload_loss,
        drive_mass,
        stinger_stiffness,
        drive_position,
        sensor_position,
        base_motion,
        temperature_drift,
        channel_gain,
        channel_delay,
        channel_polarity,
        clipping,
        ac_coupling,
        mounting_resonance,
        cross_talk,
        mains_hum,
        sample_clock,
        unsettled_dwell,
        lost_samples,
        quantisation,
    )
}
"""Every cause by its contract name; each takes the plan, and its parameters by name."""


def apply_effects(plan: Plan, effects: Iterable[Effect]) -> None:
    """Let each effect alter the plan, in order.

    Raises
    ------
    ValueError
        If there is no such cause, or it has other parameters.
    """
    for effect in effects:
        function = EFFECTS.get(effect.cause)
        if function is None:
            raise ValueError(f"unknown effect {effect.cause!r}; there are {', '.join(EFFECTS)}")
        takes = {name: p for name, p in inspect.signature(function).parameters.items() if name != "plan"}
        known, needed = set(takes), {name for name, p in takes.items() if p.default is p.empty}
        if not needed <= set(effect.parameters) <= known:
            raise ValueError(
                f"effect {effect.cause!r} takes {', '.join(sorted(known))}; got {', '.join(sorted(effect.parameters))}"
            )
        function(plan, **effect.parameters)
