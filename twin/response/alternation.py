"""Alternating between frequency and time: the harmonics of a law's steady force, and their derivatives.

A periodic coordinate is e(t) = sum of phi_i(t) c_i with phi = [1, cos t, sin t, cos 2t, sin 2t, ...]; the force's
coefficients and their exact derivatives with respect to c come from one march over the samples of a period (two for
laws with memory, of which the second counts).  A sticking slider's tangent is the sum of its increments since it last
slipped; smooth laws have the tangent of the moment.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.joint.kernel import COMPILED, evaluate
from twin.joint.kinds import POLYNOMIAL, RUNNING_LOSS, SLIDERS

__all__ = ["alternate", "alternate_numpy", "fourier_basis"]

Matrix = NDArray[np.float64]


def fourier_basis(harmonics: int, samples: int) -> Matrix:
    """phi_i at equal steps of a period, (samples, 2 harmonics + 1)."""
    t = 2 * np.pi * np.arange(samples) / samples
    columns = [np.ones(samples)]
    for k in range(1, harmonics + 1):
        columns += [np.cos(k * t), np.sin(k * t)]
    return np.ascontiguousarray(np.column_stack(columns))


@COMPILED
def alternate(kind: int, p: Matrix, row: int, c: Matrix, basis: Matrix, omega: float, F: Matrix, J: Matrix) -> None:
    """Force coefficients F, (n,), and Jacobian J, (n, n), of one element for coefficients c, (n,).

    Parameters
    ----------
    kind, p, row
        The law, as in :func:`twin.joint.kernel.evaluate`.
    c : ndarray, (n,)
        Of the coordinate; a velocity for :data:`RUNNING_LOSS`.
    basis : ndarray, (samples, n)
        See :func:`fourier_basis`.
    omega : float
        Fundamental, rad/s; only the running loss reads it.
    F, J
        Filled.
    """
    samples, n = basis.shape
    F[:] = 0.0
    J[:] = 0.0
    if kind == RUNNING_LOSS:
        _running(p, row, c, omega, F, J)
        return
    sliders = int(p[row, 0]) if kind == SLIDERS else 0
    force = np.zeros(sliders)
    slope = np.zeros((sliders, n))
    state = np.zeros((p.shape[0], 2))
    old = 0.0
    start = np.zeros(n)
    direction, turn = 0.0, np.zeros(n)
    d = np.zeros(n)
    cycles = 2 if kind in (SLIDERS, POLYNOMIAL) else 1
    for step in range(cycles * samples):
        t = step % samples
        counts = step >= (cycles - 1) * samples
        e = 0.0
        for i in range(n):
            e += basis[t, i] * c[i]
        f = 0.0
        if kind == SLIDERS:
            for i in range(n):
                d[i] = 0.0
            for s in range(sliders):
                k, limit = p[row, 1 + 2 * s], p[row, 2 + 2 * s]
                trial = force[s] + k * (e - old)
                if trial > limit or trial < -limit:
                    force[s] = limit if trial > limit else -limit
                    for i in range(n):
                        slope[s, i] = 0.0
                else:
                    force[s] = trial
                    for i in range(n):
                        slope[s, i] += k * (basis[t, i] - start[i])
                f += force[s]
                for i in range(n):
                    d[i] += slope[s, i]
            for i in range(n):
                start[i] = basis[t, i]
        elif kind == POLYNOMIAL:
            state[row, 0], state[row, 1] = old, direction
            f, tangent = evaluate(kind, p, state, row, e)
            travel = p[row, 0] if p[row, 0] > 0.0 else 1e-300
            trial = direction + (e - old) / travel
            direction = min(max(trial, -1.0), 1.0)
            stuck = abs(trial) < 1.0
            # The slope above is at a fixed memory; the memory's own derivative is carried in `turn`.
            gain = _loss_gain(p, row, abs(e))
            for i in range(n):
                d[i] = tangent * basis[t, i]
                if stuck:
                    d[i] += gain * (turn[i] - start[i] / travel)
                    turn[i] += (basis[t, i] - start[i]) / travel
                else:
                    turn[i] = 0.0
                start[i] = basis[t, i]
        else:
            f, tangent = evaluate(kind, p, state, row, e)
            for i in range(n):
                d[i] = tangent * basis[t, i]
        old = e
        if counts:
            for i in range(n):
                weight = basis[t, i] * (1.0 if i == 0 else 2.0) / samples
                F[i] += weight * f
                for j in range(n):
                    J[i, j] += weight * d[j]


@COMPILED
def _loss_gain(p: Matrix, row: int, size: float) -> float:
    """Force of a polynomial law's loss per unit of its direction."""
    storage = int(p[row, 1])
    gain, power = 0.0, 1.0
    for k in range(int(p[row, 2 + storage])):
        power *= size
        gain += p[row, 3 + storage + k] * power
    return gain


@COMPILED
def _running(p: Matrix, row: int, c: Matrix, omega: float, F: Matrix, J: Matrix) -> None:
    """The running loss: f = eta(A)/w v, with A and w from the harmonics of the velocity."""
    n = c.shape[0]
    v2, x2 = 0.0, 0.0
    for i in range(1, n):
        k = (i + 1) // 2
        v2 += c[i] * c[i]
        x2 += c[i] * c[i] / (k * omega) ** 2
    if x2 <= 0.0:
        return
    A, w = np.sqrt(x2), np.sqrt(v2 / x2)
    points = int(p[row, 1])
    position = min(A / p[row, 2] * (points - 1), points - 1.0)
    cell = min(int(position), points - 2)
    rise = p[row, 4 + cell] - p[row, 3 + cell]
    eta = p[row, 3 + cell] + rise * (position - cell)
    slope = rise * (points - 1) / p[row, 2] if p[row, 2] > A else 0.0
    for i in range(1, n):
        F[i] = eta / w * c[i]
        J[i, i] += eta / w
        for j in range(1, n):
            k = (j + 1) // 2
            dA = c[j] / (k * omega) ** 2 / A
            dw = (c[j] / v2 - c[j] / (k * omega) ** 2 / x2) * w
            J[i, j] += (slope / w * dA - eta / w**2 * dw) * c[i]


def alternate_numpy(
    kind: int, p: Matrix, row: int, c: Matrix, basis: Matrix, omega: float, F: Matrix, J: Matrix
) -> None:
    """The plain twin of :func:`alternate`: the same sums as matrix products, in steps only where there is memory."""
    samples, n = basis.shape
    weight = basis.T * np.where(np.arange(n) == 0, 1.0, 2.0)[:, None] / samples
    F[:], J[:] = 0.0, 0.0
    if kind == RUNNING_LOSS:
        _running.py_func(p, row, c, omega, F, J)
        return
    e = basis @ c
    state = np.zeros((p.shape[0], 2))
    if kind == SLIDERS:
        count = int(p[row, 0])
        k, limit = p[row, 1 : 1 + 2 * count : 2], p[row, 2 : 2 + 2 * count : 2]
        force, slope = np.zeros(count), np.zeros((count, n))
        f, d = np.zeros(samples), np.zeros((samples, n))
        old, start = 0.0, np.zeros(n)
        for t in [*range(samples)] * 2:
            trial = force + k * (e[t] - old)
            stuck = np.abs(trial) <= limit
            force = np.clip(trial, -limit, limit)
            slope = np.where(stuck[:, None], slope + k[:, None] * (basis[t] - start), 0.0)
            f[t], d[t] = force.sum(), slope.sum(axis=0)
            old, start = e[t], basis[t]
    elif kind == POLYNOMIAL:
        travel = max(p[row, 0], 1e-300)
        f, d = np.zeros(samples), np.zeros((samples, n))
        old, start, direction, turn = 0.0, np.zeros(n), 0.0, np.zeros(n)
        for t in [*range(samples)] * 2:
            state[row, :2] = old, direction
            f[t], tangent = evaluate.py_func(kind, p, state, row, e[t])
            trial = direction + (e[t] - old) / travel
            move = (basis[t] - start) / travel
            stuck = abs(trial) < 1.0
            fixed = _loss_gain.py_func(p, row, abs(e[t])) * (turn - start / travel) if stuck else 0.0
            d[t] = tangent * basis[t] + fixed
            turn = turn + move if stuck else np.zeros(n)
            direction, old, start = float(np.clip(trial, -1.0, 1.0)), e[t], basis[t]
    else:
        pairs = np.array([evaluate.py_func(kind, p, state, row, value) for value in e])
        f, d = pairs[:, 0], pairs[:, 1, None] * basis
    F[:], J[:] = weight @ f, weight @ d
