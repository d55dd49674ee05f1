"""How far the model is from the data, from those that no fit has seen as well, and the four verdicts on that."""

from dataclasses import dataclass, field
from typing import Any, Literal

Verdict = Literal["explained", "none", "ambiguous", "unknown"]


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """How far the base family is from the data, and where: shares of chi2 by run, channel and harmonic."""

    chi2_per_dof: float
    after: float
    threshold: float
    where: tuple[dict[str, Any], ...]


@dataclass(frozen=True)
class HeldOut:
    """Root-mean-square relative errors of what was held out, and what a perfect model would leave."""

    before: float
    after: float
    noise_floor: float
    in_deviations: tuple[float, float] = field(kw_only=True)
    """The errors before and after, over those of a right model."""
    runs: tuple[str, ...] = field(default=(), kw_only=True)
    sweeps: tuple[str, ...] = field(default=(), kw_only=True)
    """What was held out."""
