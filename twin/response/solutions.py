"""What harmonic balance finds, and what it says of what it does not find."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.arrays import Array


@dataclass(frozen=True)
class PeriodicSolution:
    """One steady state."""

    frequency_Hz: float
    unknowns: Array
    """Coefficients of the local coordinates, one after the other, (locals (2 H + 1),)."""
    inputs: Array
    """Complex harmonics of the generator's output and of the local restoring forces, (1 + locals, H + 1)."""
    channels: Array
    """Complex harmonics: a channel is the real part of sum channels[k] exp(j k w t), (channels, H + 1)."""
    iterations: int
    """Newton steps it took."""
    jumped: bool = False
    """Whether the branch that leads here, from the steady state before or from rest, turns back on the way."""

    @property
    def amplitude(self) -> float:
        """Peak of the generator's sine: V, or N where the bench has no shaker."""
        return float(-self.inputs[0, 1].imag)


@dataclass(frozen=True)
class Failure:
    """Where no steady state was found, and why."""

    frequency_Hz: float
    """Where it was sought, or where the branch ends."""
    reason: str
    """In words."""
    residual: float
    """Of the last attempt, over the size of the unknowns; nan where there is none."""
    iterations: int
    """Newton steps of the last attempt, or points along the branch."""

    def __str__(self) -> str:
        """One line, with the state it ended in."""
        left = "" if np.isnan(self.residual) else f", residual {self.residual:.1e}"
        return f"{self.frequency_Hz:.5f} Hz: {self.reason} ({self.iterations} steps{left})"


class _Series(Sequence[PeriodicSolution]):
    """Reads like the sequence of its solutions."""

    solutions: tuple[PeriodicSolution, ...]

    def __len__(self) -> int:
        return len(self.solutions)

    def __getitem__(self, index: Any) -> Any:
        return self.solutions[index]


@dataclass(frozen=True)
class SolutionSweep(_Series):
    """Steady states of a stepped sweep, each from the one before; `failures` are the frequencies without one."""

    solutions: tuple[PeriodicSolution, ...]
    failures: tuple[Failure, ...]


@dataclass(frozen=True)
class SolutionBranch(_Series):
    """Steady states along a branch; `failure` tells why it ends early, and is none where it does not."""

    solutions: tuple[PeriodicSolution, ...]
    failure: Failure | None
