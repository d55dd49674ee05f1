"""Compiled: the motion of a few ports and the stiffness that goes with it, step by step.

Every step is a small problem of its own: n ports, a complex elimination with n + 1 right sides, a real one for Newton's
step on the logarithms of the amplitudes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from twin.arrays import Array
from twin.identify.slipping import LEAST_SLIP, RIPPLES, room_to_slide, slide
from twin.joint.elimination import COMPILED, eliminate, eliminate_columns

__all__ = ["Ports", "Search", "Sliders", "Turn", "settle", "turn"]


class Ports(NamedTuple):
    """What the n ports have around them at s steps; those of the layers' p points come first.

    Attributes
    ----------
    opening, slip : ndarray, (p, 4 + 2, i)
        Softening and loss at each point as cubics, see :func:`twin.identify.nonlinear.joint_law.packed_laws`.
    weights : ndarray, (s, 2 p)
        Of the layers' points.
    among, driven, reference, to_reference, amplitude
        As in :class:`twin.identify.nonlinear.local_forces.Surroundings`.
    more, more_growth, more_at : ndarray, (s, n), (s, p, p), (s, p)
        As in :class:`twin.identify.nonlinear.balance.Added`.
    """

    opening: Array
    slip: Array
    weights: Array
    among: Array
    driven: Array
    reference: Array
    to_reference: Array
    amplitude: Array
    more: Array
    more_growth: Array
    more_at: Array


class Turn(NamedTuple):
    """Motion and stiffness (s, n) at assumed amplitudes, what these miss, and Newton's step."""

    motion: Array
    stiffness: Array
    gap: Array
    step: Array

    @staticmethod
    def of(shape: tuple[int, ...]) -> Turn:
        """Room for one."""
        return Turn(np.empty(shape, complex), np.empty(shape, complex), np.empty(shape), np.empty(shape))

    @property
    def worst(self) -> Array:
        """Largest of what each step misses, (s,)."""
        return np.asarray(np.max(np.abs(self.gap), axis=1))

    def take(self, other: Turn, rows: Array) -> None:
        """Copy some rows."""
        for own, values in zip(self, other, strict=True):
            own[rows] = values[rows]


class Sliders(NamedTuple):
    """Stiffness and slip force (m, 2) of :class:`twin.identify.slipping.Slider` each, whose ports are the last ones.

    With what they slip into (s, m, 3), and what that has in common (s, m), see
    :func:`twin.identify.slipping.common_spring`.
    """

    values: Array
    compliance: Array
    common: Array


class Search(NamedTuple):
    """Most turns, the largest gap that ends them, the largest change of a logarithm in one, the least share of a step.

    And the relative step of an amplitude for the derivative of a slider's stiffness.
    """

    turns: int
    settled: float
    longest: float
    shortest: float
    difference: float


class _Room(NamedTuple):
    """What :func:`_turn_one` works in."""

    A: Array
    right: Array
    slope: Array
    J: Array
    r: Array


@COMPILED
def turn(ports: Ports, own: Array, growth: Array, log_a: Array, rows: Array, out: Turn) -> None:
    """Fill in `out` at some steps.

    Parameters
    ----------
    own, growth : ndarray, (s, n - 2 p)
        Stiffness of the nonlinear forces at these amplitudes, and its derivative by their logarithms.
    log_a : ndarray, (s, n)
        Logarithms of the assumed amplitudes.
    rows : ndarray of int
        Which steps.
    """
    room = _room(ports.driven.shape[1])
    for s in rows:
        _turn_one(ports, s, own[s], growth[s], log_a[s], out, s, room)


@COMPILED
def settle(ports: Ports, sliders: Sliders, log_a: Array, out: Turn, worst: Array, search: Search) -> None:
    """The same to the end, where all nonlinear forces are sliders: `log_a` is moved to where nothing is missed.

    A step that does not help is shortened, down to the shortest share.

    Parameters
    ----------
    worst : ndarray, (s,)
        Filled with the largest disagreement that is left.
    """
    steps, n = ports.driven.shape
    room = _room(n)
    own, growth = np.empty(len(sliders.values), np.complex128), np.empty(len(sliders.values), np.complex128)
    trial = np.empty(n)
    new = Turn(np.empty((1, n), np.complex128), np.empty((1, n), np.complex128), np.empty((1, n)), np.empty((1, n)))
    force, work = np.empty(1 + len(RIPPLES), np.complex128), room_to_slide()
    for s in range(steps):
        _slide_all(sliders, s, log_a[s], search.difference, own, growth, force, work)
        _turn_one(ports, s, own, growth, log_a[s], out, s, room)
        worst[s] = _largest(out.gap[s])
        share = 1.0
        for _ in range(search.turns):
            if not worst[s] > search.settled:
                break
            for i in range(n):
                trial[i] = log_a[s, i] + share * min(max(out.step[s, i], -search.longest), search.longest)
            _slide_all(sliders, s, trial, search.difference, own, growth, force, work)
            _turn_one(ports, s, own, growth, trial, new, 0, room)
            left = _largest(new.gap[0])
            if left < worst[s] or share <= search.shortest:
                for i in range(n):
                    log_a[s, i], out.step[s, i] = trial[i], new.step[0, i]
                    out.motion[s, i], out.stiffness[s, i] = new.motion[0, i], new.stiffness[0, i]
                worst[s], share = left, 1.0
            else:
                share /= 4.0


@COMPILED
def _room(n: int) -> _Room:
    A, right, slope = np.empty((n, n), np.complex128), np.empty((n, n + 1), np.complex128), np.empty(n, np.complex128)
    return _Room(A, right, slope, np.empty((n, n)), np.empty(n))


@COMPILED
def _largest(gap: Array) -> float:
    largest = 0.0
    for value in gap:
        if not abs(value) <= largest:  # what is not a number counts as the largest
            largest = abs(value)
    return largest


@COMPILED
def _slide_all(
    sliders: Sliders, s: int, log_a: Array, difference: float, own: Array, growth: Array, force: Array,
    work: tuple[Array, ...],
) -> None:  # fmt: skip
    """Stiffness of the sliders at a step, and its derivative by the log amplitude of each."""
    first = len(log_a) - len(sliders.values)
    for i in range(len(sliders.values)):
        a, k, slip_force = np.exp(log_a[first + i]), sliders.values[i, 0], sliders.values[i, 1]
        slide(a, k, slip_force, sliders.common[s, i], sliders.compliance[s, i], force, work)
        own[i] = force[0] / max(a, LEAST_SLIP) - k
        a *= 1.0 + difference
        slide(a, k, slip_force, sliders.common[s, i], sliders.compliance[s, i], force, work)
        growth[i] = (force[0] / max(a, LEAST_SLIP) - k - own[i]) / difference


@COMPILED
def _turn_one(
    ports: Ports, s: int, own: Array, growth: Array, log_a: Array, out: Turn, row: int, room: _Room
) -> None:  # fmt: skip
    """Fill in a row of `out` for step s."""
    weights, among, driven, to_reference = ports.weights[s], ports.among[s], ports.driven[s], ports.to_reference[s]
    more_growth, z, k, gap = ports.more_growth[s], out.motion[row], out.stiffness[row], out.gap[row]
    A, right, slope, J, r = room
    n, points = len(driven), len(weights) // 2
    for i in range(n):
        if i < points:
            value, by_log = _cubic(ports.opening[i], np.exp(log_a[i]))
            k[i], slope[i] = complex(-weights[i] * value, 0.0), complex(-weights[i] * by_log, 0.0)
        elif i < 2 * points:
            value, by_log = _cubic(ports.slip[i - points], np.exp(log_a[i]))
            k[i], slope[i] = complex(0.0, weights[i] * value), complex(0.0, weights[i] * by_log)
        else:
            k[i], slope[i] = own[i - 2 * points], growth[i - 2 * points]
        k[i] += ports.more[s, i]
        if i < points:
            for j in range(points):
                k[i] += more_growth[i, j] * (log_a[j] - ports.more_at[s, j])
    for i in range(n):
        right[i, 0] = driven[i]
        for j in range(n):
            A[i, j] = among[i, j] * k[j]
            right[i, 1 + j] = among[i, j]
        A[i, i] += 1.0
    eliminate_columns(A, right)
    reading = ports.reference[s]
    for i in range(n):
        reading -= to_reference[i] * k[i] * right[i, 0]
    for i in range(n):
        z[i] = right[i, 0] / reading * ports.amplitude[s]
        gap[i] = np.log(max(abs(z[i]), 1e-300)) - log_a[i]
    for i in range(n):
        for j in range(n):
            J[i, j] = 1.0 if i == j else 0.0
    for j in range(n):
        onto = to_reference[j]
        for i in range(n):
            onto -= to_reference[i] * k[i] * right[i, 1 + j]
        by_reading = -onto * right[j, 0] / reading
        for i in range(n):
            influence = -right[i, 1 + j] * right[j, 0] / right[i, 0] - by_reading
            J[i, j] -= (influence * slope[j]).real
            if j < points:
                for m in range(points):
                    J[i, m] -= (influence * more_growth[j, m]).real
    for i in range(n):
        r[i] = gap[i]
    eliminate(J, r)
    for i in range(n):
        out.step[row, i] = r[i]


@COMPILED
def _cubic(c: Array, x: float) -> tuple[float, float]:
    """A law at an amplitude, and its derivative by the logarithm of that."""
    offset = c[5, 0]
    u = np.log(x + offset)
    i = min(max(np.searchsorted(c[4], u) - 1, 0), c.shape[1] - 2)
    t = u - c[4, i]
    value = ((c[0, i] * t + c[1, i]) * t + c[2, i]) * t + c[3, i]
    return value, ((3.0 * c[0, i] * t + 2.0 * c[1, i]) * t + c[2, i]) * x / (x + offset)
