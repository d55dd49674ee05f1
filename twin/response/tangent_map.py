"""The bench's step linearised along a periodic path, and multiplied up over the period.

A change of the poles' states w and of the laws' memories z moves the local coordinates by

    (1 - H T) dy = C dw + H g dz,

T and g being slopes of the laws' forces by coordinate and memory, and H the step's flexibility; the forces then move
the poles as in :mod:`twin.bench.marching`.  Slopes by memories, and those of the memories themselves, are differences
of one law at one step: they cost as little as the law does, whatever it is.
"""

from typing import NamedTuple

import numpy as np

from twin.arrays import Array
from twin.bench.limits import LIMITS
from twin.bench.marching import Elements, Step, couple_address
from twin.joint.calling import call_kernel
from twin.joint.elimination import eliminate_columns
from twin.joint.kernel import BORROWING, COMPILED, INNER, evaluate, remember


class _Slopes(NamedTuple):
    """Of each law's force by each memory, (laws, depth), and of each memory afterwards, (laws, depth, depth + 2).

    These are by each memory before, by the coordinate and by what goes with a velocity.  Beside them, room for what one
    law remembers before a step and after, (depth,).
    """

    force: Array
    memory: Array
    before: Array
    after: Array


def tangent_map(step: Step, elements: Elements, path: Array, size: Array, beside: Array, moves: Array) -> Array:
    """Derivatives of the states after a period by those before it, (moves, moves).

    Parameters
    ----------
    elements
        Their memories are those at the start of the period, and are moved on in place.
    path : ndarray, (locals + auxiliaries, steps)
        Of the local coordinates and auxiliary rows, at the end of each step.
    size : ndarray, (locals + auxiliaries,)
        Change of each for differences.
    beside : ndarray, (elements, depth)
        Change of each memory; nothing where it never moves.
    moves : ndarray of int
        Which states, of the poles' (m,) and the memories after them, are looked at; the others do not move.
    """
    start = np.zeros((len(step.decay) + elements.state.size, len(moves) + -len(moves) % LIMITS.marching_lanes))
    start[moves, np.arange(len(moves))] = 1.0
    moving, flexibility = np.ascontiguousarray(step.Gamma[1:].T), np.ascontiguousarray(step.D[:, 1:])
    _lead(step, elements, path, size, beside, moving, flexibility, couple_address(elements), start)
    return np.asarray(start[moves, : len(moves)])


@COMPILED
def _lead(
    step: Step, elements: Elements, path: Array, size: Array, beside: Array, Gamma: Array, H: Array, couple_at: int,
    state: Array,
) -> None:  # fmt: skip
    """Lead changes of the `state`, in columns, through the period.

    Of the step's `Gamma` and `D`, the forces' parts are given as :func:`_add_rows` takes them: (m, locals), (rows,
    locals).
    """
    step_s, decay, _, C, _, locals_, auxiliaries = step
    kind, coordinate, auxiliary, scale, parameters, memory = elements
    m, (laws, depth) = decay.shape[0], memory.shape
    half, columns, rows = m // 2, state.shape[1], locals_ + auxiliaries
    free, dy, force = np.zeros((rows, columns)), np.zeros((locals_, columns)), np.zeros((locals_, columns))
    A, T = np.zeros((locals_, locals_)), np.zeros((locals_, locals_))
    last, inverse = np.zeros((locals_, locals_)), np.zeros((locals_, locals_))
    for a in range(locals_):
        inverse[a, a] = 1.0
    outputs, u = np.zeros(rows), np.zeros(1 + locals_)
    slopes = _Slopes(np.zeros((laws, depth)), np.zeros((laws, depth, depth + 2)), np.zeros(depth), np.zeros(depth))
    moved, coupled = np.zeros((depth, columns)), couple_at != 0
    for t in range(path.shape[1]):
        for b in range(rows):
            outputs[b] = path[b, t]
        for a in range(locals_):
            _clear(T, a)
        if coupled:
            call_kernel(couple_at, None, (kind, coordinate, parameters, outputs[:locals_], u, T))
        for e in range(laws):
            a = coordinate[e]
            T[a, a] += scale[e] * _slopes(step_s, elements, e, outputs, size, beside[e], slopes)
        for b in range(rows):
            _clear(free, b)
            _add_rows(free, b, C, state, m)
        for a in range(locals_):
            _clear(force, a)
        for e in range(laws):
            for i in range(depth):
                _add(force, coordinate[e], scale[e] * slopes.force[e, i], state, m + e * depth + i)
        _invert(H, T, last, A, inverse)
        for a in range(locals_):
            _add_rows(free, a, H, force, locals_)
        for a in range(locals_):
            _clear(dy, a)
            _add_rows(dy, a, inverse, free, locals_)
        for a in range(locals_):
            _add_rows(force, a, T, dy, locals_)
        for b in range(locals_, rows):
            _add_rows(free, b, H, force, locals_)
        for e in range(laws):
            first, b = m + e * depth, auxiliary[e]
            for i in range(depth):
                _clear(moved, i)
                _add(moved, i, slopes.memory[e, i, depth], dy, coordinate[e])
                if b >= 0:
                    _add(moved, i, slopes.memory[e, i, depth + 1], free, b)
                for j in range(depth):
                    _add(moved, i, slopes.memory[e, i, j], state, first + j)
            for i in range(depth):
                _clear(state, first + i)
                _add(state, first + i, 1.0, moved, i)
        for k in range(half):
            for c in range(columns):
                old = state[k, c]
                state[k, c] = decay[k] * old - decay[half + k] * state[half + k, c]
                state[half + k, c] = decay[k] * state[half + k, c] + decay[half + k] * old
        for k in range(m):
            _add_rows(state, k, Gamma, force, locals_)


@INNER
def _invert(H: Array, T: Array, last: Array, A: Array, inverse: Array) -> None:
    """Fill in the inverse of 1 - H T, unless the slopes T are the last ones: many laws' are constant for a while."""
    n, same = len(T), True
    for a in range(n):
        for b in range(n):
            same = same and T[a, b] == last[a, b]
            last[a, b] = T[a, b]
    if same:
        return
    for a in range(n):
        for b in range(n):
            A[a, b] = inverse[a, b] = 1.0 if a == b else 0.0
            for c in range(n):
                A[a, b] -= H[a, c] * T[c, b]
    eliminate_columns(A, inverse)


@BORROWING
def _clear(into: Array, row: int) -> None:
    """Set a row to zero."""
    for c in range(into.shape[1]):
        into[row, c] = 0.0


@BORROWING
def _add(into: Array, to: int, factor: float, what: Array, row: int) -> None:
    """Add a multiple of one row to another."""
    if factor != 0.0:
        for c in range(into.shape[1]):
            into[to, c] += factor * what[row, c]


@BORROWING
def _add_rows(into: Array, to: int, factors: Array, what: Array, count: int) -> None:
    """Add a product of one's row of factors and another's first rows, four at a time: fewer ways to memory and back."""
    whole = count - count % 4
    for k in range(0, whole, 4):
        f, g, h, i = factors[to, k], factors[to, k + 1], factors[to, k + 2], factors[to, k + 3]
        if f != 0.0 or g != 0.0 or h != 0.0 or i != 0.0:
            for c in range(into.shape[1]):
                into[to, c] += f * what[k, c] + g * what[k + 1, c] + h * what[k + 2, c] + i * what[k + 3, c]
    for k in range(whole, count):
        _add(into, to, factors[to, k], what, k)


@INNER
def _slopes(
    step_s: float, elements: Elements, e: int, outputs: Array, size: Array, beside: Array, slopes: _Slopes
) -> float:
    """Slope of a law's force, after which its memory has moved on; its rows of `slopes` are filled in."""
    kind, coordinate, auxiliary, _, parameters, memory = elements
    depth, a, b = memory.shape[1], coordinate[e], auxiliary[e]
    y, x = outputs[a], outputs[b] if b >= 0 else 0.0
    before, after = slopes.before, slopes.after
    for i in range(depth):
        before[i] = memory[e, i]
    force, slope = 0.0, 0.0
    for j in range(-1, depth + 2):  # as it is, and beside each memory, the coordinate and what goes with a velocity
        change = beside[j] if 0 <= j < depth else 0.0
        change_y = size[a] if j == depth else 0.0
        change_x = size[b] if j > depth and b >= 0 else 0.0
        whole = change + change_y + change_x
        for i in range(depth):
            memory[e, i] = before[i] + (change if i == j else 0.0)
            if j >= 0:
                slopes.memory[e, i, j] = 0.0
        if j >= 0 and whole == 0.0:
            continue
        if j < depth:
            value, tangent = evaluate(kind[e], parameters, memory, e, y)
            if j >= 0:
                slopes.force[e, j] = (value - force) / whole
            else:
                force, slope = value, tangent
        remember(kind[e], parameters, memory, e, y + change_y, x + change_x, step_s)
        for i in range(depth):
            if j >= 0:
                slopes.memory[e, i, j] = (memory[e, i] - after[i]) / whole
            else:
                after[i] = memory[e, i]
    for i in range(depth):
        memory[e, i] = after[i]
    return slope
