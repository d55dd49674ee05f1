"""Kernels of :mod:`twin.identify.slipping`."""

from functools import cache
from math import acos, sin, sqrt

import numpy as np

from twin.arrays import Array
from twin.identify.jenkins import RIPPLES
from twin.joint.calling import address, call_kernel
from twin.joint.compilation import COMPILED, INNER
from twin.joint.elimination import eliminate

PASSES = 2
"""Of the common spring's motion and the ripples beyond it, which change each other little."""


@INNER
def _bracket(a: float, c: float, rippled: float, softer: float) -> tuple[float, float]:
    """Amplitudes beyond the common spring that enclose the one whose slip is a: with slipping, and with none."""
    return max(a - c * rippled, 0.0), (a + c * rippled) / (1.0 - c * softer)


@INNER
def _first(y: float, k: float, slip_force: float) -> complex:
    """The fundamental of :func:`~twin.identify.jenkins.jenkins_harmonics`."""
    top = min(slip_force, k * y)
    cosine = min(max(1 - 2 * top / max(k * y, 1e-300), -1.0), 1.0)
    t, sine = acos(cosine), sqrt(max(1.0 - cosine * cosine, 0.0))
    return complex(k * y * (t - cosine * sine) / np.pi, k * y * sine * sine / np.pi)


@INNER
def _beyond(a: float, c: float, rippled: complex, k: float, slip_force: float) -> float:
    """Amplitude beyond the common spring at which the slip's is a, by false position (Illinois)."""
    low, high = _bracket(a, c, abs(rippled), k)
    if c == 0.0:
        return low
    below = abs(low - c * (_first(low, k, slip_force) + rippled)) - a
    above = abs(high - c * (_first(high, k, slip_force) + rippled)) - a
    side = 0
    for _ in range(100):
        if above - below == 0.0 or high - low <= 1e-15 * high:
            break
        y = (low * above - high * below) / (above - below)
        miss = abs(y - c * (_first(y, k, slip_force) + rippled)) - a
        if abs(miss) <= 1e-14 * a:
            return y
        if miss > 0.0:
            high, above = y, miss
            below *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            low, below = y, miss
            above *= 0.5 if side == -1 else 1.0
            side = -1
    return 0.5 * (low + high)


@COMPILED
def in_series(a: Array, k: float, slip_force: float, c: Array, compliance: Array, out: Array, slide_at: int) -> None:
    """Fill in the harmonics (s, 4)."""
    room = room_to_slide()
    for s in range(len(a)):
        call_kernel(slide_at, None, (a[s], k, slip_force, c[s], compliance[s], out[s], room))


@cache
def slide_address() -> int:
    """Where :func:`slide` is, for the kernels that call it there."""
    c = np.zeros(len(RIPPLES), complex)
    return address(slide, 0.0, 0.0, 0.0, 0.0, c, c, room_to_slide.py_func())


@INNER
def room_to_slide() -> tuple[Array, ...]:
    """What :func:`slide` works in."""
    count = len(RIPPLES)
    return (
        np.empty((1 + count, 2 * count), np.complex128), np.empty(count, np.complex128),
        np.empty(3 * RIPPLES[-1] + 1, np.complex128), np.empty((2 * count, 2 * count)), np.empty(2 * count),
    )  # fmt: skip


@INNER
def slide(
    a: float, k: float, slip_force: float, c: float, compliance: Array, out: Array, room: tuple[Array, ...]
) -> None:
    """What :func:`slipping_harmonics` returns at one amplitude, in `out` (4,); c as from :func:`common_spring`."""
    both, own, integrals, J, X = room
    softer, rippled, y = k / (1.0 + k * c), 0j, a
    for i in range(len(RIPPLES)):
        own[i] = compliance[i] - c
    for _ in range(PASSES):
        y = _beyond(a, c, rippled, softer, slip_force)
        _by_ripples(y, softer, slip_force, out, both, integrals)
        without = out[0]
        _balance(out, both, own, J, X)
        rippled = out[0] - without
    slip = y - c * out[0]
    turn = slip.conjugate() / max(abs(slip), 1e-300)
    out[0] *= turn
    for i in range(len(RIPPLES)):
        out[1 + i] *= turn ** RIPPLES[i]


@INNER
def _by_ripples(a: float, k: float, slip_force: float, alone: Array, both: Array, integrals: Array) -> None:
    """Fill in the harmonics (4,) without ripples, and what the ripples' real and imaginary parts (4, 6) add."""
    highest = RIPPLES[-1]
    top = min(slip_force, k * a)
    cosine = min(max(1 - 2 * top / max(k * a, 1e-300), -1.0), 1.0)
    t = acos(cosine)
    turn = complex(cosine, -sin(t))
    power = 1.0 + 0j
    integrals[highest] = t
    for n in range(1, 2 * highest + 1):
        power = power * turn
        value = 1j * (power - 1) / n
        integrals[highest + n] = value
        if n <= highest:
            integrals[highest - n] = value.conjugate()
    for i in range(1 + len(RIPPLES)):
        h = RIPPLES[i - 1] if i else 1
        start = integrals[highest + h]
        # exp(-j h pi) = -1, for all of these are odd.
        whole = -2j / h
        sticking = (top - k * a) * start + k * a / 2 * (integrals[highest + h - 1] + integrals[highest + h + 1])
        alone[i] = 2 / np.pi * (sticking - top * (whole - start))
        for j in range(len(RIPPLES)):
            ripple = k / np.pi * (integrals[highest + h - RIPPLES[j]] - start)
            conjugate = k / np.pi * (integrals[highest + h + RIPPLES[j]] - start)
            both[i, j] = ripple + conjugate
            both[i, j + len(RIPPLES)] = 1j * (ripple - conjugate)


@INNER
def _balance(alone: Array, both: Array, compliance: Array, J: Array, X: Array) -> None:
    """Add to `alone` what the ripples X = -C (F + A X + B X*) that the harmonics make do to them.

    J (6, 6) and X (6,) are room for that, in real and imaginary parts.
    """
    count = len(RIPPLES)
    for i in range(count):
        C = compliance[i]
        given = -C * alone[1 + i]
        X[i], X[count + i] = given.real, given.imag
        for j in range(2 * count):
            moved = C * both[1 + i, j]
            J[i, j], J[count + i, j] = moved.real, moved.imag
        J[i, i] += 1.0
        J[count + i, count + i] += 1.0
    eliminate(J, X)
    for i in range(1 + count):
        for j in range(2 * count):
            alone[i] += both[i, j] * X[j]
