"""A law by its name: what its parameters are, what makes it, and how it is told."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, create_model

from twin.arrays import Array
from twin.joint.law import Law
from twin.joint.limits import LIMITS
from twin.joint.slap import PiecewiseLinearContact
from twin.joint.table import ForceTable

Value = float | list[float]


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A parameter of a law."""

    name: str
    """As it stands in a rig file."""
    unit: str
    """SI; of stiffnesses ``N/m2``, as the moduli of the layer have it."""
    about: str
    """What it is, in half a sentence."""
    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    """Bounds, the outer two of which it must not reach."""
    default: Value | None = None
    """Its value where a file leaves it out; None must be given."""
    several: bool = False
    """Whether it is a list."""

    @property
    def field(self) -> tuple[Any, Any]:
        """Type and default of a pydantic model's field."""
        one = Annotated[
            float, Field(gt=self.above, ge=self.least, lt=self.below, le=self.most, allow_inf_nan=False)
        ]  # fmt: skip
        kind = Annotated[list[one], Field(max_length=200)] if self.several else one
        return kind, ... if self.default is None else self.default


@dataclass(frozen=True)
class PointForce:
    """What a law adds at a point of the layer: its force less that of its stiffness at rest.

    E' and G' of a preload are the layer's moduli at rest.  A law takes its stiffness at rest over from them, so that
    small motions have the same moduli whatever the law is.
    """

    law: Law
    """Modulus times metres (N/m) over the coordinate's metres."""
    at_rest: float
    """Its stiffness at rest, N/m2."""

    @staticmethod
    def of(law: Law) -> PointForce:
        """With the law's own stiffness at rest."""
        return PointForce(law, float(np.real(law.describing_function(np.array(LIMITS.at_rest_m)))))

    @property
    def most_taken(self) -> float:
        """What it takes off the modulus where it is softest, N/m2; of a law with memory, where all of it slips."""
        if isinstance(self.law, ForceTable):
            return self.at_rest - float(self.law.tangent.min())
        if isinstance(self.law, PiecewiseLinearContact):
            return self.at_rest - self.law.least_tangent
        return self.at_rest

    def force_history(self, e: Array) -> Array:
        """Force along a path, N/m."""
        return self.law.force_history(e) - self.at_rest * e

    def describing_function(self, amplitude: Array) -> Array:
        """What is added to the modulus at an amplitude, complex, N/m2."""
        return self.law.describing_function(amplitude) - self.at_rest


@dataclass(frozen=True, kw_only=True)
class NamedLaw:
    """A law that a rig file can name."""

    name: str
    """In rig files."""
    sentence: str
    """What it says of a joint, with values in braces: ``a spring of {stiffness:g} N/m2``."""
    parameters: tuple[Parameter, ...]
    """In the order in which `make` has them."""
    make: Callable[..., Law]
    """The law, from values by name.  It raises ValueError where they do not go together."""

    def values(self, given: Mapping[str, Any]) -> dict[str, Value]:
        """All parameters in order, those left out at their defaults.

        A pydantic.ValidationError if one is missing, unknown or out of its bounds.
        """
        fields: dict[str, Any] = {parameter.name: parameter.field for parameter in self.parameters}
        model: type[BaseModel] = create_model(self.name, __config__=ConfigDict(extra="forbid"), **fields)
        return model.model_validate(dict(given)).model_dump()

    def force(self, given: Mapping[str, Any]) -> PointForce:
        """What it adds to the layer, with these values."""
        return PointForce.of(self.make(**self.values(given)))

    def told(self, given: Mapping[str, Any]) -> str:
        """The sentence with these values."""
        return self.sentence.format(**self.values(given))

    def reach_m(self, given: Mapping[str, Any]) -> tuple[float, float]:
        """Smallest and largest of its lengths, between which it changes; (inf, 0) if it has none."""
        values = self.values(given)
        lengths = [np.ravel(values[p.name]) for p in self.parameters if p.unit == "m"]
        found = np.concatenate([np.zeros(0), *lengths])
        found = found[found > 0]
        return (float(found.min()), float(found.max())) if len(found) else (np.inf, 0.0)
