"""Each law's force along a path by its own formula, in plain numpy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.joint import (
    Cubic,
    Law,
    Linear,
    ParallelJenkins,
    PiecewiseLinearContact,
    Polynomial,
    QuadraticDrag,
    Saturating,
)
from twin.joint.polynomial import loss_ratio, storage_ratio

__all__ = ["law_path"]

Series = NDArray[np.float64]


def law_path(law: Law, e: Series) -> Series:
    """Force along the samples of a path that starts at rest at e = 0."""
    match law:
        case Linear(k):
            return k * e
        case Cubic(k):
            return k * e**3
        case QuadraticDrag(c):
            return c * e * np.abs(e)
        case Saturating(k, e0, spring):
            return k * e / np.sqrt(1.0 + (e / e0) ** 2) + spring * e
        case PiecewiseLinearContact(stiffness, gap, side):
            hinges = zip(stiffness, gap, side, strict=True)
            return np.sum([k * s * np.maximum(s * (e - g), 0.0) for k, g, s in hinges], axis=0)
        case ParallelJenkins(stiffness, slip_force):
            return _sliding(e, np.array(stiffness), np.array(slip_force))
        case Polynomial(storage, loss, stick):
            stored = sum(c / storage_ratio(k) * np.abs(e) ** k * e for k, c in enumerate(storage))
            lost = sum(c / loss_ratio(k) * np.abs(e) ** (k + 1) for k, c in enumerate(loss))
            return stored + lost * _direction(e, stick)
    return law.force_history(e)


def _sliding(e: Series, stiffness: Series, slip_force: Series) -> Series:
    force, total = np.zeros(len(stiffness)), np.empty_like(e)
    for i, step in enumerate(np.diff(e, prepend=0.0)):
        force = np.clip(force + stiffness * step, -slip_force, slip_force)
        total[i] = force.sum()
    return total


def _direction(e: Series, travel: float) -> Series:
    """sign(de/dt), reversed over a travel."""
    steps = np.diff(e, prepend=0.0)
    if travel == 0.0:
        return np.sign(steps)
    direction, s = np.empty_like(e), 0.0
    for i, step in enumerate(steps):
        s = min(max(s + step / travel, -1.0), 1.0)
        direction[i] = s
    return direction
