"""How a cause extends the forward model: every way in which a rig can differ from what is assumed.

An empty extension is the base model.  A cause fills in what it touches; the prediction asks for nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from operator import add, mul
from typing import Any

import numpy as np

from twin.arrays import Array
from twin.identify.slipping import Slider
from twin.rigs import Place
from twin.structure import Structure

OF_STRUCTURE = "beam_modulus", "beam_shear_ratio", "clamp_rad_per_Nm", "layer_gradient"
"""What changes beams, supports or layers."""
StructureKey = tuple[tuple[tuple[str, float], ...], ...]
"""Names and values of each of these."""


@dataclass(frozen=True)
class Attachment:
    """Something linear fixed to the structure."""

    rows: Callable[[Structure], Array]
    """The ports (p, n) on a given structure."""
    stiffness: Callable[[Array], Array]
    """Dynamic stiffness at omega: (f, p) for a diagonal, or (f, p, p)."""
    beam: str = ""
    """Of which it is a change of stiffness, in proportion to Young's modulus; empty for what is no part of a beam."""
    drive: int | None = None
    """Number of the drive that brings it along: it is there while that one acts."""


def point_mass(place: Place, mass_kg: float, *, directions: int) -> Attachment:
    """A mass fixed at a place, which moves in so many directions."""
    return Attachment(
        lambda structure: structure.translations(place),
        lambda omega: -mass_kg * omega[:, None] ** 2 * np.ones(directions),
    )


@dataclass(frozen=True)
class NoiseMotion:
    """Motion of a port under broadband noise."""

    omega: Array
    """Middles of frequency bands, rad/s, (f,)."""
    power: Array
    """Mean square displacement in each, m2, (f,)."""

    @property
    def displacement(self) -> float:
        """Rms, m."""
        return float(np.sqrt(np.sum(self.power)))

    @property
    def velocity(self) -> float:
        """Rms, m/s."""
        return float(np.sqrt(np.sum(self.omega**2 * self.power)))


@dataclass(frozen=True)
class NonlinearForce:
    """A force on one port that depends on that port's motion."""

    row: Callable[[Structure], Array]
    """The port (n,) on a given structure."""
    equivalent: Callable[..., Array]
    """Complex equivalent stiffness, at amplitude (f,) and frequency omega (f,) of the port's motion."""
    harmonics: Callable[..., Array]
    """Complex harmonics 1 ... h (f, h) of the restoring force for motion a cos(omega t), at amplitude a (f,), with h
    and omega (f,)."""
    random: Callable[[NoiseMotion, Array], Array] | None = None
    """Complex dynamic stiffness (f,) of the best linear substitute under broadband motion, from that motion and omega
    (f,): statistical linearisation.  Without it the force is taken to vanish there."""
    slider: Slider | None = None
    """Whose `equivalent` and `harmonics` these are, which take what it slips into (f, 3) as well; compiled code then
    evaluates them by itself."""


@dataclass(frozen=True)
class Opening:
    """A layer that loses contact where a point opens by more than `gap_m`; its slope goes on with `factor` of itself.

    The opening counts from rest, in the direction of :func:`twin.structure.layer_points`.
    """

    gap_m: float
    factor: float


def _of_each(merge: Callable[[Any, Any], Any]) -> Any:
    """A mapping, empty by default; of two that are merged, what both have becomes one by `merge`."""

    def merged(one: Mapping[str, Any], two: Mapping[str, Any]) -> dict[str, Any]:
        return {**one, **two, **{key: merge(one[key], two[key]) for key in one if key in two}}

    return field(default_factory=dict, metadata={"merge": merged})


def _product(one: Callable[[Array], Array], two: Callable[[Array], Array]) -> Callable[[Array], Array]:
    return lambda omega: np.asarray(one(omega)) * np.asarray(two(omega))


@dataclass(frozen=True, kw_only=True)
class ModelModification:
    """What differs from the nominal rig."""

    beam_modulus: Mapping[str, float] = _of_each(mul)
    """True over assumed Young's modulus of a beam."""
    beam_shear_ratio: Mapping[str, float] = _of_each(add)
    """E / (kappa G) of a beam beside what it is assumed to have."""
    clamp_rad_per_Nm: Mapping[str, float] = _of_each(add)
    """Rotation per moment of the supports of a part."""
    layer_gradient: Mapping[str, float] = _of_each(add)
    """Relative fall of a joint's moduli along its overlap."""
    towards_middle: Mapping[str, float] = _of_each(add)
    """How far a joint's openings are, from the mean of a layer element (0) towards the one in its middle (1)."""
    drive_offset_m: Mapping[str, float] = _of_each(add)
    output_offset_m: Mapping[str, float] = _of_each(add)
    """How far towards the tip the drive, and response channels, are from where they are assumed to be."""
    attachments: tuple[Attachment, ...] = ()
    nonlinear: tuple[NonlinearForce, ...] = ()
    channel_factor: Mapping[str, Callable[[Array], Array]] = _of_each(_product)
    """Measured over true response of a channel, (f,) at omega."""
    base_receptance: float = 0.0
    """Motion of the clamp per drive force, m/N."""
    cross_talk: tuple[tuple[str, str, float], ...] = ()
    """Channel, source and factor: the part of the source's reading that is added to the channel's."""
    frequency_factor: float = field(default=1.0, metadata={"merge": mul})
    """True over commanded frequency."""
    moduli_factor: Mapping[str, tuple[float, float]] = _of_each(lambda one, two: (one[0] * two[0], one[1] * two[1]))
    """Factors on a joint's E' and G' beyond what the experimenter may be wrong about anyway."""
    opening: Mapping[str, Opening] = _of_each(lambda _, two: two)
    """One-sided contact in a joint."""
    layer_drift_per_s: Mapping[str, float] = _of_each(add)
    """Relative rate at which a joint's E' falls, from the first step on."""
    beam_drift_per_s: float = 0.0
    """The same of all moduli of the structure."""

    def merged(self, other: ModelModification) -> ModelModification:
        """Both at once: sums, where a field does not say otherwise."""
        return ModelModification(
            **{
                one.name: one.metadata.get("merge", add)(getattr(self, one.name), getattr(other, one.name))
                for one in fields(self)
            }
        )

    @property
    def changes_structure(self) -> bool:
        """Whether beams, clamp or layer must be assembled anew."""
        return any(self.structure)

    @property
    def structure(self) -> StructureKey:
        """What tells one structure from another."""
        return tuple(tuple(sorted(getattr(self, name).items())) for name in OF_STRUCTURE)

    @staticmethod
    def of_structure(key: StructureKey) -> ModelModification:
        """What changes a structure so, and nothing else."""
        changed: dict[str, Any] = {name: dict(own) for name, own in zip(OF_STRUCTURE, key, strict=True)}
        return ModelModification(**changed)
