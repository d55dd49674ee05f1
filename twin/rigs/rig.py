"""The rig file, field by field.  SI units throughout."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

__all__ = [
    "Acquisition",
    "Beam",
    "Damping",
    "Drive",
    "Effect",
    "Joint",
    "LawTable",
    "Mesh",
    "Preload",
    "Rig",
    "Sensor",
]

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Name = Annotated[str, Field(min_length=1, max_length=64)]


class _Table(BaseModel):
    """A TOML table: unknown keys are errors, so that a misspelt field is not silently a default."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Beam(_Table):
    """A uniform rectangular beam."""

    length: Positive
    width: Positive
    thickness: Positive
    youngs_modulus: Positive
    density: Positive
    shear_ratio: NonNegative = 0.0
    """E / (kappa G) of a Timoshenko beam; 0 is Euler-Bernoulli."""

    @property
    def area(self) -> float:
        """Cross-section, m2."""
        return self.width * self.thickness

    @property
    def second_moment(self) -> float:
        """Second moment of area, m4."""
        return self.width * self.thickness**3 / 12.0


class Preload(_Table):
    """Moduli of the thin layer at one preload: E' and G', N/m2."""

    normal_modulus: Positive
    shear_modulus: Positive


class LawTable(_Table):
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
    softening_std: list[NonNegative] = []
    loss_std: list[NonNegative] = []

    @model_validator(mode="after")
    def _equal_lengths(self) -> LawTable:
        if any(b <= a for a, b in zip(self.amplitude_m, self.amplitude_m[1:], strict=False)):
            raise ValueError("amplitude_m must increase")
        for name in ("softening", "loss"):
            if len(getattr(self, name)) != len(self.amplitude_m):
                raise ValueError(f"{name} must have as many entries as amplitude_m")
        return self


class Joint(_Table):
    """The overlap and its thin layer, whose height is measured from neutral axis to neutral axis."""

    overlap: Positive
    layer_height: Positive
    layer_elements: Annotated[int, Field(ge=1, le=50)] = 3
    preload: dict[str, Preload] = Field(min_length=1)
    law: LawTable | None = None


class Mesh(_Table):
    """Number of beam elements of the two beams together."""

    beam_elements: Annotated[int, Field(ge=4, le=1000)] = 41


class Damping(_Table):
    """Modal damping ratios; modes beyond the list take the last one."""

    modal_ratio: list[Annotated[float, Field(gt=0, lt=1)]] = Field(min_length=1, max_length=50)


class Drive(_Table):
    """The shaker behind the force cell, and where it drives the structure."""

    position: NonNegative
    armature_mass: Positive
    suspension_stiffness: NonNegative
    force_factor: Positive
    coil_resistance: Positive
    coil_inductance: Positive
    stinger_stiffness: Positive


class Sensor(_Table):
    """A transducer and its converter channel: range in its unit, noise in unit per root hertz, high-pass in Hz."""

    channel: Name
    quantity: Literal["force", "acceleration", "velocity", "displacement"]
    position: NonNegative
    mass: NonNegative = 0.0
    range: Positive
    noise_density: NonNegative = 0.0
    high_pass: NonNegative = 0.0


class Acquisition(_Table):
    """The converter."""

    bits: Annotated[int, Field(ge=8, le=32)] = 24


class Measured(_Table):
    """What was measured on the real rig at one preload."""

    natural_frequencies: list[Positive] = Field(min_length=1, max_length=50)


class Effect(_Table):
    """A cause that the model was extended by: its contract name and parameters, with standard deviations."""

    cause: Name
    parameters: dict[str, float | str]
    std: dict[str, float] = {}


class Rig(_Table):
    """A rig as an experimenter describes it, or as a diagnosis extended it (`effect`)."""

    name: Name
    lower: Beam
    upper: Beam
    joint: Joint
    mesh: Mesh = Mesh()
    damping: Damping
    drive: Drive
    sensor: list[Sensor] = Field(min_length=1, max_length=32)
    acquisition: Acquisition = Acquisition()
    measured: dict[str, Measured] = {}
    effect: list[Effect] = []

    @model_validator(mode="after")
    def _geometry(self) -> Rig:
        if self.joint.overlap >= min(self.lower.length, self.upper.length):
            raise ValueError(
                f"joint.overlap {self.joint.overlap} must be shorter than both beams "
                f"(lower.length {self.lower.length}, upper.length {self.upper.length})"
            )
        if self.mesh.beam_elements < 2 * self.joint.layer_elements + 2:
            raise ValueError(
                f"mesh.beam_elements {self.mesh.beam_elements} leaves no element outside the overlap; "
                f"at least {2 * self.joint.layer_elements + 2} are needed"
            )
        places = [("drive.position", self.drive.position)]
        places += [(f"sensor {s.channel!r}: position", s.position) for s in self.sensor]
        for place, position in places:
            if position > self.length + 1e-9:
                raise ValueError(f"{place} {position} lies beyond the structure's end at {self.length:.4g} m")
        names = [s.channel for s in self.sensor]
        if len(set(names)) != len(names):
            raise ValueError(f"sensor channels must be unique, got {names}")
        if not any(s.quantity == "force" for s in self.sensor):
            raise ValueError("one sensor must measure force")
        return self

    @property
    def length(self) -> float:
        """From the clamp to the tip, m."""
        return self.lower.length + self.upper.length - self.joint.overlap

    @property
    def force_sensor(self) -> Sensor:
        """The force cell."""
        return next(s for s in self.sensor if s.quantity == "force")

    @property
    def response_sensors(self) -> list[Sensor]:
        """All sensors but the force cell, in the file's order."""
        return [s for s in self.sensor if s.quantity != "force"]

    def preload_name(self, name: str | None = None) -> str:
        """The named preload, or the first of the file.

        Raises
        ------
        KeyError
            If the rig has no such preload.
        """
        if name is None:
            return next(iter(self.joint.preload))
        if name not in self.joint.preload:
            raise KeyError(f"rig {self.name!r} has no preload {name!r}; it has {', '.join(self.joint.preload)}")
        return name
