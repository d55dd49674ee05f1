"""What is always unknown of a rig, and how much its model may be wrong while a fit finds its way."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.blocks import Blocks
from twin.identify.joint_law import LayerLaw
from twin.identify.linear_fit import DETUNING_STD, MODULI_STD
from twin.identify.linear_model import LinearParameters

__all__ = ["LOOSE", "STIFF", "TIGHT", "BaselineParameters", "DiscrepancyLevel"]

Array = NDArray[Any]


@dataclass(frozen=True)
class DiscrepancyLevel:
    """How much a model may be wrong beyond its noise.

    Sharp resonances make false minima.  A fit that begins with much discrepancy follows the measured resonances
    whatever is wrong with the model, and is then held to less and less of it.

    Attributes
    ----------
    frequency_discrepancy_std : float
        Prior of the natural frequencies' own relative errors.
    error_scale : float
        Factor on the model error of the responses.
    moduli_std : float
        Prior of log E' and log G': tighter where the model error is large, because that error is shared by many bins
        and would else count as many independent witnesses for wrong moduli.
    law_bend : float
        Of the second differences of softening and loss over twenty knots, in units of their scales.  A law that bends
        easily takes in the kinks that a cause should explain, and is a trap; else it is a little too straight.
    """

    frequency_discrepancy_std: float = DETUNING_STD
    error_scale: float = 1.0
    moduli_std: float = MODULI_STD
    law_bend: float = 0.5


TIGHT = DiscrepancyLevel()
STIFF = DiscrepancyLevel(law_bend=0.1)
LOOSE = DiscrepancyLevel(0.03, 60.0, 0.01)


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
