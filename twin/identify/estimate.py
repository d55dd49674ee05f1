"""A number with its uncertainty."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Estimate:
    """A value with its standard deviation."""

    value: float
    std: float
