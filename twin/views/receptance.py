"""Receptance in the unit of the pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["POWERS", "receptance_mm_per_N"]

Array = NDArray[Any]

POWERS = {"displacement": 0, "velocity": 1, "acceleration": 2}
"""Quantities of response channels, with the power of the angular frequency that a displacement is multiplied by."""


def receptance_mm_per_N(response: Array, quantity: str, frequency_Hz: Array) -> Array:
    """Magnitude of displacement per force from a response per force, (f,) each."""
    return np.asarray(1e3 * np.abs(response) / (2 * np.pi * np.asarray(frequency_Hz)) ** POWERS[quantity])
