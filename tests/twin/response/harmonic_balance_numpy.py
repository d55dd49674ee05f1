"""The compiled harmonic balance and its continuation once more in plain numpy: matrix products."""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

from twin.bench.force_factor import lost_force
from twin.joint.kernel import evaluate, remember
from twin.joint.kinds import FORCE_FACTOR, FUNCTIONS, POLYNOMIAL, RUNNING_LOSS, SLIDERS
from twin.response import HarmonicBalance
from twin.response.aft import BESIDE, MOST_PERIODS, SETTLED, loss_gain, running
from twin.response.continuation import AIM, BEND, CONTRACTION, FADED, KINK, LEAST_TURN, SHORTEST, Course, turns_beyond
from twin.response.kernel import ROUNDING
from twin.response.outcome import ENDED, FAR, FOUND, LONG, NOT_FINITE, STALLED
from twin.response.system import SineDrive, System

Matrix = NDArray[np.float64]
Complex = NDArray[np.complex128]


def _transfer(s: System, w: float, H: int) -> tuple[Complex, Complex]:
    """G(j k w) and its derivative by w, (H + 1, outputs, inputs)."""
    k = np.arange(H + 1)
    y = 1j * k[:, None] * w
    (twice_real, square), (r, t) = s.poles, s.numerators
    inverse = 1.0 / (y**2 - twice_real * y + square)
    top = r * y[:, None, None] + t
    G = np.einsum("koip,kp->koi", top, inverse) + s.D
    by_s = np.einsum("oip,kp->koi", r, inverse) - np.einsum("koip,kp->koi", top, inverse**2 * (2 * y - twice_real))
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
    f, j, pair, by = np.zeros(n), np.zeros((n, n)), np.zeros((2, n, n)), np.zeros((2, n))
    kind, coordinate, auxiliary, _ = s.elements
    for e, a in enumerate(coordinate):
        if kind[e] == FORCE_FACTOR:
            b, c = s.parameters[e, 2:4].astype(int)
            alternate_pair_numpy(s.parameters, e, x[b], x[c], s.basis, f, pair)
            F[a] += f
            dF[a, b] += pair[0]
            dF[a, c] += pair[1]
        elif kind[e] != RUNNING_LOSS:
            alternate_numpy(int(kind[e]), s.parameters, e, x[a], s.basis, f, j)
            F[a] += s.scale[e] * f
            dF[a, a] += s.scale[e] * j
    for e, a in enumerate(coordinate):
        if kind[e] != RUNNING_LOSS:
            continue
        flexibility = static[auxiliary[e], 1:]
        running.py_func(s.parameters, e, x[a], float(flexibility @ F[:, 0]), w, f, j, by)
        by_offset, by_omega = by
        by_x = np.einsum("b,bcq->cq", flexibility, dF[:, :, 0])
        F[a] += s.scale[e] * f
        by_w[a] += s.scale[e] * by_omega
        dF[a, a] += s.scale[e] * j
        dF[a] += s.scale[e] * by_offset[:, None] * by_x[:, None, :]
    return F, dF, by_w


def residual(s: System, x: Matrix, drive: SineDrive) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Residual, Jacobian, derivative by w, and forces."""
    n = s.basis.shape[0]
    L, (w, amplitude) = len(x) // n, drive
    G, dG = _transfer(s, w, n // 2)
    F, dF, explicit = _forces(s, x.reshape(L, n), w, G[0].real)
    blocks, d_blocks = _real_blocks(G[:, :L]), _real_blocks(dG[:, :L])
    u = np.zeros((1 + L, n))
    u[0, 2], u[1:] = amplitude, F
    R = x - np.einsum("abij,bj->ai", blocks, u).ravel()
    by_w = -np.einsum("abij,bj->ai", d_blocks, u) - np.einsum("abij,bj->ai", blocks[:, 1:], explicit)
    J = np.eye(len(x)) - np.einsum("abij,bcjq->aicq", blocks[:, 1:], dF).reshape(len(x), len(x))
    return R, J, by_w.ravel(), F


def _drive_slope(s: System, w: float, N: int) -> Matrix:
    """Derivative of the residual by the drive's amplitude, (N,)."""
    n = s.basis.shape[0]
    G, _ = _transfer(s, w, 1)
    slope = np.zeros((N // n, n))
    slope[:, 1], slope[:, 2] = -G[1, : N // n, 0].imag, -G[1, : N // n, 0].real
    return slope.ravel()


def _is_rounding(s: System, x: Matrix, R: Matrix, drive: SineDrive, F: Matrix, size: Matrix) -> bool:
    """Whether a residual is all rounding."""
    L, n = F.shape
    G, _ = _transfer(s, drive.w, n // 2)
    k = (np.arange(n) + 1) // 2
    sizes = (np.abs(G.real) + np.abs(G.imag))[k, :L]
    together = np.abs(F)
    for i in range(1, n, 2):
        together[:, i : i + 2] = together[:, i : i + 2].sum(axis=1, keepdims=True)
    total = np.abs(x).reshape(L, n) + np.einsum("iab,bi->ai", sizes[:, :, 1:], together)
    total[:, 1:3] += sizes[1:3, :, 0].T * drive.amplitude
    return bool(np.linalg.norm(R / size) <= np.linalg.norm(ROUNDING * total.ravel() / size))


def _measure(x: Matrix, largest: Matrix) -> Matrix:
    """Sizes of the coordinates, each coordinate's at all its unknowns, (N,); `largest`, (locals,), is kept up."""
    L = len(largest)
    own = np.linalg.norm(x.reshape(L, -1), axis=1)
    largest[:] = np.maximum(largest, own)
    size = np.maximum(own, np.maximum(FADED * largest, 1e-9 * largest.max()))
    return np.repeat(np.where(size > 0, size, 1.0) * np.sqrt(L), len(x) // L)


def newton(
    s: System, x: Matrix, drive: SineDrive, tolerance: float, most: int, contraction: float, F: Matrix
) -> tuple[int, int, float]:
    """As the compiled one."""
    largest, last = np.zeros(len(F)), np.empty(0)
    for iteration in range(most + 1):
        R, J, _, F[:] = residual(s, x, drive)
        size = _measure(x, largest)
        left = float(np.linalg.norm(R / size))
        if left <= tolerance:
            return FOUND, iteration, left
        step = _solve(J, R)
        if not (np.isfinite(left) and np.isfinite(step).all()):
            return NOT_FINITE, iteration, left
        allowed = contraction if iteration == 1 else max(contraction, CONTRACTION)
        if iteration > 0 and np.linalg.norm(step / size) > allowed * np.linalg.norm(last / size):
            return FOUND if _is_rounding(s, x, R, drive, F, size) else FAR, iteration, left
        x -= step
        last = step
    return LONG, most, left


def _solve(A: Matrix, b: Matrix) -> Matrix:
    """Nothing finite where there is no solution, as elimination leaves it."""
    try:
        return np.asarray(np.linalg.solve(A, b))
    except np.linalg.LinAlgError:
        return np.full_like(b, np.nan)


def _advance(
    s: System,
    z: Matrix,
    tangent: Matrix,
    size: Matrix,
    span: float,
    h: float,
    kink: bool,
    held: float,
    unit: Matrix | None,
    tolerance: float,
    most: int,
    F: Matrix,
) -> tuple[int, float]:
    """One step of arclength along the branch, in place; the corrections it took, or -1, and the first contraction."""
    z += h * tangent
    way, contraction, last = tangent, 0.0, h
    own, largest = size, np.zeros(len(F))
    for iteration in range(most + 1):
        x = z[:-1] * size
        drive = SineDrive(z[-1] * span, held) if unit is None else SineDrive(held, z[-1] * span)
        R, J, by_w, F[:] = residual(s, x, drive)
        if iteration:
            own = _measure(x, largest)
            if np.linalg.norm(R / own) < tolerance:
                tangent[:] = way
                return iteration, contraction
        slope = by_w if unit is None else unit
        slopes = np.vstack([np.column_stack([J * size, slope * span]) / size[:, None], tangent])
        right = np.zeros((len(z), 2))
        right[:-1, 0], right[-1, 1] = R / size, 1.0
        correction, ahead = _solve(slopes, right).T
        length = float(np.linalg.norm(correction))
        if not np.isfinite(length):
            return -1, contraction
        if length > (BEND * h if kink else (CONTRACTION if iteration else 1.0) * last):
            if iteration and _is_rounding(s, x, R, drive, F, own):
                tangent[:] = way
                return iteration, contraction
            return -1, contraction
        if iteration == 1:
            contraction = min(length / last, AIM) if kink else length / last
        last = length
        z -= correction
        way = ahead / np.linalg.norm(ahead)
    return -1, contraction


def follow(
    s: System, start: Matrix, course: Course, X: Matrix, P: Matrix, F: Matrix, iterations: NDArray[np.int64]
) -> tuple[int, int]:
    """As the compiled one."""
    begin, end, held, by_drive, span, step, landing, tolerance, corrections = course
    low, high = sorted((begin, end))
    h, target, largest = step / 10, end / span, np.zeros(F.shape[1])
    unit = _drive_slope(s, held, len(start)) if by_drive else None
    _, J, by_w, force = residual(s, start, SineDrive(held, begin) if by_drive else SineDrive(begin, held))
    size = _measure(start, largest)
    slope = by_w if unit is None else unit
    heading = np.append(np.zeros(len(start)), np.sign(end - begin))
    slopes = np.vstack([np.column_stack([J * size, slope * span]) / size[:, None], heading])
    tangent = _solve(slopes, np.append(np.zeros(len(start)), 1.0))
    tangent /= np.linalg.norm(tangent)
    if not np.isfinite(tangent).all():
        return NOT_FINITE, 0
    z = np.append(start / size, begin / span)
    count, rejected = 0, 0
    while count < len(P):
        if h < SHORTEST * step:
            return STALLED, count
        if rejected > 2 * len(P):
            return LONG, count
        trial, way = z.copy(), tangent.copy()
        kink = h < KINK * step
        corrected, contraction = _advance(s, trial, way, size, span, h, kink, held, unit, tolerance, corrections, force)
        refused = corrected < 0 or (float(way @ tangent) < LEAST_TURN and not kink)
        if not refused and landing:
            before, after = z[-1] - target, trial[-1] - target
            if before * after <= 0:
                x = (z + before / (before - after) * (trial - z))[:-1] * size
                at = SineDrive(held, end) if by_drive else SineDrive(end, held)
                near = BEND if kink else CONTRACTION
                outcome, steps, _ = newton(s, x, at, tolerance, corrections, near, force)
                if outcome == FOUND:
                    X[count], P[count], F[count], iterations[count] = x, end, force, steps
                    return FOUND, count + 1
                refused = True
            elif not kink:
                refused = turns_beyond.py_func(z[-1], tangent[-1], way[-1], h, target)
        if refused:
            h /= 2
            rejected += 1
            continue
        z, tangent = trial, way
        if not landing and not low <= z[-1] * span <= high:
            return ENDED, count
        x = z[:-1] * size
        X[count], P[count], F[count], iterations[count] = x, z[-1] * span, force, corrected
        count += 1
        new_size = _measure(x, largest)
        z[:-1] = x / new_size
        tangent[:-1] *= size / new_size
        tangent /= np.linalg.norm(tangent)
        size = new_size
        h = min(step, h * min(1.5, max(0.5, float(np.sqrt(AIM / max(contraction, 1e-6))))))
    return LONG, count


def alternate_numpy(kind: int, p: Matrix, row: int, c: Matrix, basis: Matrix, F: Matrix, J: Matrix) -> None:
    """The plain twin of the compiled kernels: the same sums as matrix products, in steps only where there is memory."""
    n, samples = basis.shape
    weight = basis * np.where(np.arange(n) == 0, 1.0, 2.0)[:, None] / samples
    e, phi = c @ basis, basis.T
    state = np.zeros((p.shape[0], 2))
    f, d = np.zeros(samples), np.zeros((samples, n))
    old, start = 0.0, np.zeros(n)
    if kind == SLIDERS:
        count = int(p[row, 0])
        k, limit = p[row, 1 : 1 + 2 * count : 2], p[row, 2 : 2 + 2 * count : 2]
        force, slope = np.zeros(count), np.zeros((count, n))
        for t in [*range(samples)] * 2:
            trial = force + k * (e[t] - old)
            stuck = np.abs(trial) <= limit
            force = np.clip(trial, -limit, limit)
            slope = np.where(stuck[:, None], slope + k[:, None] * (phi[t] - start), 0.0)
            f[t], d[t] = force.sum(), slope.sum(axis=0)
            old, start = e[t], phi[t]
    elif kind == POLYNOMIAL:
        travel = max(p[row, 0], 1e-300)
        direction, turn = 0.0, np.zeros(n)
        for t in [*range(samples)] * 2:
            state[row, :2] = old, direction
            f[t], tangent = evaluate.py_func(kind, p, state, row, e[t])
            trial = direction + (e[t] - old) / travel
            move = (phi[t] - start) / travel
            stuck = abs(trial) < 1.0
            fixed = loss_gain.py_func(p, row, abs(e[t])) * (turn - start / travel) if stuck else 0.0
            d[t] = tangent * phi[t] + fixed
            turn = turn + move if stuck else np.zeros(n)
            direction, old, start = float(np.clip(trial, -1.0, 1.0)), e[t], phi[t]
    elif kind == FUNCTIONS and p[row, 1]:
        step = BESIDE * max(np.max(np.abs(e)), 1e-30)
        paths, forces = np.vstack([e, e + step * basis]), np.zeros((n + 1, samples))
        for path, one in zip(paths, forces, strict=True):
            memory, before = np.zeros((p.shape[0], int(p[row, 2]))), np.inf
            for period in range(MOST_PERIODS):
                if period > 1 and np.all(np.abs(memory[row] - before) < SETTLED * np.abs(memory[row])):
                    break
                before = memory[row].copy()
                for t in range(samples):
                    one[t] = evaluate.py_func(kind, p, memory, row, path[t])[0]
                    remember.py_func(kind, p, memory, row, path[t], 0.0, 0.0)
        f, d = forces[0], (forces[1:] - forces[0]).T / step
    else:
        pairs = np.array([evaluate.py_func(kind, p, state, row, value) for value in e])
        f, d = pairs[:, 0], pairs[:, 1, None] * phi
    F[:], J[:] = weight @ f, weight @ d


def alternate_pair_numpy(p: Matrix, row: int, x: Matrix, z: Matrix, basis: Matrix, F: Matrix, J: Matrix) -> None:
    """The plain twin of :func:`alternate_pair`."""
    n, samples = basis.shape
    weight = basis * np.where(np.arange(n) == 0, 1.0, 2.0)[:, None] / samples
    pairs = zip(x @ basis, z @ basis, strict=True)
    f, slope_x, slope_z = np.array([lost_force.py_func(p, row, *pair) for pair in pairs]).T
    F[:], J[0], J[1] = weight @ f, (weight * slope_x) @ basis.T, (weight * slope_z) @ basis.T


class PlainBalance(HarmonicBalance):
    """Solved by the functions of this file."""

    _kernel = sys.modules[__name__]


BALANCES = {"compiled": HarmonicBalance, "plain": PlainBalance}
