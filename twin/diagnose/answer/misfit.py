"""How far the model is from the data, and the four verdicts on that."""

from dataclasses import dataclass
from typing import Any, Literal

Verdict = Literal["explained", "none", "ambiguous", "unknown"]


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """How far the base family is from the data, and where: shares of chi2 by run, channel and harmonic."""

    chi2_per_dof: float
    after: float
    threshold: float
    where: tuple[dict[str, Any], ...]
