"""From uniform moduli over a sensor's amplitude in the first mode to the law of the layer's points.

The other way of :mod:`twin.structure.mode_law`.  With the amplitude rising, the largest opening of any point is a new
knot of the softening, the largest slip one of the loss, and points that move less use what is known already.
"""

import numpy as np

from twin.arrays import Array
from twin.joint import Curve
from twin.structure.limits import LIMITS
from twin.structure.mode_law import TINY, TOLERANCE, TURNS, ComplexMode, Function, LayerModes, LayerPointLaw

SETTLED, CLOSEST = 1e-7, 1e-9
"""Relative change of the points' motion at which it is found, and the least growth from a knot to the next."""


def layer_law_of_mode(modes: LayerModes, softening: Function, loss: Function, amplitude_m: Array) -> LayerPointLaw:
    """The law of the points that acts on the first mode as uniform moduli of a sensor's amplitude do.

    ValueError if at some X the structure has no mode near its first, or the layer's largest opening or slip does not
    grow with X, or no law of the points gives the mode its frequency and damping.

    Parameters
    ----------
    softening, loss
        g1 and g2 of X (m), N/m2.
    amplitude_m : ndarray, (n,)
        X at which to take them, rising from 0 or above: each is a knot of the result.
    """
    known = _Known(modes.points)
    meant = state = modes.linear(1)
    more = np.zeros(2)
    for X in np.asarray(amplitude_m, float):
        g = np.array([float(softening(X)), float(loss(X))])
        meant = modes.uniform(g[0], g[1], meant)
        own, state, motion = _next_knot(modes, known, float(X), g + more, meant.value, state)
        known.append(motion, own)
        more = own - g
    return known.law()


class _Known:
    """The law as far as it is known: knots and values of the softening, and of the loss."""

    def __init__(self, points: int) -> None:
        self.halves = (slice(0, points), slice(points, 2 * points))
        self.knots: tuple[list[float], list[float]] = ([], [])
        self.values: tuple[list[float], list[float]] = ([], [])

    def with_next(self, motion: Array, own: Array) -> tuple[Array, Array]:
        """Moduli (2 p,) at the points' motion with a next knot at the largest, and their growth with its value."""
        moduli, growth = np.zeros((2, len(motion)), complex)
        for half, knots, values, value, sign in zip(self.halves, self.knots, self.values, own, (-1.0, 1j), strict=True):
            a = motion[half]
            if not knots:
                moduli[half], growth[half] = sign * value, sign
                continue
            # Where the motion has not grown yet, while it is being found, the point that moves most has the new value.
            share = np.where(a == a.max(), 1.0, np.clip((a - knots[-1]) / max(a.max() - knots[-1], TINY), 0.0, 1.0))
            moduli[half] = sign * ((1 - share) * np.interp(a, knots, values) + share * value)
            growth[half] = sign * share
        return moduli, growth

    def append(self, motion: Array, own: Array) -> None:
        """Take a next knot."""
        for half, knots, values, value, name in zip(
            self.halves, self.knots, self.values, own, ("opening", "slip"), strict=True
        ):
            largest = float(motion[half].max())
            if knots and largest <= knots[-1] * (1 + CLOSEST):
                raise ValueError(f"joint.law: the layer's {name} does not grow with the amplitude")
            knots.append(largest)
            values.append(float(value))

    def law(self) -> LayerPointLaw:
        """All of it."""
        curves = (Curve(np.array(k), np.array(v)) for k, v in zip(self.knots, self.values, strict=True))
        return LayerPointLaw(*curves)


def _next_knot(
    modes: LayerModes, known: _Known, X: float, start: Array, meant: complex, near: ComplexMode
) -> tuple[Array, ComplexMode, Array]:
    """Softening and loss (2,) at the next knots that give the first mode an eigenvalue; the mode and its motion."""
    own, mode = start, near
    motion = X * modes.amplitude_per_X(mode, 1)
    linear = modes.by_moduli(modes.linear(1)).real
    for _ in range(TURNS):
        moduli, growth = known.with_next(motion, own)
        mode = modes.local(moduli, mode)
        change = X * modes.amplitude_per_X(mode, 1) - motion
        by_points = modes.by_moduli(mode)
        by = np.array([np.sum((by_points * growth)[half]) for half in known.halves])
        damps = by[1].imag / np.sum((linear * np.abs(growth))[known.halves[1]])
        free = [0] if damps < LIMITS.law_of_mode_saturated else [0, 1]
        miss = np.array([meant.real - mode.value.real, meant.imag - mode.value.imag])[free]
        settled = np.max(np.abs(change)) <= SETTLED * np.max(motion)
        if settled and np.max(np.abs(miss)) < TOLERANCE * abs(meant):
            return own, mode, motion
        both = np.array([by.real, by.imag])[free][:, free]
        own = own.copy()
        own[free] += np.linalg.solve(both, miss)
        motion = motion + LIMITS.law_of_mode_relaxation * change
    raise ValueError(
        f"joint.law: no law of the layer's points gives the first mode its frequency and damping at {X:.3g} m"
    )
