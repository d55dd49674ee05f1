"""The joint's law on the bench: every point of the layer softens by its own opening and loses by its own slip.

The points are those of :func:`twin.structure.layer_points`, one for each layer element of the rig file, whatever the
bench's own mesh is.  Nothing here knows of modes or sensors: the same law holds in every motion of the joint.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.arrays import Array
from twin.bench.limits import LIMITS
from twin.joint import (
    ForceTable,
    Law,
    Linear,
    RunningLoss,
    Saturating,
    loss_of_knots,
    softening_of_knots,
    steel_loss,
    steel_softening,
)
from twin.rigs import LayerLawTable, NamedLaws


@dataclass(frozen=True)
class JointLaw:
    """What the layer does beyond its linear moduli."""

    normal: Law
    """Law of a point's opening (m), giving modulus times opening (N/m): the part that is added to E' o."""
    loss: RunningLoss | None = None
    """Law of a point's slip, on its velocity; None loses nothing."""
    opening: tuple[Law, ...] = ()
    slip: tuple[Law, ...] = ()
    """Further laws of either, in the same units.  A running loss among them acts on the velocity."""

    def of_share(self, share: float) -> JointLaw:
        """The law where only a share of E' is left: at every opening it takes off that share."""
        normal = self.normal
        if self.opening and share != 1.0:
            raise ValueError("a law that a rig file names cannot be scaled")
        if isinstance(normal, Saturating):
            normal = replace(normal, k=normal.k * share, spring=normal.spring * share)
        elif isinstance(normal, ForceTable):
            normal = replace(normal, force=normal.force * share)
        elif isinstance(normal, Linear):
            normal = replace(normal, coefficient=normal.coefficient * share)
        elif share != 1.0:
            raise ValueError(f"a {type(normal).__name__} law cannot be scaled")
        return replace(self, normal=normal)


def no_law() -> JointLaw:
    """A linear joint."""
    return JointLaw(Linear(0.0))


def steel_law(E: float, *, softening: float = 1.0, loss: float = 1.0) -> JointLaw:
    """The law of the steel lap joint (:mod:`twin.joint.steel`) for a layer of normal modulus `E`, N/m2.

    By factors its softening begins at a smaller opening, so that its tangent stays positive, and it loses more.
    """
    softer, lossy = steel_softening(E), steel_loss(E)
    return JointLaw(replace(softer, e0=softer.e0 / softening), replace(lossy, eta=lossy.eta * loss))


def law_from_table(table: LayerLawTable, *, E: float) -> JointLaw:
    """The time form of a file's functions of amplitude: constant before their first knots, the loss also after.

    The softening is the one odd, single-valued force that has this describing function.  It levels off beyond its last
    knot instead of ending in a corner, which a sine of nearly that amplitude already meets with its harmonics.

    Parameters
    ----------
    table
        Of the rig file.
    E
        Normal modulus, N/m2.

    Raises
    ------
    ValueError
        If the law's tangent modulus would be negative, which no passive layer has.
    """
    normal = softening_of_knots(table.opening_m, table.softening)
    lowest = E + normal.tangent.min()
    if lowest < -0.02 * E:
        raise ValueError(
            f"joint.law: the softening makes the layer's tangent modulus negative ({lowest:.3g} N/m2); it is not the "
            "law of a passive layer over this range of amplitudes"
        )
    return JointLaw(normal, loss_of_knots(table.slip_m, table.loss))


def law_by_name(laws: NamedLaws, *, E: float, G: float) -> JointLaw:
    """The laws that a rig file names, as they act beyond the moduli at rest.

    ValueError if they take more off a modulus than there is.
    """
    try:
        laws.check_moduli(E=E, G=G)
    except ValueError as error:
        raise ValueError(f"joint.{error}") from error
    opening, slip = ([law.force for law in side] for side in (laws.opening, laws.slip))
    held_E, held_G = (-sum(force.at_rest for force in forces) for forces in (opening, slip))
    return JointLaw(
        Linear(held_E),
        opening=tuple(force.law for force in opening),
        slip=((Linear(held_G),) if held_G else ()) + tuple(force.law for force in slip),
    )


def slapping(law: JointLaw, *, E: float, gap_m: float, factor: float) -> JointLaw:
    """The law of a layer that loses contact where it opens: beyond the gap its force goes on with `factor` of itself.

    Parameters
    ----------
    law
        Without slap; its normal part must be single-valued.
    E
        Normal modulus, N/m2.
    gap_m
        Opening of a point at which it loses contact, counted from rest.
    factor
        Stiffness that remains beyond the gap, over what it was.
    """
    parts = (law.normal, *law.opening)
    if any(part.states for part in parts):
        raise ValueError("joint-slap needs a single-valued law of the opening")

    def held(o: Array) -> Array:
        return sum((part.force_history(o) for part in parts), E * o)

    def force(o: Array) -> Array:
        whole, at_gap = held(o), held(np.array([gap_m]))[0]
        return np.where(o > gap_m, at_gap + factor * (whole - at_gap), whole) - E * o

    return replace(law, normal=ForceTable.of(force, limit_m=LIMITS.reference_opening), opening=())
