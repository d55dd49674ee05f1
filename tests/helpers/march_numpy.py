"""The plain numpy twin of :func:`twin.bench.marching.integrate`: the same scheme written a second time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.bench.force_factor import lost_force
from twin.bench.marching import Elements, Step
from twin.joint.kernel import evaluate, remember
from twin.joint.kinds import FORCE_FACTOR

__all__ = ["march_numpy"]

Matrix = NDArray[np.float64]

ITERATIONS = 100
SHORTEST = 0.01
FORGET = 0.9995


def march_numpy(step: Step, elements: Elements, w: Matrix, y: Matrix, u: Matrix, voltage: Matrix, out: Matrix) -> int:
    """March as the compiled kernel does; arguments and result are the same."""
    step_s, decay, Gamma, C, D, locals_, auxiliaries = step
    kind, coordinate, auxiliary, scale, parameters, state = elements
    m = len(w) // 2
    e_z, gamma = decay[:m] + 1j * decay[m:], Gamma[:, :m] + 1j * Gamma[:, m:]
    rows = C[:, :m] - 1j * C[:, m:]
    H = D[:locals_, 1:]
    W = w[:m] + 1j * w[m:]
    failures, size = 0, np.abs(y)
    for n, volts in enumerate(voltage):
        free = (rows @ W).real + D[:, 0] * volts
        p, force = free[:locals_], np.zeros(locals_)
        size = np.maximum(size * FORGET, np.abs(y) + 1e-30)
        move, length, last = np.zeros(locals_), 1.0, np.inf
        for _ in range(ITERATIONS):
            force, tangent = np.zeros(locals_), np.zeros((locals_, locals_))
            for e, a in enumerate(coordinate):
                if kind[e] == FORCE_FACTOR:
                    x, z = parameters[e, 2:4].astype(int)
                    f, by_x, by_z = lost_force.py_func(parameters, e, y[x], y[z])
                    tangent[a, x] += by_x
                    tangent[a, z] += by_z
                else:
                    f, slope = evaluate.py_func(kind[e], parameters, state, e, y[a])
                    tangent[a, a] += scale[e] * slope
                force[a] += scale[e] * f
            r = y - p - H @ force
            if np.all(np.abs(r) < 1e-10 * (size + np.abs(y) + np.abs(p))):
                break
            norm = float(np.sum(np.abs(r) / (size + np.abs(p))))
            if norm > (1.0 - 0.25 * length) * last and length > SHORTEST:
                length /= 2
                y += length * move
                continue
            move, length, last = np.linalg.solve(np.eye(locals_) - H @ tangent, r), 1.0, norm
            y -= move
        else:
            failures += 1
        u[0], u[1:] = volts, force
        everything = free + D[:, 1:] @ force
        for e, a in enumerate(coordinate):
            displacement = everything[auxiliary[e]] if auxiliary[e] >= 0 else 0.0
            remember.py_func(kind[e], parameters, state, e, y[a], displacement, step_s)
        out[n] = everything[locals_ + auxiliaries :]
        W = e_z * W + u @ gamma
    w[:m], w[m:] = W.real, W.imag
    return failures
