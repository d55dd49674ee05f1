"""The plain numpy twin of :mod:`twin.response.kernel`: the same equations as matrix products, for tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.joint.kinds import FORCE_FACTOR, RUNNING_LOSS
from twin.response.alternation import alternate_numpy, alternate_pair_numpy, running
from twin.response.kernel import EASY, SMALLEST
from twin.response.system import System

__all__ = ["follow", "newton", "residual"]

Matrix = NDArray[np.float64]
Complex = NDArray[np.complex128]


def _transfer(s: System, w: float, H: int) -> tuple[Complex, Complex]:
    """G(j k w) and its derivative by w, (H + 1, outputs, inputs)."""
    k = np.arange(H + 1)
    y = 1j * k[:, None] * w
    inverse = 1.0 / (y**2 - s.twice_real * y + s.square)
    top = s.r * y[:, None, None] + s.t
    G = np.einsum("koip,kp->koi", top, inverse) + s.D
    by_s = np.einsum("oip,kp->koi", s.r, inverse) - np.einsum("koip,kp->koi", top, inverse**2 * (2 * y - s.twice_real))
    return G, 1j * k[:, None, None] * by_s


def _real_blocks(G: Complex) -> Matrix:
    """Transfer functions (H + 1, a, b) as real matrices on [constant, cos, sin, ...], (a, b, n, n)."""
    H, a, b = len(G) - 1, G.shape[1], G.shape[2]
    blocks = np.zeros((a, b, 2 * H + 1, 2 * H + 1))
    blocks[..., 0, 0] = G[0].real
    for k in range(1, H + 1):
        i = 2 * k - 1
        blocks[..., i, i] = blocks[..., i + 1, i + 1] = G[k].real
        blocks[..., i, i + 1], blocks[..., i + 1, i] = G[k].imag, -G[k].imag
    return blocks


def _forces(s: System, x: Matrix, w: float, static: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """Coefficients (locals, n), Jacobian (locals, locals, n, n) and explicit derivative by w (locals, n)."""
    L, n = x.shape
    F, dF, by_w = np.zeros((L, n)), np.zeros((L, L, n, n)), np.zeros((L, n))
    f, j, j2, by_offset, by_omega = np.zeros(n), np.zeros((n, n)), np.zeros((n, n)), np.zeros(n), np.zeros(n)
    for e, a in enumerate(s.coordinate):
        if s.kind[e] == FORCE_FACTOR:
            b, c = s.parameters[e, 2:4].astype(int)
            alternate_pair_numpy(s.parameters, e, x[b], x[c], s.basis, f, j, j2)
            F[a] += f
            dF[a, b] += j
            dF[a, c] += j2
        elif s.kind[e] != RUNNING_LOSS:
            alternate_numpy(int(s.kind[e]), s.parameters, e, x[a], s.basis, f, j)
            F[a] += s.scale[e] * f
            dF[a, a] += s.scale[e] * j
    for e, a in enumerate(s.coordinate):
        if s.kind[e] != RUNNING_LOSS:
            continue
        flexibility = static[s.auxiliary[e], 1:]
        running.py_func(s.parameters, e, x[a], float(flexibility @ F[:, 0]), w, f, j, by_offset, by_omega)
        by_x = np.einsum("b,bcq->cq", flexibility, dF[:, :, 0])
        F[a] += s.scale[e] * f
        by_w[a] += s.scale[e] * by_omega
        dF[a, a] += s.scale[e] * j
        dF[a] += s.scale[e] * by_offset[:, None] * by_x[:, None, :]
    return F, dF, by_w


def residual(s: System, x: Matrix, w: float, amplitude: float) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Residual, Jacobian, derivative by w, and forces."""
    n = s.basis.shape[0]
    L = len(x) // n
    G, dG = _transfer(s, w, n // 2)
    F, dF, explicit = _forces(s, x.reshape(L, n), w, G[0].real)
    blocks, d_blocks = _real_blocks(G[:, :L]), _real_blocks(dG[:, :L])
    u = np.zeros((1 + L, n))
    u[0, 2], u[1:] = amplitude, F
    R = x - np.einsum("abij,bj->ai", blocks, u).ravel()
    by_w = -np.einsum("abij,bj->ai", d_blocks, u) - np.einsum("abij,bj->ai", blocks[:, 1:], explicit)
    J = np.eye(len(x)) - np.einsum("abij,bcjq->aicq", blocks[:, 1:], dF).reshape(len(x), len(x))
    return R, J, by_w.ravel(), F


def newton(s: System, x: Matrix, w: float, amplitude: float, tolerance: float, most: int, F: Matrix) -> int:
    """As the compiled one."""
    R, J, _, F[:] = residual(s, x, w, amplitude)
    for iteration in range(most):
        last = np.linalg.norm(R)
        if last <= tolerance * np.linalg.norm(x):
            return iteration
        step, old, length = np.linalg.solve(J, R), x.copy(), 1.0
        while True:
            x[:] = old - length * step
            R, J, _, F[:] = residual(s, x, w, amplitude)
            if np.linalg.norm(R) < (1 - 0.1 * length) * last or length < 0.05:
                break
            length /= 2
    return -1


def _tangent_at(J: Matrix, by_w: Matrix, size: float, span: float, heading: Matrix) -> Matrix:
    """Unit tangent in unknowns over `size` and w over `span`, on the side of `heading`."""
    slopes = np.column_stack([J * size, by_w * span])
    way = np.linalg.solve(np.vstack([slopes, heading]), np.append(np.zeros(len(J)), 1.0))
    return np.asarray(way / np.linalg.norm(way))


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
    """One step of arclength along the branch, in place; returns the corrections it took, or -1."""
    z += h * tangent
    way = tangent
    for iteration in range(most + 1):
        R, J, by_w, F[:] = residual(s, z[:-1] * size, z[-1] * span, amplitude)
        if iteration and np.linalg.norm(R) < tolerance * np.linalg.norm(z[:-1] * size):
            tangent[:] = way
            return iteration
        slopes = np.vstack([np.column_stack([J * size, by_w * span]), tangent])
        right = np.zeros((len(z), 2))
        right[:-1, 0], right[-1, 1] = R, 1.0
        correction, way = np.linalg.solve(slopes, right).T
        z -= correction
        way = way / np.linalg.norm(way)
    return -1


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
    """As the compiled one."""
    low, high = sorted((start_w, stop_w))
    span, size, h = high - low, float(np.linalg.norm(start)), step / 10
    _, J, by_w, force = residual(s, start, start_w, amplitude)
    heading = np.append(np.zeros(len(start)), np.sign(stop_w - start_w))
    z, tangent = np.append(start / size, start_w / span), _tangent_at(J, by_w, size, span, heading)
    count = 0
    while count < len(W):
        trial, way = z.copy(), tangent.copy()
        corrected = _advance(s, trial, way, size, span, h, amplitude, tolerance, corrections, force)
        if corrected < 0:
            h /= 2
            if h < SMALLEST * step:
                return -count - 1
            continue
        z, tangent = trial, way
        if not low <= z[-1] * span <= high:
            return count
        X[count], W[count], F[count], iterations[count] = z[:-1] * size, z[-1] * span, force, corrected
        count += 1
        larger = max(float(np.linalg.norm(z[:-1])), 1e-3)
        z[:-1] /= larger
        tangent[:-1] /= larger
        tangent /= np.linalg.norm(tangent)
        size *= larger
        h = min(step, h * (1.5 if corrected <= EASY else 0.8))
    return count
