"""Alternating between frequency and time: the harmonics of a law's steady force, and their derivatives.

A periodic coordinate is e(t) = sum of phi_i(t) c_i with phi = [1, cos t, sin t, cos 2t, sin 2t, ...]; the force's
coefficients and their exact derivatives with respect to c come from one pass over the samples of a period (two for
laws with memory, of which the second counts).  A sticking slider's tangent is the sum of its increments since it last
slipped; smooth laws have the tangent of the moment; what a law given by functions remembers is led on until it is
periodic, and differentiated by differences.
"""

from math import sqrt
from typing import Any

import numpy as np

from twin.arrays import Array
from twin.bench.force_factor import lost_force
from twin.joint.calling import call_at
from twin.joint.kernel import COMPILED, INNER, evaluate, polynomial
from twin.joint.kinds import FORCE_FACTOR, FUNCTIONS, LINEAR, POLYNOMIAL, RUNNING_LOSS, SLIDERS

BESIDE = 1e-6
"""Change of a coefficient over the coordinate's amplitude, for differences."""
SETTLED, MOST_PERIODS = 1e-9, 64
"""Change of such a law's memory over a period, as a share of it, that counts as none, and most periods until then."""


def fourier_basis(harmonics: int, samples: int) -> Array:
    """phi_i at equal steps of a period, (2 harmonics + 1, samples)."""
    t = 2 * np.pi * np.arange(samples) / samples
    rows = [np.ones(samples)]
    for k in range(1, harmonics + 1):
        rows += [np.cos(k * t), np.sin(k * t)]
    return np.array(rows)


def aft_kernel(kind: int, p: Array) -> Any:
    """The kernel for an element with a row of parameters: only those are compiled that a rig's laws need.

    The running loss and a force factor have :func:`running` and :func:`alternate_pair`.
    """
    if kind == FUNCTIONS:
        return _remembering if p[1] != 0.0 else _smooth
    return {SLIDERS: _sliders, POLYNOMIAL: _polynomial, RUNNING_LOSS: running, FORCE_FACTOR: alternate_pair}.get(
        kind, _smooth
    )


@COMPILED
def _smooth(kind: int, p: Array, row: int, c: Array, basis: Array, F: Array, J: Array) -> None:
    """A law whose force goes by the moment's coordinate."""
    n, samples = basis.shape
    if kind == LINEAR:
        for i in range(n):
            for j in range(n):
                J[i, j] = p[row, 0] if i == j else 0.0
            F[i] = p[row, 0] * c[i]
        return
    e, force, tangent, state = _path(c, basis), np.empty(samples), np.empty(samples), np.zeros((row + 1, 1))
    for t in range(samples):
        force[t], tangent[t] = evaluate(kind, p, state, row, e[t])
    _project_smooth(basis, force, tangent, F, J)


@INNER
def _path(c: Array, basis: Array) -> Array:
    """The coordinate at the samples."""
    e = np.zeros(basis.shape[1])
    for i in range(basis.shape[0]):
        for t in range(basis.shape[1]):
            e[t] += c[i] * basis[i, t]
    return e


@INNER
def _project(basis: Array, force: Array, slopes: Array, F: Array, J: Array) -> None:
    """Fourier coefficients of a force and of its derivatives by each unknown, (n, samples)."""
    n, samples = basis.shape
    for i in range(n):
        weight = (1.0 if i == 0 else 2.0) / samples
        total = 0.0
        for t in range(samples):
            total += basis[i, t] * force[t]
        F[i] = weight * total
        for j in range(n):
            total = 0.0
            for t in range(samples):
                total += basis[i, t] * slopes[j, t]
            J[i, j] = weight * total


@INNER
def _project_smooth(basis: Array, force: Array, tangent: Array, F: Array, J: Array) -> None:
    """The same where the derivative is a tangent times the unknown's wave."""
    n, samples = basis.shape
    slope = np.empty(samples)
    for i in range(n):
        weight = (1.0 if i == 0 else 2.0) / samples
        total = 0.0
        for t in range(samples):
            slope[t] = weight * tangent[t] * basis[i, t]
            total += basis[i, t] * force[t]
        F[i] = weight * total
        for j in range(i + 1):
            total = 0.0
            for t in range(samples):
                total += slope[t] * basis[j, t]
            J[i, j] = total
            J[j, i] = total if j > 0 or i == 0 else 0.5 * total


@COMPILED
def _sliders(kind: int, p: Array, row: int, c: Array, basis: Array, F: Array, J: Array) -> None:
    """The second of two periods; a slider's slope is k (phi(t) - phi(t of its last slip)), and none while it slips."""
    n, samples = basis.shape
    e, force, slopes = _path(c, basis), np.empty(samples), np.empty((n, samples))
    count = int(p[row, 0])
    stiffness, limit, one = np.empty(count), np.empty(count), np.zeros(count)
    slipped, slipping = np.empty(count, np.int64), np.zeros(count, np.bool_)  # sample of the last slip
    for s in range(count):
        stiffness[s], limit[s], slipped[s] = p[row, 1 + 2 * s], p[row, 2 + 2 * s], -1
    old = 0.0
    for t in range(samples):
        move = e[t] - old
        old = e[t]
        for s in range(count):
            trial = one[s] + stiffness[s] * move
            one[s] = min(max(trial, -limit[s]), limit[s])
            slipping[s] = abs(trial) > limit[s]
            slipped[s] = t if slipping[s] else slipped[s]
    sticking, held = 0.0, np.zeros(n)  # over the sticking sliders: sum of k, and of k phi(t of the last slip)
    for s in range(count):
        if not slipping[s]:
            sticking += _hold(stiffness[s], slipped[s], basis, held)
    for t in range(samples):
        f, move = 0.0, e[t] - old
        old = e[t]
        for s in range(count):
            trial = one[s] + stiffness[s] * move
            one[s] = min(max(trial, -limit[s]), limit[s])
            f += one[s]
            slips = abs(trial) > limit[s]
            if slips != slipping[s]:
                slipping[s] = slips
                sticking += _hold(-stiffness[s] if slips else stiffness[s], slipped[s], basis, held)
            if slips:
                slipped[s] = t
        force[t] = f
        for i in range(n):
            slopes[i, t] = sticking * basis[i, t] - held[i]
    _project(basis, force, slopes, F, J)


@INNER
def _hold(k: float, since: int, basis: Array, held: Array) -> float:
    """Add a slider of stiffness k (negative: take it away) that sticks since a sample, or since it was at rest."""
    if since >= 0:
        for i in range(held.shape[0]):
            held[i] += k * basis[i, since]
    return k


@COMPILED
def _polynomial(kind: int, p: Array, row: int, c: Array, basis: Array, F: Array, J: Array) -> None:
    """The second of two periods; the direction of the loss has a derivative of its own, `turn`."""
    n, samples = basis.shape
    e, force, slopes = _path(c, basis), np.empty(samples), np.empty((n, samples))
    travel = p[row, 0] if p[row, 0] > 0.0 else 1e-300
    state = np.zeros((row + 1, 2))
    old, direction = 0.0, 0.0
    start, turn = np.zeros(n), np.zeros(n)
    for step in range(2 * samples):
        t = step % samples
        state[row, 0], state[row, 1] = old, direction
        force[t], tangent = polynomial(p, state, row, e[t])
        trial = direction + (e[t] - old) / travel
        direction = min(max(trial, -1.0), 1.0)
        gain = loss_gain(p, row, abs(e[t]))
        for i in range(n):
            slopes[i, t] = tangent * basis[i, t]
            if abs(trial) < 1.0:
                # The tangent is at a fixed memory.
                slopes[i, t] += gain * (turn[i] - start[i] / travel)
                turn[i] += (basis[i, t] - start[i]) / travel
            else:
                turn[i] = 0.0
            start[i] = basis[i, t]
        old = e[t]
    _project(basis, force, slopes, F, J)


@COMPILED
def _remembering(kind: int, p: Array, row: int, c: Array, basis: Array, F: Array, J: Array) -> None:
    """A law given by functions that has a memory, by differences."""
    n, samples = basis.shape
    e, largest = _path(c, basis), 1e-30
    for t in range(samples):
        largest = max(largest, abs(e[t]))
    step = BESIDE * largest
    steady, force, beside, slopes = np.empty(samples), np.empty(samples), np.empty(samples), np.empty((n, samples))
    _settled(p, row, e, steady)
    for i in range(n):
        for t in range(samples):
            beside[t] = e[t] + step * basis[i, t]
        _settled(p, row, beside, force)
        for t in range(samples):
            slopes[i, t] = (force[t] - steady[t]) / step
    _project(basis, steady, slopes, F, J)


@INNER
def _settled(p: Array, row: int, e: Array, force: Array) -> None:
    """Force over the period, from rest on, after which the memory is what it was before."""
    states = int(p[row, 2])
    memory, before = np.zeros((row + 1, states)), np.zeros(states)
    for period in range(MOST_PERIODS):
        change = 0.0
        for i in range(states):
            change = max(change, abs(memory[row, i] - before[i]) / max(abs(memory[row, i]), 1e-300))
            before[i] = memory[row, i]
        if period > 1 and change < SETTLED:
            return
        for t in range(e.shape[0]):
            force[t] = call_at(int(p[row, 0]), p, memory, row, e[t])[0]
            call_at(int(p[row, 1]), p, memory, row, e[t])


@COMPILED
def alternate_pair(p: Array, row: int, x: Array, z: Array, basis: Array, F: Array, J: Array) -> None:
    """Force coefficients of a force factor; Jacobians (2, n, n) by its stroke's coefficients x and by what it turns."""
    samples = basis.shape[1]
    stroke, turned = _path(x, basis), _path(z, basis)
    force, slope_x, slope_z = np.empty(samples), np.empty(samples), np.empty(samples)
    for t in range(samples):
        force[t], slope_x[t], slope_z[t] = lost_force(p, row, stroke[t], turned[t])
    _project_smooth(basis, force, slope_x, F, J[0])
    _project_smooth(basis, force, slope_z, F, J[1])


@INNER
def loss_gain(p: Array, row: int, size: float) -> float:
    """Force of a polynomial law's loss per unit of its direction."""
    storage = int(p[row, 1])
    gain, power = 0.0, 1.0
    for k in range(int(p[row, 2 + storage])):
        power *= size
        gain += p[row, 3 + storage + k] * power
    return gain


@COMPILED
def running(p: Array, row: int, c: Array, offset: float, omega: float, F: Array, J: Array, by: Array) -> None:
    """The running loss: f = eta(A)/w v, with A and w from the harmonics of the velocity, and derivatives by all else.

    Parameters
    ----------
    p, row
        The law.
    c : ndarray, (n,)
        Of the velocity.
    offset : float
        Constant part of the displacement, which the running means hold too.
    omega : float
        Fundamental, rad/s.
    F, J, by
        Filled: (n,), (n, n), and (2, n): the force's derivatives by the offset and by the fundamental.
    """
    n = c.shape[0]
    for i in range(n):
        F[i] = by[0, i] = by[1, i] = 0.0
        for j in range(n):
            J[i, j] = 0.0
    v2, moving = 0.0, 0.0
    for i in range(1, n):
        w = (i + 1) // 2 * omega
        v2 += c[i] * c[i]
        moving += c[i] * c[i] / (w * w)
    if moving <= 0.0:
        return
    x2 = moving + 2.0 * offset * offset
    A, w = sqrt(x2), sqrt(v2 / x2)
    points = int(p[row, 1])
    position = min(A / p[row, 2] * (points - 1), points - 1.0)
    cell = min(int(position), points - 2)
    rise = p[row, 4 + cell] - p[row, 3 + cell]
    eta = p[row, 3 + cell] + rise * (position - cell)
    slope = rise * (points - 1) / p[row, 2] if p[row, 2] > A else 0.0
    # of eta/w by x2, at constant v2
    by_x2 = slope / w * 0.5 / A + eta / w * 0.5 / x2
    for i in range(1, n):
        F[i] = eta / w * c[i]
        by[0, i] = by_x2 * 4.0 * offset * c[i]
        by[1, i] = by_x2 * -2.0 * moving / omega * c[i]
        J[i, i] += eta / w
        for j in range(1, n):
            own = (j + 1) // 2 * omega
            J[i, j] += (by_x2 * 2.0 * c[j] / (own * own) - eta / w * c[j] / v2) * c[i]
