"""Harmonic balance compiled: residual with exact Jacobian, Newton at a frequency, and a step along the branch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.bench.marching import eliminate
from twin.joint.kernel import COMPILED
from twin.joint.kinds import FORCE_FACTOR, RUNNING_LOSS
from twin.response.alternation import alternate, alternate_pair, running
from twin.response.system import System

__all__ = ["EASY", "SMALLEST", "follow", "forces", "newton", "residual"]

Matrix = NDArray[np.float64]

EASY = 4
"""Corrections up to which the next step may be longer."""
SMALLEST = 1e-7
"""Step over the greatest at which the branch counts as ended."""


@COMPILED
def _transfer(s: System, w: float, G: Matrix, dG: Matrix) -> None:
    """Real and imaginary parts of G(j k w) and of its derivative by w, (harmonics + 1, 2, outputs, inputs)."""
    poles = s.square.shape[0]
    inverse, by_s = np.empty((2, poles)), np.empty((2, poles))
    for k in range(G.shape[0]):
        y = k * w
        for p in range(poles):
            a, b = s.square[p] - y * y, -s.twice_real[p] * y
            scale = 1.0 / (a * a + b * b)
            u, v = a * scale, -b * scale
            inverse[0, p], inverse[1, p] = u, v
            # (2 s - 2 Re lambda) / d^2
            real, imaginary = u * u - v * v, 2.0 * u * v
            by_s[0, p] = -s.twice_real[p] * real - 2.0 * y * imaginary
            by_s[1, p] = -s.twice_real[p] * imaginary + 2.0 * y * real
        for o in range(s.D.shape[0]):
            for i in range(s.D.shape[1]):
                re, im, d_re, d_im = s.D[o, i], 0.0, 0.0, 0.0
                for p in range(poles):
                    t, ry = s.t[o, i, p], s.r[o, i, p] * y
                    re += t * inverse[0, p] - ry * inverse[1, p]
                    im += t * inverse[1, p] + ry * inverse[0, p]
                    d_re += s.r[o, i, p] * inverse[0, p] - t * by_s[0, p] + ry * by_s[1, p]
                    d_im += s.r[o, i, p] * inverse[1, p] - t * by_s[1, p] - ry * by_s[0, p]
                G[k, 0, o, i], G[k, 1, o, i] = re, im
                dG[k, 0, o, i], dG[k, 1, o, i] = -k * d_im, k * d_re


@COMPILED
def forces(s: System, x: Matrix, w: float, static: Matrix, F: Matrix, dF: Matrix, by_w: Matrix, met: Matrix) -> None:
    """Coefficients of the local forces and their derivatives.

    Parameters
    ----------
    x : ndarray, (locals, n)
        Coefficients of the local coordinates.
    static : ndarray, (outputs, inputs)
        G at zero frequency.
    F, by_w : ndarray, (locals, n)
        Filled; `by_w` is the explicit dependence on w.
    dF : ndarray, (locals, locals, n, n)
        Filled: of force a by coordinate b.
    met : ndarray, (locals, locals)
        Filled: whether force a depends on coordinate b.
    """
    locals_, n = x.shape
    F[:] = 0.0
    dF[:] = 0.0
    by_w[:] = 0.0
    met[:] = 0.0
    f, j, j2, by_offset, by_omega = np.zeros(n), np.zeros((n, n)), np.zeros((n, n)), np.zeros(n), np.zeros(n)
    for e in range(s.kind.shape[0]):
        a = s.coordinate[e]
        if s.kind[e] == FORCE_FACTOR:
            b, c = int(s.parameters[e, 2]), int(s.parameters[e, 3])
            alternate_pair(s.parameters, e, x[b], x[c], s.basis, f, j, j2)
            F[a] += f
            dF[a, b] += j
            dF[a, c] += j2
            met[a, b] = met[a, c] = 1.0
        elif s.kind[e] != RUNNING_LOSS:
            alternate(s.kind[e], s.parameters, e, x[a], s.basis, f, j)
            F[a] += s.scale[e] * f
            dF[a, a] += s.scale[e] * j
            met[a, a] = 1.0
    # The running means hold the displacement's static part, which the forces above make.
    for e in range(s.kind.shape[0]):
        if s.kind[e] == RUNNING_LOSS:
            a, row = s.coordinate[e], s.auxiliary[e]
            offset = 0.0
            for b in range(locals_):
                offset += static[row, 1 + b] * F[b, 0]
            running(s.parameters, e, x[a], offset, w, f, j, by_offset, by_omega)
            F[a] += s.scale[e] * f
            by_w[a] += s.scale[e] * by_omega
            dF[a, a] += s.scale[e] * j
            met[a, a] = 1.0
            if offset != 0.0:
                for b in range(locals_):
                    for c in range(locals_):
                        if met[b, c] > 0.0:
                            met[a, c] = 1.0
                            for i in range(n):
                                for q in range(n):
                                    dF[a, c, i, q] += s.scale[e] * by_offset[i] * static[row, 1 + b] * dF[b, c, 0, q]


@COMPILED
def residual(s: System, x: Matrix, w: float, amplitude: float, R: Matrix, J: Matrix, by_w: Matrix, F: Matrix) -> None:
    """Residual (N,), its Jacobian (N, N) and derivative by w (N,), and the forces (locals, n), for unknowns x, (N,)."""
    n = s.basis.shape[0]
    locals_ = x.shape[0] // n
    G = np.empty((n // 2 + 1, 2, s.D.shape[0], s.D.shape[1]))
    dG = np.empty_like(G)
    _transfer(s, w, G, dG)
    dF, met = np.empty((locals_, locals_, n, n)), np.empty((locals_, locals_))
    explicit = np.empty((locals_, n))
    forces(s, x.reshape(locals_, n), w, G[0, 0], F, dF, explicit, met)
    J[:] = 0.0
    for i in range(x.shape[0]):
        R[i] = x[i]
        by_w[i] = 0.0
        J[i, i] = 1.0
    for a in range(locals_):
        top = a * n
        for k in range(n // 2 + 1):
            i = top + max(2 * k - 1, 0)
            if k == 1:  # the drive is a sine
                R[i] -= G[k, 1, a, 0] * amplitude
                R[i + 1] -= G[k, 0, a, 0] * amplitude
                by_w[i] -= dG[k, 1, a, 0] * amplitude
                by_w[i + 1] -= dG[k, 0, a, 0] * amplitude
            for b in range(locals_):
                g, h = G[k, 0, a, 1 + b], G[k, 1, a, 1 + b]
                dg, dh = dG[k, 0, a, 1 + b], dG[k, 1, a, 1 + b]
                if k == 0:
                    R[i] -= g * F[b, 0]
                    by_w[i] -= g * explicit[b, 0]
                else:
                    c, d = F[b, 2 * k - 1], F[b, 2 * k]
                    R[i] -= g * c + h * d
                    R[i + 1] -= g * d - h * c
                    by_w[i] -= dg * c + dh * d + g * explicit[b, 2 * k - 1] + h * explicit[b, 2 * k]
                    by_w[i + 1] -= dg * d - dh * c + g * explicit[b, 2 * k] - h * explicit[b, 2 * k - 1]
                for m in range(locals_):
                    if met[b, m] == 0.0:
                        continue
                    if k == 0:
                        for q in range(n):
                            J[i, m * n + q] -= g * dF[b, m, 0, q]
                    else:
                        for q in range(n):
                            u, v = dF[b, m, 2 * k - 1, q], dF[b, m, 2 * k, q]
                            J[i, m * n + q] -= g * u + h * v
                            J[i + 1, m * n + q] -= g * v - h * u


@COMPILED
def _norm(x: Matrix) -> float:
    total = 0.0
    for i in range(x.shape[0]):
        total += x[i] * x[i]
    return float(np.sqrt(total))


@COMPILED
def newton(s: System, x: Matrix, w: float, amplitude: float, tolerance: float, most: int, F: Matrix) -> int:
    """Move x, (N,), onto the solution at w; returns the iterations it took, or -1.  F, (locals, n), is filled."""
    size = x.shape[0]
    R, J, by_w = np.empty(size), np.empty((size, size)), np.empty(size)
    old = np.empty(size)
    residual(s, x, w, amplitude, R, J, by_w, F)
    for iteration in range(most):
        last = _norm(R)
        if last <= tolerance * _norm(x):
            return iteration
        eliminate(J, R)
        step = R.copy()
        old[:] = x
        length = 1.0
        while True:
            for i in range(size):
                x[i] = old[i] - length * step[i]
            residual(s, x, w, amplitude, R, J, by_w, F)
            if _norm(R) < (1.0 - 0.1 * length) * last or length < 0.05:
                break
            length /= 2.0
    return -1


@COMPILED
def _tangent_at(J: Matrix, by_w: Matrix, size: float, span: float, heading: Matrix, tangent: Matrix) -> None:
    """Unit tangent of the branch in unknowns over `size` and w over `span`, on the side of `heading`, (N + 1,)."""
    N = J.shape[0]
    bordered, right = np.empty((N + 1, N + 1)), np.zeros(N + 1)
    _border(J, by_w, size, span, heading, bordered)
    right[N] = 1.0
    eliminate(bordered, right)
    length = _norm(right)
    for i in range(N + 1):
        tangent[i] = right[i] / length


@COMPILED
def _border(J: Matrix, by_w: Matrix, size: float, span: float, row: Matrix, bordered: Matrix) -> None:
    N = J.shape[0]
    for i in range(N):
        for j in range(N):
            bordered[i, j] = J[i, j] * size
        bordered[i, N] = by_w[i] * span
    bordered[N] = row


@COMPILED
def _advance(
    s: System,
    z: Matrix,
    tangent: Matrix,
    size: float,
    span: float,
    h: float,
    amplitude: float,
    tolerance: float,
    most: int,
    F: Matrix,
) -> int:
    """One step of arclength along the branch; returns the corrections it took, or -1.

    Parameters
    ----------
    z : ndarray, (N + 1,)
        Unknowns over `size` and w over `span`, moved on in place.
    tangent : ndarray, (N + 1,)
        Unit tangent at z; if all goes well replaced by that at the last correction but one.
    h
        Arclength.
    most
        Corrections.
    F
        Filled: forces at the end, (locals, n).
    """
    N = z.shape[0] - 1
    x, R, J, by_w = np.empty(N), np.empty(N), np.empty((N, N)), np.empty(N)
    bordered, right, way = np.empty((N + 1, N + 1)), np.empty((N + 1, 2)), tangent.copy()
    for i in range(N + 1):
        z[i] += h * tangent[i]
    for iteration in range(most + 1):
        for i in range(N):
            x[i] = z[i] * size
        residual(s, x, z[N] * span, amplitude, R, J, by_w, F)
        if iteration > 0 and _norm(R) < tolerance * _norm(x):
            tangent[:] = way
            return iteration
        _border(J, by_w, size, span, tangent, bordered)
        right[:N, 0] = R
        right[:N, 1] = 0.0
        right[N, 0], right[N, 1] = 0.0, 1.0  # corrections lie across the tangent; the second column is the next one
        _eliminate_two(bordered, right)
        length = 0.0
        for i in range(N + 1):
            z[i] -= right[i, 0]
            length += right[i, 1] * right[i, 1]
        for i in range(N + 1):
            way[i] = right[i, 1] / np.sqrt(length)
    return -1


@COMPILED
def _eliminate_two(J: Matrix, r: Matrix) -> None:
    """Gaussian elimination with row pivoting for two right sides, (n, 2), which the solutions replace."""
    n = r.shape[0]
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(J[i, k]) > abs(J[best, k]):
                best = i
        if best != k:
            for j in range(k, n):
                J[k, j], J[best, j] = J[best, j], J[k, j]
            for j in range(2):
                r[k, j], r[best, j] = r[best, j], r[k, j]
        inverse = 1.0 / J[k, k]
        for i in range(k + 1, n):
            factor = J[i, k] * inverse
            if factor != 0.0:
                for j in range(k + 1, n):
                    J[i, j] -= factor * J[k, j]
                r[i, 0] -= factor * r[k, 0]
                r[i, 1] -= factor * r[k, 1]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            r[k, 0] -= J[k, j] * r[j, 0]
            r[k, 1] -= J[k, j] * r[j, 1]
        r[k, 0] /= J[k, k]
        r[k, 1] /= J[k, k]


@COMPILED
def follow(
    s: System,
    start: Matrix,
    start_w: float,
    stop_w: float,
    amplitude: float,
    step: float,
    tolerance: float,
    corrections: int,
    X: Matrix,
    W: Matrix,
    F: Matrix,
    iterations: NDArray[np.int64],
) -> int:
    """Follow the branch from one frequency to the other, through folds.

    Parameters
    ----------
    start : ndarray, (N,)
        Solution at `start_w`, rad/s.
    stop_w
        The branch ends where it leaves the band between the two, rad/s.
    step
        Greatest arclength of a step.
    tolerance, corrections
        Of each point.
    X, W, F, iterations : ndarray, (most, N), (most,), (most, locals, n), (most,)
        Filled with the points after the first.

    Returns
    -------
    int
        How many points; minus as many, less one, if no step is small enough; `most` if there may be more.
    """
    N, most = start.shape[0], W.shape[0]
    low, high = min(start_w, stop_w), max(start_w, stop_w)
    span, size, h = high - low, _norm(start), step / 10.0
    z, tangent, heading = np.empty(N + 1), np.empty(N + 1), np.zeros(N + 1)
    R, J, by_w, force = np.empty(N), np.empty((N, N)), np.empty(N), np.empty_like(F[0])
    residual(s, start, start_w, amplitude, R, J, by_w, force)
    heading[N] = 1.0 if stop_w > start_w else -1.0
    z[:N], z[N] = start / size, start_w / span
    _tangent_at(J, by_w, size, span, heading, tangent)
    trial, way = np.empty(N + 1), np.empty(N + 1)
    count = 0
    while count < most:
        trial[:], way[:] = z, tangent
        corrected = _advance(s, trial, way, size, span, h, amplitude, tolerance, corrections, force)
        if corrected < 0:
            h /= 2.0
            if h < SMALLEST * step:
                return -count - 1
            continue
        z[:], tangent[:] = trial, way
        if not low <= z[N] * span <= high:
            return count
        X[count], W[count], F[count], iterations[count] = z[:N] * size, z[N] * span, force, corrected
        count += 1
        larger = max(_norm(z[:N]), 1e-3)
        z[:N] /= larger
        tangent[:N] /= larger
        tangent /= _norm(tangent)
        size *= larger
        h = min(step, h * (1.5 if corrected <= EASY else 0.8))
    return count
