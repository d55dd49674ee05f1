"""Tables that every rig file has: preloads, damping, shaker, transducers, converter, drift, effects.  SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, field_validator, model_validator

from recordings.numbers import Finite, Mass, Modulus, NonNegative, Positive
from recordings.quantities import follows_excitation, known_quantities, quantity
from recordings.toml_input import Name, Table
from twin.rigs.limits import LIMITS

if TYPE_CHECKING:
    from twin.joint import NamedLaw, PointForce


class Preload(Table):
    """Moduli of the thin layer at one preload: E' and G', N/m2."""

    normal_modulus: Modulus
    shear_modulus: Modulus


def check_knots(table: Table, knots: str, *values: str) -> None:
    """See that knots rise, and that each of the fields over them has as many entries, or may be left out and is."""
    x = getattr(table, knots)
    if any(after <= before for before, after in pairwise(x)):
        raise ValueError(f"{knots} must increase")
    for name in values:
        given = getattr(table, name)
        if len(given) != len(x) and (given or type(table).model_fields[name].is_required()):
            raise ValueError(f"{name} must have as many entries as {knots}")


class LawTable(Table):
    """Amplitude-dependent part of the layer's moduli: E' = E'0 - g1(X), G' = G'0 + j g2(X).

    `amplitude_m` are the knots of piecewise cubic functions of the response amplitude X at `channel`; `softening` and
    `loss` are g1 and g2 at the knots, N/m2.  Beyond the last knot both stay constant, and so below the first.

    X is the channel's displacement amplitude times (omega / omega_1)^2, in other words its acceleration amplitude over
    omega_1^2, because the joint's load follows the inertia outboard of it; omega_1 is the first natural frequency that
    this file's beams and moduli give without any `effect`.  Near the first resonance X is the displacement.

    `softening_std` is the standard deviation of E'(X) = E'0 - g1(X), and `loss_std` that of g2(X) together with the
    damping ratio of mode 1 in its units: such parts err together, and their sum is what a response feels.
    """

    channel: Name
    amplitude_m: list[NonNegative] = Field(min_length=2, max_length=200)
    softening: list[Finite]
    loss: list[Finite]
    softening_std: list[NonNegative] = Field(default=[])
    loss_std: list[NonNegative] = Field(default=[])

    @model_validator(mode="after")
    def _equal_lengths(self) -> LawTable:
        check_knots(self, "amplitude_m", "softening", "loss", "softening_std", "loss_std")
        return self

    @property
    def sentence(self) -> str:
        """What it says of the joint."""
        softer, loss = max(self.softening), max(self.loss)
        return (
            f"softens by up to {softer:.3g} N/m2 and loses up to {loss:.3g} N/m2 over the amplitude at {self.channel}, "
            f"a table up to {self.amplitude_m[-1]:.3g} m"
        )


class LayerLawTable(Table):
    """Amplitude-dependent part of the layer's moduli at each of its points: E' - g1(o), G' + j g2(s).

    `opening_m` and `slip_m` are the knots of piecewise cubic functions of a point's own amplitudes of opening and of
    slip; `softening` is g1 at the former, `loss` g2 at the latter, N/m2.  Beyond the last knots both stay constant, and
    so below the first.  A point is a layer element (`layer_elements`), its opening and slip are the element's means.

    `softening_std` is the standard deviation of E'(o) = E'0 - g1(o), and `loss_std` that of g2(s) together with the
    damping ratio of mode 1 in its units: such parts err together, and their sum is what a response feels.
    """

    opening_m: list[NonNegative] = Field(min_length=2, max_length=200)
    softening: list[Finite]
    slip_m: list[NonNegative] = Field(min_length=2, max_length=200)
    loss: list[Finite]
    softening_std: list[NonNegative] = Field(default=[])
    loss_std: list[NonNegative] = Field(default=[])

    @model_validator(mode="after")
    def _equal_lengths(self) -> LayerLawTable:
        check_knots(self, "opening_m", "softening", "softening_std")
        check_knots(self, "slip_m", "loss", "loss_std")
        return self

    @property
    def sentence(self) -> str:
        """What it says of the joint."""
        return (
            f"softens by up to {max(self.softening):.3g} N/m2 as it opens, a table up to {self.opening_m[-1]:.3g} m, "
            f"and loses up to {max(self.loss):.3g} N/m2 as it slips, a table up to {self.slip_m[-1]:.3g} m"
        )


class PointLaw(BaseModel):
    """A law by its name, with its parameters beside it: ``{ name = "jenkins", stiffness = 3e7, slips_at = 1e-6 }``.

    Lengths are metres of the coordinate that it acts on, stiffnesses N/m2, as the layer's moduli are.
    """

    model_config = ConfigDict(extra="allow", frozen=True)

    name: Name

    @model_validator(mode="after")
    def _known(self) -> PointLaw:
        self.law.values(self.values)
        self.law.force(self.values)
        return self

    @property
    def law(self) -> NamedLaw:
        """The law of that name; ValueError if there is none."""
        from twin.joint import law_named  # most rigs need none of them

        return law_named(self.name)

    @property
    def values(self) -> dict[str, Any]:
        """Its parameters, as far as they are given."""
        return self.__pydantic_extra__ or {}

    @property
    def force(self) -> PointForce:
        """What it adds at a point of the layer."""
        return self.law.force(self.values)

    @property
    def sentence(self) -> str:
        """What it says of the joint."""
        return self.law.told(self.values)

    @property
    def reach_m(self) -> tuple[float, float]:
        """Smallest and largest of its lengths."""
        return self.law.reach_m(self.values)


class NamedLaws(Table):
    """Laws by name on a point's own opening and on its own slip, which act side by side.

    E' and G' of a preload are the moduli at rest; what a law has of stiffness there, it takes over from them.
    """

    opening: list[PointLaw] = Field(default=[], max_length=8)
    slip: list[PointLaw] = Field(default=[], max_length=8)

    @field_validator("opening", "slip", mode="before", json_schema_input_type=PointLaw | list[PointLaw])
    @classmethod
    def _one_or_more(cls, value: Any) -> Any:
        return [value] if isinstance(value, dict) else value

    @model_validator(mode="after")
    def _some(self) -> NamedLaws:
        if not self.opening and not self.slip:
            raise ValueError("it has no law: name one for opening or for slip")
        return self

    @property
    def sentence(self) -> str:
        """What it says of the joint."""
        told = [f"over its opening it {law.sentence}" for law in self.opening]
        return "; ".join(told + [f"over its slip it {law.sentence}" for law in self.slip])

    def check_moduli(self, *, E: float, G: float) -> None:
        """See that the laws leave something of the moduli, N/m2; ValueError if they take more off one than there is."""
        for name, laws, what, modulus in (("opening", self.opening, "E'", E), ("slip", self.slip, "G'", G)):
            taken = sum(law.force.most_taken for law in laws)
            if taken > LIMITS.more_than_all * modulus:
                raise ValueError(f"law.{name} takes {taken:.4g} N/m2 off {what}, which is {modulus:.4g} N/m2")


class LawOfRig(Table):
    """A law borrowed from a shipped rig that it was calibrated on, scaled to the layer's own E'."""

    of: Literal["steel-lap-joint"]

    @property
    def sentence(self) -> str:
        """What it says of the joint."""
        return f"softens and loses as that of {self.of}, which is calibrated, scaled to E'"


def _law_of_its_kind(value: Any) -> Any:
    """A law's table, read as what it has the fields of."""
    if not isinstance(value, dict):
        return value
    if "name" in value:
        raise ValueError("what does the law act on? It goes into [joint.law.opening] or [joint.law.slip]")
    if "of" in value:
        return LawOfRig.model_validate(value)
    if {"opening", "slip"} & set(value):
        return NamedLaws.model_validate(value)
    return (LawTable if {"channel", "amplitude_m"} & set(value) else LayerLawTable).model_validate(value)


AnyLaw = Annotated[LawTable | LayerLawTable | NamedLaws | LawOfRig, BeforeValidator(_law_of_its_kind)]
"""What a joint's ``law`` may be."""


def check_law(law: LawTable | LayerLawTable | NamedLaws | LawOfRig | None, preloads: Mapping[str, Preload]) -> None:
    """See that a law by name leaves something of the moduli at every preload; ValueError if not."""
    if not isinstance(law, NamedLaws):
        return
    for name, moduli in preloads.items():
        try:
            law.check_moduli(E=moduli.normal_modulus, G=moduli.shear_modulus)
        except ValueError as error:
            raise ValueError(f"{error} at preload {name!r}") from error


class Damping(Table):
    """Modal damping ratios; modes beyond the list take the last one."""

    modal_ratio: list[Annotated[float, Field(gt=0, lt=1)]] = Field(min_length=1, max_length=50)
    modal_ratio_std: list[NonNegative] | None = Field(default=None, max_length=50)
    """Standard deviations of the first ones, where they were identified."""


_SHAKER = ("armature_mass", "force_factor", "coil_resistance", "coil_inductance", "stinger_stiffness")
"""What every shaker has."""


class Shaker(Table):
    """The shaker behind the force cell, and its amplifier; without any of their fields an ideal force, N for V."""

    armature_mass: Positive = 0.0
    suspension_stiffness: NonNegative = 0.0
    force_factor: Positive = 0.0
    """At rest, N/A."""
    half_force_stroke: Positive | None = None
    """Armature displacement at which the force factor has fallen to half, m; left out, it does not depend on it."""
    stroke_limit: Positive | None = None
    """Travel to either end stop, m."""
    stop_stiffness: Positive = 1.0e6
    """Of the end stops, N/m."""
    coil_resistance: Positive = 0.0
    coil_inductance: Positive = 0.0
    stinger_stiffness: Positive = 0.0
    """Axial, N/m."""
    stinger_lateral_stiffness: NonNegative = 0.0
    """Along the beam, at the surface the stinger is screwed to, N/m."""
    amplifier: Literal["voltage", "current"] = "voltage"
    """What the amplifier holds against the load."""
    amplifier_gain: Positive = 1.0
    """V or A per volt of the generator."""
    output_resistance: Positive = 1.0e3
    """Of an amplifier that holds the current, ohm."""
    voltage_limit: Positive | None = None
    """Of the amplifier, V."""
    current_limit: Positive | None = None
    """Of amplifier or coil, A."""
    force_limit: Positive | None = None
    """Rated force of the shaker, N: the amplifier holds the current below it."""

    @property
    def ideal(self) -> bool:
        """Whether there is no shaker, but a force as it is asked for."""
        return not any(getattr(self, name) for name in _SHAKER)

    @model_validator(mode="after")
    def _whole(self) -> Shaker:
        missing = [name for name in _SHAKER if not getattr(self, name)]
        given = self.model_fields_set & (set(Shaker.model_fields) - {"stinger_lateral_stiffness"})
        if missing and given:
            raise ValueError(
                f"a shaker needs {', '.join(missing)} too; without any of a shaker's fields there is an ideal force"
            )
        if self.amplifier == "voltage" and "output_resistance" in self.model_fields_set:
            raise ValueError("output_resistance belongs to an amplifier that holds the current: amplifier = 'current'")
        if self.stroke_limit and self.stop_stiffness > self.armature_mass * (2 * math.pi * LIMITS.hardest_stop_Hz) ** 2:
            raise ValueError(
                f"stop_stiffness {self.stop_stiffness:g} lets the armature bounce faster than "
                f"{LIMITS.hardest_stop_Hz:g} Hz, which the bench's steps do not resolve"
            )
        if self.amplifier == "current" and self.output_resistance < self.coil_resistance:
            raise ValueError(
                f"output_resistance {self.output_resistance:g} below coil_resistance {self.coil_resistance:g}: "
                "such an amplifier does not hold the current"
            )
        return self


class Transducer(Table):
    """A transducer and its converter channel: range in its unit, noise in unit per root hertz, high-pass in Hz."""

    channel: Name
    quantity: Name
    """Force, or what the table of quantities knows as a response: acceleration, strain, ..."""
    mass: Mass = 0.0
    """What the beam feels; of a force cell, the part on the beam's side of its crystal, kg."""
    stinger_side_mass: Mass = 0.0
    """Of a force cell, the part on the stinger's side, which moves with the beam and is not measured, kg."""
    range: Positive
    noise_density: NonNegative = 0.0
    high_pass: NonNegative = 0.0
    mounting_frequency: Positive | None = None
    """Resonance of the mounted transducer, Hz; left out, there is none."""
    mounting_damping: Annotated[float, Field(gt=0, lt=1)] = 0.02
    transverse_sensitivity: Annotated[float, Field(ge=-0.2, le=0.2)] = 0.0
    """Share of the motion along the beam, at the surface, that an accelerometer also shows."""

    modal_factor: list[Positive] = Field(default=[], max_length=50)
    """What it was identified to show of the first modes, over what its place says: it leans, sits beside it, loads."""

    @field_validator("quantity")
    @classmethod
    def _follows_the_excitation(cls, value: str) -> str:
        if not follows_excitation(value):
            measured = [one for one in known_quantities() if follows_excitation(one)]
            raise ValueError(f"a transducer measures one of {', '.join(measured)}")
        return value

    @model_validator(mode="after")
    def _of_the_kind(self) -> Transducer:
        if self.quantity != "force" and self.stinger_side_mass:
            raise ValueError("stinger_side_mass belongs to the force cell")
        if self.quantity != "acceleration" and self.transverse_sensitivity:
            raise ValueError("transverse_sensitivity belongs to an accelerometer")
        if self.mounting_frequency is None and "mounting_damping" in self.model_fields_set:
            raise ValueError("mounting_damping needs a mounting_frequency")
        return self

    @property
    def reads(self) -> str:
        """What of the structure's motion it reads: displacement or strain; nothing for a force."""
        return quantity(self.quantity).reads


class Acquisition(Table):
    """The converter."""

    bits: Annotated[int, Field(ge=8, le=32)] = 24
    clock_error_ppm: Annotated[float, Field(ge=-1e4, le=1e4)] = 0.0
    """How much faster than nominal it samples."""
    anti_alias: bool = True
    """Linear-phase filter before decimation; without it, whatever lies above half the rate folds back."""


class Drift(Table):
    """What changes slowly while the rig runs."""

    temperature_K_per_h: Finite = 0.0
    stiffness_per_K: Finite = -2.5e-4
    """Relative change of all moduli; steel's if left out."""
    preload_loss_per_h: Annotated[float, Field(ge=-10, le=10)] = 0.0
    """Relative loss of the layer's E'."""


class NaturalFrequencies(Table):
    """What the natural frequencies do beside the model of parts and joints: found by identification."""

    offset: list[Annotated[float, Field(gt=-0.3, lt=0.3)]] = Field(default=[], max_length=50)
    """Relative, of the first ones: measured over modelled, less one; half of what the modal stiffness is off by."""
    offset_std: NonNegative = 0.0
    """Of each offset, from the cases that it was identified on."""
    scatter: Annotated[float, Field(ge=0, lt=0.1)] = 0.0
    """Relative standard deviation of each from one assembly to the next."""


class Measured(Table):
    """What was measured on the real rig at one preload."""

    natural_frequencies: list[Positive] = Field(min_length=1, max_length=50)


class Effect(Table):
    """A cause that the model was extended by: its contract name and parameters, with standard deviations."""

    cause: Name
    parameters: dict[str, Finite | str]
    std: dict[str, float] = Field(default={})
