"""What is always unknown of a rig: its linear parameters, its joints' laws, and what its sensors show of each mode."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from twin.arrays import Array
from twin.identify.linear.blocks import Blocks
from twin.identify.linear.linear_model import LinearParameters
from twin.identify.nonlinear.joint_law import LayerLaw


@dataclass(frozen=True)
class BaselineParameters:
    """The base family's parameters: the linear ones, and each joint's law in the rig's order."""

    base: LinearParameters
    laws: tuple[LayerLaw, ...]
    shown: Array = field(default_factory=lambda: np.zeros(0))
    """Logarithms (o m,) of what each response shows of each mode over what the model says; empty where nothing was
    measured so roughly that it matters."""
    shifts: Array = field(default_factory=lambda: np.zeros(0))
    """How far all natural frequencies of each broadband run and of each sweep lie off, (k,), in units of
    :data:`~twin.identify.frequency_shifts.SHIFT`; empty where there is one of these alone."""

    @cached_property
    def blocks(self) -> Blocks:
        """Of :attr:`vector`."""
        laws = [
            block
            for joint, law in enumerate(self.laws)
            for block in ((f"softening {joint}", len(law.softening)), (f"loss {joint}", len(law.loss)))
        ]
        beside = ("shown", len(self.shown)), ("shifts", len(self.shifts))
        return Blocks((*self.base.blocks(self.base.joints).sizes, *laws, *beside))

    @property
    def vector(self) -> Array:
        """All in one vector; the law in units of the assumed moduli is the caller's matter."""
        return np.concatenate([self.base.vector, *(law.vector for law in self.laws), self.shown, self.shifts])

    def softening(self, joint: int) -> slice:
        """Where the softening of a joint's law is in :attr:`vector`."""
        return self.blocks[f"softening {joint}"]

    def loss(self, joint: int) -> slice:
        """Where the loss of a joint's law is in :attr:`vector`."""
        return self.blocks[f"loss {joint}"]

    @property
    def of_laws(self) -> slice:
        """Where the laws are in :attr:`vector`."""
        return slice(len(self.base.vector), self.blocks["shown"].start)

    def with_vector(self, vector: Array) -> BaselineParameters:
        """Parameters of the same knots from a vector."""
        laws = (
            replace(law, softening=vector[self.softening(joint)], loss=vector[self.loss(joint)])
            for joint, law in enumerate(self.laws)
        )
        base = LinearParameters.from_vector(vector[: self.of_laws.start])
        shown, shifts = vector[self.blocks["shown"]], vector[self.blocks["shifts"]]
        return BaselineParameters(base, tuple(laws), shown, shifts)
