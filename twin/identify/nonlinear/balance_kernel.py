"""Compiled: the motion of a few ports and the stiffness that goes with it, step by step.

Every step is a small problem of its own: n ports, a complex elimination with n + 1 right sides, a real one for Newton's
step on the logarithms of the amplitudes.
"""

import numpy as np

from twin.arrays import Array
from twin.identify.slipping import LEAST_SLIP, RIPPLES, room_to_slide, slide
from twin.joint.elimination import COMPILED, eliminate, eliminate_columns

__all__ = ["settle", "turn"]


@COMPILED
def turn(
    opening: Array, slip: Array, weights: Array, among: Array, driven: Array, reference: Array, to_reference: Array,
    amplitude: Array, more: Array, more_growth: Array, more_at: Array, own: Array, growth: Array, log_a: Array,
    rows: Array, z: Array, k: Array, gap: Array, step: Array,
) -> None:  # fmt: skip
    """Motion and stiffness of some steps at assumed amplitudes, what these miss, and Newton's step.

    Parameters
    ----------
    opening, slip : ndarray, (p, 4 + 2, i)
        Softening and loss at each point as cubics, see :func:`twin.identify.nonlinear.joint_law.packed_laws`.
    weights : ndarray, (s, 2 p)
        Of the layers' points.
    among, driven, reference, to_reference, amplitude
        As in :class:`twin.identify.nonlinear.local_forces.Surroundings`.
    more, more_growth, more_at : ndarray, (s, n), (s, p, p), (s, p)
        As in :class:`twin.identify.nonlinear.local_forces.Added`.
    own, growth : ndarray, (s, n - 2 p)
        Stiffness of the nonlinear forces at these amplitudes, and its derivative by their logarithms.
    log_a : ndarray, (s, n)
        Logarithms of the assumed amplitudes.
    rows : ndarray of int
        Which steps.
    z, k, gap, step : ndarray, (s, n)
        Filled there.
    """
    n = driven.shape[1]
    A, right, slope = np.empty((n, n), np.complex128), np.empty((n, n + 1), np.complex128), np.empty(n, np.complex128)
    J, r = np.empty((n, n)), np.empty(n)
    for s in rows:
        _turn_one(
            opening, slip, weights[s], among[s], driven[s], reference[s], to_reference[s], amplitude[s], more[s],
            more_growth[s], more_at[s], own[s], growth[s], log_a[s], z[s], k[s], gap[s], step[s], A, right, slope, J, r,
        )  # fmt: skip


@COMPILED
def settle(
    opening: Array, slip: Array, weights: Array, among: Array, driven: Array, reference: Array, to_reference: Array,
    amplitude: Array, more: Array, more_growth: Array, more_at: Array, sliders: Array, compliance: Array, common: Array,
    log_a: Array, z: Array, k: Array, worst: Array, turns: int, settled: float, longest: float, shortest: float,
    difference: float,
) -> None:  # fmt: skip
    """The same to the end, where all nonlinear forces are sliders: `log_a` is moved to where nothing is missed.

    A step that does not help is shortened, down to the `shortest` share; no logarithm moves by more than `longest`.

    Parameters
    ----------
    sliders : ndarray, (m, 2)
        Stiffness and slip force of each, as in :class:`twin.identify.slipping.Slider`.
    compliance, common : ndarray, (s, m, 3) and (s, m)
        What each slips into, and what that has in common, see :func:`twin.identify.slipping.common_spring`.
    worst : ndarray, (s,)
        Filled with the largest disagreement that is left.
    difference : float
        Relative step of an amplitude for the derivative of a slider's stiffness.
    """
    n = driven.shape[1]
    A, right, slope = np.empty((n, n), np.complex128), np.empty((n, n + 1), np.complex128), np.empty(n, np.complex128)
    J, r = np.empty((n, n)), np.empty(n)
    own, growth = np.empty(len(sliders), np.complex128), np.empty(len(sliders), np.complex128)
    force, room = np.empty(1 + len(RIPPLES), np.complex128), room_to_slide()
    gap, step, trial = np.empty(n), np.empty(n), np.empty(n)
    new_gap, new_step, new_z, new_k = np.empty(n), np.empty(n), np.empty(n, np.complex128), np.empty(n, np.complex128)
    for s in range(len(driven)):
        _slide_all(sliders, compliance[s], common[s], log_a[s], difference, own, growth, force, room)
        _turn_one(
            opening, slip, weights[s], among[s], driven[s], reference[s], to_reference[s], amplitude[s], more[s],
            more_growth[s], more_at[s], own, growth, log_a[s], z[s], k[s], gap, step, A, right, slope, J, r,
        )  # fmt: skip
        worst[s] = _largest(gap)
        share = 1.0
        for _ in range(turns):
            if not worst[s] > settled:
                break
            for i in range(n):
                trial[i] = log_a[s, i] + share * min(max(step[i], -longest), longest)
            _slide_all(sliders, compliance[s], common[s], trial, difference, own, growth, force, room)
            _turn_one(
                opening, slip, weights[s], among[s], driven[s], reference[s], to_reference[s], amplitude[s], more[s],
                more_growth[s], more_at[s], own, growth, trial, new_z, new_k, new_gap, new_step, A, right, slope, J, r,
            )  # fmt: skip
            left = _largest(new_gap)
            if left < worst[s] or share <= shortest:
                for i in range(n):
                    log_a[s, i], z[s, i], k[s, i], step[i] = trial[i], new_z[i], new_k[i], new_step[i]
                worst[s], share = left, 1.0
            else:
                share /= 4.0


@COMPILED
def _largest(gap: Array) -> float:
    largest = 0.0
    for value in gap:
        if not abs(value) <= largest:  # what is not a number counts as the largest
            largest = abs(value)
    return largest


@COMPILED
def _slide_all(
    sliders: Array, compliance: Array, common: Array, log_a: Array, difference: float, own: Array, growth: Array,
    force: Array, room: tuple[Array, ...],
) -> None:  # fmt: skip
    """Stiffness of the sliders, whose ports are the last ones, and its derivative by the log amplitude of each."""
    first = len(log_a) - len(sliders)
    for i in range(len(sliders)):
        a, k = np.exp(log_a[first + i]), sliders[i, 0]
        slide(a, k, sliders[i, 1], common[i], compliance[i], force, room)
        own[i] = force[0] / max(a, LEAST_SLIP) - k
        a *= 1.0 + difference
        slide(a, k, sliders[i, 1], common[i], compliance[i], force, room)
        growth[i] = (force[0] / max(a, LEAST_SLIP) - k - own[i]) / difference


@COMPILED
def _turn_one(
    opening: Array, slip: Array, weights: Array, among: Array, driven: Array, reference: complex, to_reference: Array,
    amplitude: complex, more: Array, more_growth: Array, more_at: Array, own: Array, growth: Array, log_a: Array,
    z: Array, k: Array, gap: Array, step: Array, A: Array, right: Array, slope: Array, J: Array, r: Array,
) -> None:  # fmt: skip
    n, points = len(driven), len(weights) // 2
    for i in range(n):
        if i < points:
            value, by_log = _cubic(opening[i], np.exp(log_a[i]))
            k[i], slope[i] = complex(-weights[i] * value, 0.0), complex(-weights[i] * by_log, 0.0)
        elif i < 2 * points:
            value, by_log = _cubic(slip[i - points], np.exp(log_a[i]))
            k[i], slope[i] = complex(0.0, weights[i] * value), complex(0.0, weights[i] * by_log)
        else:
            k[i], slope[i] = own[i - 2 * points], growth[i - 2 * points]
        k[i] += more[i]
        if i < points:
            for j in range(points):
                k[i] += more_growth[i, j] * (log_a[j] - more_at[j])
    for i in range(n):
        right[i, 0] = driven[i]
        for j in range(n):
            A[i, j] = among[i, j] * k[j]
            right[i, 1 + j] = among[i, j]
        A[i, i] += 1.0
    eliminate_columns(A, right)
    reading = reference
    for i in range(n):
        reading -= to_reference[i] * k[i] * right[i, 0]
    for i in range(n):
        z[i] = right[i, 0] / reading * amplitude
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
        step[i] = r[i]


@COMPILED
def _cubic(c: Array, x: float) -> tuple[float, float]:
    """A law at an amplitude, and its derivative by the logarithm of that."""
    offset = c[5, 0]
    u = np.log(x + offset)
    i = min(max(np.searchsorted(c[4], u) - 1, 0), c.shape[1] - 2)
    t = u - c[4, i]
    value = ((c[0, i] * t + c[1, i]) * t + c[2, i]) * t + c[3, i]
    return value, ((3.0 * c[0, i] * t + 2.0 * c[1, i]) * t + c[2, i]) * x / (x + offset)
