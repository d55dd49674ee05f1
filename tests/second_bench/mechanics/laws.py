"""Forces of local elements over their motion, in time: what is stored in a `Kind`'s parameters, and its memory.

None of the memories knows time: a loop driven slowly loses what it loses driven fast.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numba import njit

PARAMETERS = 7
"""Columns that hold the parameters of an element."""
FORGETTING = 0.02
"""Of the reach of a point's slip, over the way it slips: what it once reached is forgotten in some dozen cycles."""


class Kind(IntEnum):
    """An element's law; its parameters in order.

    ``SOFTENING``: stiffness, share that saturates, opening, early part of the share, gap, factor beyond the gap, and
    the stiffness that is in the linear structure already.

    ``RIDING_FRICTION``: stiffness, friction, slip, travel, and the stiffness that is in the linear structure already.
    The friction is that of a contact that rode up as far as it lately slipped.

    ``SLIDER``: stiffness, slip force.  ``CUBIC``: N/m3.  ``STOP``: stiffness, gap.  ``DASHPOT``: Ns/m.  ``DRAG``:
    Ns2/m2.  ``MAGNET``: stiffness that pushes away from the middle, reach.  ``SWINGING``: mean stiffness, part of it
    that swings, Hz.
    """

    SOFTENING = 0
    RIDING_FRICTION = 1
    SLIDER = 2
    CUBIC = 3
    STOP = 4
    DASHPOT = 5
    DRAG = 6
    MAGNET = 7
    SWINGING = 8

    @property
    def of_velocity(self) -> bool:
        """Whether it resists velocity, not deflection."""
        return self in (Kind.DASHPOT, Kind.DRAG)


@njit(cache=True, inline="always")
def saturating(d, k, share, opening, early):
    """Force and tangent of a spring that loses a share of its stiffness beyond an opening.

    Part of the share, `early`, goes as 1 / (1 + x), the rest as 1 / sqrt(1 + x^2), with x = d / opening.
    """
    x = abs(d / opening)
    one, root = 1.0 / (1.0 + x), 1.0 / np.sqrt(1.0 + x * x)
    kept = 1.0 - share + share * (early * one + (1.0 - early) * root)
    tangent = 1.0 - share + share * (early * one**2 + (1.0 - early) * root**3)
    return k * d * kept, k * tangent


@njit(cache=True)
def element_force(kind, p, y, y_old, memory, reach, time_s, scale):
    """Force, tangent and both memories of an element that moves from `y_old` to `y`; `scale` is on its modulus."""
    if kind == 0:
        k = p[0] * scale
        if y > p[4]:
            at_gap, _ = saturating(p[4], k, p[1], p[2], p[3])
            force, tangent = saturating(y, k, p[1], p[2], p[3])
            force, tangent = at_gap + p[5] * (force - at_gap), p[5] * tangent
        else:
            force, tangent = saturating(y, k, p[1], p[2], p[3])
        return force - p[6] * y, tangent - p[6], memory, reach
    if kind == 1:
        turn = 1.0 if y >= y_old else -1.0
        travelled = abs(y - y_old)
        grip = turn - (turn - memory) * np.exp(-travelled / p[3])
        reach -= FORGETTING * travelled
        reach_tangent = -FORGETTING * turn
        if abs(y) > reach:
            reach, reach_tangent = abs(y), 1.0 if y > 0 else -1.0
        normal = p[1] * reach * reach / (p[2] + reach) if reach > 0 else 0.0
        normal_tangent = p[1] * reach * (reach + 2.0 * p[2]) / (p[2] + reach) ** 2 * reach_tangent
        force = (p[0] - p[4]) * y + normal * grip
        tangent = p[0] - p[4] + normal_tangent * grip + normal * (1.0 - turn * grip) / p[3]
        return force, tangent, grip, reach
    if kind == 2:
        force = memory + p[0] * (y - y_old)
        if abs(force) > p[1]:
            force = p[1] if force > 0 else -p[1]
            return force, 0.0, force, reach
        return force, p[0], force, reach
    if kind == 3:
        return p[0] * y**3, 3.0 * p[0] * y**2, memory, reach
    if kind == 4:
        return (p[0] * (y - p[1]), p[0], memory, reach) if y > p[1] else (0.0, 0.0, memory, reach)
    if kind == 5:
        return p[0] * y, p[0], memory, reach
    if kind == 6:
        return p[0] * y * abs(y), 2.0 * p[0] * abs(y), memory, reach
    if kind == 7:
        away = p[0] * np.exp(-((y / p[1]) ** 2))
        return -away * y, -away * (1.0 - 2.0 * (y / p[1]) ** 2), memory, reach
    k = p[0] + p[1] * np.sin(2.0 * np.pi * p[2] * time_s)
    return k * y, k, memory, reach
