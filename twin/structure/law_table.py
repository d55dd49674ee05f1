"""The joint's law of a rig file as every model takes it: over each point's own opening and slip."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from twin.arrays import Array
from twin.joint import Curve, steel_loss, steel_softening
from twin.rigs import LawOfRig, LawTable, LayerLawTable, NamedLaws, PointLaw, Rig
from twin.structure.assembly import assemble
from twin.structure.law_of_mode import layer_law_of_mode
from twin.structure.layer_points import layer_points
from twin.structure.limits import LIMITS
from twin.structure.mode_law import LayerModes
from twin.structure.own_harmonics import with_own_harmonics


def layer_table(rig: Rig, *, E: float, G: float, joint: int = 0) -> LayerLawTable | None:
    """The law of a joint over opening and slip: its own table, or what one over a sensor's amplitude means.

    The latter is what gives the first mode of this file's beams and moduli, without any effect, the same frequency and
    damping at every amplitude; a standard deviation goes with its value.  ValueError if the rig has not the table's
    channel, or the table is not what a law of the points could be; or if laws by name do what a table cannot say.

    Parameters
    ----------
    E, G
        Moduli of the linear layer, N/m2.
    """
    if not rig.joints:
        return None
    table = rig.joints[joint].law
    if isinstance(table, NamedLaws):
        return _tabulated(table)
    if isinstance(table, LawOfRig):
        return _of_steel(E)
    if not isinstance(table, LawTable):
        return table
    if table.channel not in {sensor.channel for sensor in rig.sensor}:
        raise ValueError(f"joint.law.channel {table.channel!r} is not a sensor of the rig")
    return _translated(_RigFile(rig.model_dump_json(), rig), E, G)


def _tabulated(laws: NamedLaws) -> LayerLawTable:
    """Describing functions of laws by name; ValueError if they lose over the opening or soften over the slip."""
    opening_m, over_opening = _described(laws.opening)
    slip_m, over_slip = _described(laws.slip)
    for kept, left, does in (
        (over_opening.real, over_opening.imag, "loses as the layer opens"),
        (over_slip.imag, over_slip.real, "changes the stiffness as the layer slips"),
    ):
        if np.max(np.abs(left)) > LIMITS.law_table_forgiven * np.max(np.abs(kept)):
            raise ValueError(
                f"joint.law: it {does}, and predictions know softening over the opening and loss over the slip "
                "alone; a rehearsal draws all branches of such a law, and identification finds what they see of it"
            )
    return LayerLawTable(
        opening_m=opening_m.tolist(),
        softening=(-over_opening.real).tolist(),
        slip_m=slip_m.tolist(),
        loss=over_slip.imag.tolist(),
    )


def _of_steel(E: float) -> LayerLawTable:
    """The steel rig's law at a layer's normal modulus."""
    softening, loss = steel_softening(E), steel_loss(E)
    opening_m = np.geomspace(LIMITS.law_table_below, LIMITS.law_table_beyond, LIMITS.most_knots) * softening.e0
    slip_m = np.geomspace(LIMITS.law_table_below, 1.0, LIMITS.most_knots) * loss.limit_m
    return LayerLawTable(
        opening_m=opening_m.tolist(),
        softening=(-softening.describing_function(opening_m).real).tolist(),
        slip_m=slip_m.tolist(),
        loss=loss.modulus(slip_m).tolist(),
    )


def _described(laws: Sequence[PointLaw]) -> tuple[Array, Array]:
    """Amplitudes over which laws change, and what they add to the modulus there."""
    reaches = [reach for law in laws if (reach := law.reach_m)[1]] or [LIMITS.law_table_reach_m]
    low, high = min(low for low, _ in reaches), max(high for _, high in reaches)
    amplitude = np.geomspace(LIMITS.law_table_below * low, LIMITS.law_table_beyond * high, LIMITS.most_knots)
    return amplitude, sum(
        (law.force.describing_function(amplitude) for law in laws), np.zeros(LIMITS.most_knots, complex)
    )


@dataclass(frozen=True)
class _RigFile:
    """A rig that is known again by its text."""

    text: str
    rig: Rig = field(compare=False)


@lru_cache(maxsize=32)
def _translated(file: _RigFile, E: float, G: float) -> LayerLawTable:
    rig, (joint,) = file.rig, file.rig.joints
    table = joint.law
    assert isinstance(table, LawTable)
    elements = sum(beam.elements for beam in rig.layout().beams)
    finer = rig.layout(
        beam_elements=LIMITS.law_table_finer * elements, layer_elements=LIMITS.law_table_finer * joint.layer_elements
    )
    structure = assemble(rig, layout=finer)
    points = layer_points(structure, joint.layer_elements)
    modes = LayerModes.of(structure, points, E=E, G=G, sensor=structure.row(rig.place_of(table.channel)))
    knots = np.array(table.amplitude_m)
    X = _amplitudes(knots)
    softening, loss = Curve(knots, np.array(table.softening)), Curve(knots, np.array(table.loss))
    law = with_own_harmonics(modes, layer_law_of_mode(modes, softening, loss, X), float(X[-1]))
    std = [Curve(knots, np.array(s))(X).tolist() if s else [] for s in (table.softening_std, table.loss_std)]
    return LayerLawTable(
        opening_m=law.softening.knots.tolist(),
        softening=law.softening.values.tolist(),
        slip_m=law.loss.knots.tolist(),
        loss=law.loss.values.tolist(),
        softening_std=std[0],
        loss_std=std[1],
    )


def _amplitudes(knots: Array) -> Array:
    """X to translate at: the table's own, and more between them: opening and slip are no straight functions of X."""
    count = min(LIMITS.law_table_amplitudes, LIMITS.most_knots - len(knots))
    if count <= 0:
        return knots
    first, last = knots[0], knots[-1]
    # Half of them evenly over the amplitude, half over its logarithm.
    even = np.linspace(first, last, count // 2)
    kept = list(knots)
    for X in (*even, *np.geomspace(max(first, LIMITS.law_table_smallest * last), last, count - len(even))):
        if np.min(np.abs(np.array(kept) - X)) > LIMITS.law_table_nearest * X:
            kept.append(X)
    return np.sort(kept)
