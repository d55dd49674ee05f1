"""A Jenkins element under a given motion, and which ripples of its slip are balanced where it is given in part."""

from typing import Any

import numpy as np

from twin.arrays import Array

RIPPLES = (3, 5, 7)
"""Harmonics of the slip that are balanced.  Without the third a slip force comes out wrong by several per cent."""
LEAST_SLIP = 1e-15
"""Amplitude below which an equivalent stiffness is that at this one, m."""


def jenkins_harmonics(amplitude: Any, k: float, slip_force: float, count: int) -> Array:
    """Harmonics 1 ... count (s, count) of a Jenkins element's steady force for motion a cos t, in closed form.

    On the way down from a reversal at +a the force falls from the slip force F (or k a while it never slips) with slope
    k until, at cos t_s = 1 - 2 F / (k a), it slips the other way; the way up mirrors it, so that even harmonics vanish.
    Quadrature would not do: its error jumps as the slip's beginning passes a sample, and the fit's derivatives with it.
    """
    a = np.asarray(amplitude, float)[:, None]
    top = np.minimum(slip_force, k * a)
    t = np.arccos(np.clip(1 - 2 * top / np.maximum(k * a, 1e-300), -1.0, 1.0))
    h = np.arange(1, count + 1)
    sticking = (top - k * a) * _turned(h, t) + k * a / 2 * (_turned(h - 1, t) + _turned(h + 1, t))
    slipping = -top * (_turned(h, np.pi) - _turned(h, t))
    return np.where(h % 2, 2 / np.pi * (sticking + slipping), 0.0)


def common_spring(compliance: Array) -> Array:
    """Spring (s,) that compliances (s, 3) have in common: their middle, since one may lie near a resonance."""
    return np.maximum(np.sort(compliance.real, axis=1)[:, len(RIPPLES) // 2], 0.0)


def _turned(n: Any, t: Any) -> Array:
    """Integral of exp(-j n t) from zero to t."""
    return np.asarray(np.where(n == 0, t + 0j, 1j * (np.exp(-1j * n * t) - 1) / np.where(n, n, 1)))
