"""What is always unknown of a rig: its linear parameters and its joints' laws."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.blocks import Blocks
from twin.identify.joint_law import LayerLaw
from twin.identify.linear_model import LinearParameters

Array = NDArray[Any]


@dataclass(frozen=True)
class BaselineParameters:
    """The base family's parameters: the linear ones, and each joint's law in the rig's order."""

    base: LinearParameters
    laws: tuple[LayerLaw, ...]

    @cached_property
    def blocks(self) -> Blocks:
        """Of :attr:`vector`."""
        return self.base.blocks(self.base.joints) + Blocks(
            tuple(
                block
                for joint, law in enumerate(self.laws)
                for block in ((_softening(joint), len(law.softening)), (_loss(joint), len(law.loss)))
            )
        )

    @property
    def vector(self) -> Array:
        """All in one vector; the law in units of the assumed moduli is the caller's matter."""
        return np.concatenate([self.base.vector, *(law.vector for law in self.laws)])

    def softening(self, joint: int) -> slice:
        """Where the softening of a joint's law is in :attr:`vector`."""
        return self.blocks[_softening(joint)]

    def loss(self, joint: int) -> slice:
        """Where the loss of a joint's law is in :attr:`vector`."""
        return self.blocks[_loss(joint)]

    @property
    def of_laws(self) -> slice:
        """Where the laws are in :attr:`vector`."""
        return slice(len(self.base.vector), len(self.blocks))

    def with_vector(self, vector: Array) -> BaselineParameters:
        """Parameters of the same knots from a vector."""
        laws = (
            replace(law, softening=vector[self.softening(joint)], loss=vector[self.loss(joint)])
            for joint, law in enumerate(self.laws)
        )
        return BaselineParameters(LinearParameters.from_vector(vector[: self.of_laws.start]), tuple(laws))


def _softening(joint: int) -> str:
    return f"softening of joint {joint}"


def _loss(joint: int) -> str:
    return f"loss of joint {joint}"
