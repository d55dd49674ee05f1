"""From a rig as its file describes it to a plan of it as it is, its effects applied."""

from collections.abc import Mapping, Sequence

import numpy as np

from recordings.directions import direction_name
from recordings.errors import blamed_on
from recordings.quantities import quantity
from recordings.run import Channel
from twin.bench.build import altered_matrices
from twin.bench.effects import apply_effects
from twin.bench.instruments import InstrumentChannel
from twin.bench.layer import JointLaw
from twin.bench.plan import JointPlan, Plan
from twin.rigs import Effect, Layout, Rig, moduli_at, preload_name

MONITORS = {
    "voltage": ("voltage", "voltage", 10.0, 1e-6),
    "amplifier": ("command", "voltage", 1000.0, 1e-6),
    "current": ("current", "current", 10.0, 1e-6),
    "stroke": ("stroke", "displacement", 0.02, 1e-10),
}
"""What each channel that watches the shaker reads; its quantity, range and noise density in a recording."""


def planned(
    rig: Rig,
    *,
    preload: str | None = None,
    effects: Sequence[Effect] = (),
    joint_law: JointLaw | Mapping[str, JointLaw] | None = None,
    monitors: Sequence[str] = (),
    layout: Layout | None = None,
) -> Plan:
    """Plan a rig; parameters and errors as of :func:`twin.bench.open_bench`."""
    name = preload_name(rig, preload)
    # A shaker that does not drive is taken off; its force cell stays on, and is not recorded.
    idle = {cell for drive, cell in rig.force_cells.items() if cell != rig.force_sensor.channel}
    instruments = {
        s.channel: InstrumentChannel.of(
            s,
            rig.acquisition.bits,
            position_m=rig.layout().position(rig.place_of(s.channel)),
            direction=direction_name(rig.place_of(s.channel).direction),
        )
        for s in rig.sensor
        if s.channel not in idle
    }
    for monitor in monitors:
        if monitor not in MONITORS:
            raise ValueError(f"no monitor {monitor!r}; there are {', '.join(MONITORS)}")
        reads, measured, full_scale, noise_density = MONITORS[monitor]
        channel = Channel(name=monitor, quantity=measured, unit=quantity(measured).unit, range=full_scale)
        instruments[monitor] = InstrumentChannel(channel, reads, full_scale, noise_density, rig.acquisition.bits)
        if monitor == "amplifier" and rig.shaker.voltage_limit:
            instruments[monitor].limit = rig.shaker.voltage_limit
    laws = joint_law if isinstance(joint_law, Mapping) else {joint.name: joint_law for joint in rig.joints}
    joints = [
        JointPlan(
            joint.name, moduli.normal_modulus, moduli.shear_modulus, laws.get(joint.name),
            rate_per_s=rig.drift.preload_loss_per_h / 3600,
        )
        for joint, moduli in zip(rig.joints, moduli_at(rig, name), strict=True)
    ]  # fmt: skip
    plan = Plan(
        rig, layout or rig.bench_layout(), joints, instruments,
        moduli_rate_per_s=-rig.drift.stiffness_per_K * rig.drift.temperature_K_per_h / 3600,
        clock_error=rig.acquisition.clock_error_ppm * 1e-6,
        frequency_errors=np.asarray(rig.natural_frequencies.offset, float),
    )  # fmt: skip
    apply_effects(plan, [*rig.effect, *effects])
    return plan


def check_effects(rig: Rig, *, source: str) -> None:
    """Let the effects of a rig's file act, for what is wrong with them; `source` names the file.

    Raises
    ------
    InputError
        If one has wrong parameters, or acts where the rig has nothing.
    """
    if not rig.effect:
        return
    with blamed_on(source):
        plan = planned(rig)
        matrices, _ = altered_matrices(plan)
        for make in plan.element_makers:
            make(matrices)
