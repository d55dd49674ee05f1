"""What files hold of frequency responses, in SI units, whatever format they have."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from recordings.errors import InputError

SIZE_LIMIT_BYTES = 512 << 20
"""Of a file of responses."""
LEAST_LINES = 16
"""Of a response in which anything can be told."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class End:
    """Where a response was measured, or where the force acted, as far as the file says."""

    name: str = ""
    """Of the channel; empty if the file has none."""
    node: int = 0
    """Of the lab's geometry; 0 if there is none."""
    direction: str = ""
    """``+x`` ... ``-z``; empty if the file does not say."""

    @property
    def told(self) -> str:
        """In words, for messages."""
        node = f"node {self.node}{self.direction and ' ' + self.direction}" if self.node else self.direction
        return f"{self.name!r:.40} ({node})" if self.name and node else f"{self.name!r:.40}" if self.name else node


@dataclass(frozen=True, kw_only=True)
class FoundResponse:
    """One response per force."""

    place: str
    """Where in its file it stands, for messages."""
    response: End
    reference: End
    quantity: str
    """Of the response: acceleration, velocity, displacement; empty if the file does not say."""
    frequency_Hz: NDArray[np.float64]
    """Rising, above zero, (f,)."""
    H: NDArray[np.complex128]
    """SI unit of the quantity per newton, complex (f,)."""
    coherence: NDArray[np.float64] | None = None
    """Array (f,)."""
    averages: int = 0
    """How many stretches were averaged; 0 if the file does not say."""


@dataclass(frozen=True, kw_only=True)
class FoundModes:
    """One mode of a modal table: frequency, damping ratio (0 if not given), shape (n, 3) over node numbers (n,)."""

    frequency_Hz: float
    damping_ratio: float
    nodes: NDArray[np.int64]
    shape: NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True)
class Responses:
    """A file's frequency responses, its modal table and its geometry."""

    path: str
    responses: tuple[FoundResponse, ...]
    modes: tuple[FoundModes, ...] = ()
    nodes: Mapping[int, Vector] = field(default_factory=dict)
    """Coordinates in metres by node number; empty where the file has no geometry."""


def checked(
    path: object,
    place: str,
    *,
    frequency_Hz: Sequence[float] | NDArray[np.float64],
    H: NDArray[np.complexfloating | np.floating],
    coherence: NDArray[np.float64] | None,
) -> tuple[NDArray[np.float64], NDArray[np.complex128], NDArray[np.float64] | None]:
    """The lines above 0 Hz in rising order.

    Raises
    ------
    InputError
        If they are too few, not rising, not finite, or the coherence is none.
    """
    x, y = np.asarray(frequency_Hz, float), np.asarray(H, complex)
    if x.shape != y.shape or x.ndim != 1:
        raise InputError(str(path), place, f"has {y.size} values for {x.size} frequencies")
    if coherence is not None and coherence.shape != x.shape:
        raise InputError(str(path), place, f"has a coherence of {coherence.size} values for {x.size} frequencies")
    kept = (x > 0) & (y != 0)
    x, y, g = x[kept], y[kept], None if coherence is None else np.asarray(coherence, float)[kept]
    if len(x) < LEAST_LINES:
        raise InputError(str(path), place, f"has {len(x)} lines above 0 Hz", f"at least {LEAST_LINES} are needed")
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise InputError(str(path), place, "holds values that are no numbers", "export it again")
    if np.any(np.diff(x) <= 0):
        raise InputError(str(path), place, "frequencies do not rise", "sort it by frequency, each once")
    if g is not None and not np.all((g >= 0) & (g <= 1 + 1e-6)):
        raise InputError(str(path), place, "a coherence lies outside 0 to 1", "export the coherence itself")
    return x, y, None if g is None else np.minimum(g, 1.0)
