"""What a look at the samples themselves can find, before any model."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A fault of the measurement that shows in the samples of one channel or sweep."""

    cause: str
    """Its contract name."""
    summary: str
    """One sentence."""
    values: Mapping[str, float] = field(default_factory=dict)
    std: Mapping[str, float] = field(default_factory=dict)
    """Numbers with their standard deviations."""
    names: Mapping[str, str] = field(default_factory=dict)
    """Channel or sweep."""
    spoilt: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """For each run's path, the positions of `channel`'s samples that must not be used."""
