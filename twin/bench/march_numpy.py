"""The plain numpy twin of :func:`twin.bench.marching.march`: the same scheme written a second time, for tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.joint.kernel import evaluate, remember

__all__ = ["march_numpy"]

Matrix = NDArray[np.float64]

ITERATIONS = 40


def march_numpy(
    step_s: float,
    decay: Matrix,
    Gamma: Matrix,
    C: Matrix,
    D: Matrix,
    locals_: int,
    auxiliaries: int,
    kind: NDArray[np.int64],
    coordinate: NDArray[np.int64],
    auxiliary: NDArray[np.int64],
    scale: Matrix,
    parameters: Matrix,
    state: Matrix,
    w: Matrix,
    y: Matrix,
    u: Matrix,
    voltage: Matrix,
    out: Matrix,
) -> int:
    """March as the compiled kernel does; arguments and result are the same."""
    m = len(w) // 2
    e_z, gamma = decay[:m] + 1j * decay[m:], Gamma[:, :m] + 1j * Gamma[:, m:]
    rows = C[:, :m] - 1j * C[:, m:]
    H = D[:locals_, 1:]
    W = w[:m] + 1j * w[m:]
    failures = 0
    for n, volts in enumerate(voltage):
        free = (rows @ W).real + D[:, 0] * volts
        p, force = free[:locals_], np.zeros(locals_)
        for _ in range(ITERATIONS):
            force, tangent = np.zeros(locals_), np.zeros(locals_)
            for e, a in enumerate(coordinate):
                f, slope = evaluate.py_func(kind[e], parameters, state, e, y[a])
                force[a] += scale[e] * f
                tangent[a] += scale[e] * slope
            r = y - p - H @ force
            if np.all(np.abs(r) < 1e-10 * (np.abs(y) + np.abs(p) + 1e-30)):
                break
            y -= np.linalg.solve(np.eye(locals_) - H * tangent, r)
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
