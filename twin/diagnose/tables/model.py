"""What a diagnosis of natural frequencies asks of a structure, whether a lap joint or one beam alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from twin.diagnose.cause import Parameter
from twin.diagnose.result import Estimate
from twin.rigs import Rig
from twin.rigs.beam import BeamRig
from twin.structure.modes import bending_modes

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class BaseParameter:
    """A modulus that is always identified: its assumed value in N/m2, and how far off it may be, in its logarithm."""

    name: str
    nominal: float
    log_std: float


@dataclass(frozen=True)
class Change:
    """A structural cause that natural frequencies can feel, with one of its labels and its parameters' priors."""

    cause: str
    summary: str
    label: Mapping[str, str]
    parameters: tuple[Parameter, ...]

    @property
    def key(self) -> str:
        """Name and label."""
        return " ".join([self.cause, *self.label.values()])


Active = Sequence[tuple[Change, Mapping[str, float]]]
"""Changes that act, with the values of their parameters."""


@dataclass(frozen=True)
class Matrices:
    """Mass and stiffness (n, n): K = K0 + sum of modulus times `terms`, each by the kind of its modulus."""

    M: Matrix
    K0: Matrix
    terms: Mapping[str, Matrix]
    transverse: NDArray[np.bool_]

    def stiffness(self, moduli: Mapping[str, float]) -> Matrix:
        """K (n, n) with these moduli, each by its term."""
        return self.K0 + sum(moduli[term] * matrix for term, matrix in self.terms.items())

    def modes(self, moduli: Mapping[str, float], number: NDArray[np.int64]) -> tuple[Matrix, Matrix]:
        """Natural frequencies (m,) in rad/s and shapes (n, m) of bending modes by their numbers, from 1.

        Raises
        ------
        ValueError
            If the structure has too few of them.
        """
        modes = bending_modes(self.M, self.stiffness(moduli), self.transverse, least=int(number.max()))
        return modes.omega[number - 1], modes.Phi[:, number - 1]


class FrequencyModel(Protocol):
    """A structure whose natural frequencies depend on moduli, and on changes that a diagnosis may name."""

    @property
    def base(self) -> tuple[BaseParameter, ...]:
        """What is always identified."""

    @property
    def conditions(self) -> Mapping[str, Mapping[str, str]]:
        """Of each condition, such as a preload: the base parameter that multiplies each term of the stiffness."""

    @property
    def changes(self) -> tuple[Change, ...]:
        """What may be named."""

    @property
    def silent(self) -> tuple[str, ...]:
        """Causes on the list that natural frequencies cannot show."""

    def matrices(self, active: Active) -> Matrices:
        """The structure with changes acting."""

    def extended(
        self, moduli: Mapping[str, Estimate], active: Active, std: Sequence[Mapping[str, float]]
    ) -> Rig | BeamRig:
        """The rig with identified moduli, and the changes as effects."""
