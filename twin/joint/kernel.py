"""The laws inside compiled kernels: force and tangent of one element, and its memory after a step.

Written once in the subset that numba compiles; the plain Python functions are what the numpy twins of the kernels use
(``evaluate.py_func``), and the tests hold them to each law's own formula.
"""

from math import sqrt
from typing import Any

import numpy as np
from numba import njit

from twin.arrays import Array
from twin.joint.calling import call_at
from twin.joint.kinds import (
    CUBIC,
    FUNCTIONS,
    HINGES,
    LINEAR,
    POLYNOMIAL,
    QUADRATIC_DRAG,
    RUNNING_LOSS,
    SATURATING,
    SLIDERS,
    TABLE,
)

FASTMATH = {"reassoc", "contract", "arcp", "nsz"}
"""Rounding may be reordered, but NaN and infinity keep their meaning."""

_OPTIONS: dict[str, Any] = {"cache": True, "fastmath": FASTMATH, "error_model": "numpy", "no_cfunc_wrapper": True}
_WITHOUT_ENTRY: dict[str, Any] = {"no_cpython_wrapper": True}
COMPILED = njit(**_OPTIONS)
"""How all kernels of the bench are compiled."""
INNER = njit(**_OPTIONS, **_WITHOUT_ENTRY)
"""How those are compiled that kernels alone call: an entry for Python takes longer to compile than many of them."""
UNCOUNTED: dict[str, Any] = {"_nrt": False}
"""numba's switch for functions that make no arrays and keep none; it is not among its documented ones."""
BORROWING = njit(**_OPTIONS, forceinline=True, **UNCOUNTED)
"""How the small functions called at every step are compiled.

They take part in no reference counting: a branching function would count its arguments up and down, atomically, at
every call, which takes longer than most laws.
"""
SLOWEST_RAD_PER_S = 6.0
"""Lower limit of the running frequency, so that a static offset alone does not become an endless damper."""


@BORROWING
def evaluate(kind: int, p: Array, state: Array, row: int, e: float) -> tuple[float, float]:
    """Restoring force and its tangent at `e` of the element in one row of parameters `p` and memory `state`.

    Rows are indexed here and not passed as views, and the laws with loops are a function of their own, because a call
    with many registers to save costs more than the laws that most rigs have.
    """
    if kind == SATURATING:
        q = 1.0 / (1.0 + (e / p[row, 1]) * (e / p[row, 1]))
        root = sqrt(q)
        return (p[row, 0] * root + p[row, 2]) * e, p[row, 0] * q * root + p[row, 2]
    if kind == RUNNING_LOSS:
        return state[row, 2] * e, state[row, 2]
    if kind == LINEAR:
        return p[row, 0] * e, p[row, 0]
    if kind == CUBIC:
        return p[row, 0] * e * e * e, 3.0 * p[row, 0] * e * e
    if kind == TABLE:
        n = int(p[row, 0])
        position = (e + p[row, 1]) / (2.0 * p[row, 1]) * (n - 1)
        i = min(max(int(position), 0), n - 2)
        slope = p[row, 3 + i] - p[row, 2 + i]
        return p[row, 2 + i] + slope * (position - i), slope * (n - 1) / (2.0 * p[row, 1])
    return _with_loops(kind, p, state, row, e)


@BORROWING
def _with_loops(kind: int, p: Array, state: Array, row: int, e: float) -> tuple[float, float]:
    if kind == SLIDERS:
        force, tangent = 0.0, 0.0
        for i in range(int(p[row, 0])):
            k, limit = p[row, 1 + 2 * i], p[row, 2 + 2 * i]
            trial = state[row, 1 + i] + k * (e - state[row, 0])
            if trial > limit:
                force += limit
            elif trial < -limit:
                force -= limit
            else:
                force += trial
                tangent += k
        return force, tangent
    if kind == HINGES:
        force, tangent = 0.0, 0.0
        for i in range(int(p[row, 0])):
            k, gap, side = p[row, 1 + 3 * i], p[row, 2 + 3 * i], p[row, 3 + 3 * i]
            if side * (e - gap) > 0.0:
                force += k * (e - gap)
                tangent += k
        return force, tangent
    if kind == POLYNOMIAL:
        return polynomial(p, state, row, e)
    if kind == QUADRATIC_DRAG:
        return p[row, 0] * e * abs(e), 2.0 * p[row, 0] * abs(e)
    if kind == FUNCTIONS:
        return call_at(int(p[row, 0]), p, state, row, e)
    return 0.0, 0.0


@BORROWING
def polynomial(p: Array, state: Array, row: int, e: float) -> tuple[float, float]:
    """The same of a polynomial law, which has loops of its own."""
    size = abs(e)
    sign = 1.0 if e >= 0.0 else -1.0
    force, tangent, power = 0.0, 0.0, 1.0
    storage = int(p[row, 1])
    for k in range(storage):
        force += p[row, 2 + k] * power * e
        tangent += p[row, 2 + k] * (k + 1) * power
        power *= size
    losses = int(p[row, 2 + storage])
    if losses > 0:
        step = e - state[row, 0]
        travel = p[row, 0] if p[row, 0] > 0.0 else 1e-300
        trial = state[row, 1] + step / travel
        s = min(max(trial, -1.0), 1.0)
        ds = 1.0 / travel if abs(trial) < 1.0 else 0.0
        power = 1.0
        for k in range(losses):
            c = p[row, 3 + storage + k]
            tangent += c * ((k + 1) * power * sign * s + power * size * ds)
            power *= size
            force += c * power * s
    return force, tangent


@BORROWING
def remember(kind: int, p: Array, state: Array, row: int, e: float, displacement: float, step_s: float) -> None:
    """Move one row's memory to the end of a step that ended at `e`; `displacement` goes with a velocity coordinate."""
    if kind == SLIDERS:
        for i in range(int(p[row, 0])):
            k, limit = p[row, 1 + 2 * i], p[row, 2 + 2 * i]
            state[row, 1 + i] = min(max(state[row, 1 + i] + k * (e - state[row, 0]), -limit), limit)
        state[row, 0] = e
    elif kind == POLYNOMIAL:
        step = e - state[row, 0]
        travel = p[row, 0] if p[row, 0] > 0.0 else 1e-300
        state[row, 1] = min(max(state[row, 1] + step / travel, -1.0), 1.0)
        state[row, 0] = e
    elif kind == RUNNING_LOSS:
        blend = step_s / (p[row, 0] + 0.5 * step_s)
        state[row, 3] += blend * (displacement * displacement - state[row, 3])
        state[row, 4] += blend * (e * e - state[row, 4])
        state[row, 0] += blend * (state[row, 3] - state[row, 0])
        state[row, 1] += blend * (state[row, 4] - state[row, 1])
        coefficient = 0.0
        if state[row, 0] > 1e-40 and state[row, 1] > 0.0:
            n = int(p[row, 1])
            position = min(sqrt(2.0 * state[row, 0]) / p[row, 2] * (n - 1), n - 1.0)
            i = min(int(position), n - 2)
            eta = p[row, 3 + i] + (p[row, 4 + i] - p[row, 3 + i]) * (position - i)
            coefficient = eta * min(sqrt(state[row, 0] / state[row, 1]), 1.0 / SLOWEST_RAD_PER_S)
        state[row, 2] += blend * (coefficient - state[row, 2])
    elif kind == FUNCTIONS and p[row, 1] != 0.0:
        call_at(int(p[row, 1]), p, state, row, e)


@COMPILED
def along(kind: int, p: Array, state: Array, e: Array) -> Array:
    """Force along the samples of a path of the first row's element; of laws that ask for no time."""
    force = np.empty_like(e)
    for i in range(e.shape[0]):
        force[i] = evaluate(kind, p, state, 0, e[i])[0]
        remember(kind, p, state, 0, e[i], 0.0, 0.0)
    return force
