"""Harmonic balance compiled: the residual with its exact slopes by the unknowns, the frequency and the drive."""

import numpy as np

from twin.arrays import Array
from twin.joint.calling import call_kernel
from twin.joint.kernel import COMPILED, INNER
from twin.joint.kinds import FORCE_FACTOR, RUNNING_LOSS
from twin.response.system import SineDrive, System

ROUNDING = 1e3 * float(np.finfo(float).eps)
"""What rounding may leave of a residual, over the sum of the sizes of its terms."""


@INNER
def transfer(s: System, w: float, G: Array, dG: Array) -> None:
    """Real and imaginary parts of G(j k w) and of its derivative by w, (harmonics + 1, 2, outputs, inputs)."""
    poles = s.poles.shape[1]
    inverse, by_s = np.empty((2, poles)), np.empty((2, poles))
    for k in range(G.shape[0]):
        y = k * w
        for p in range(poles):
            a, b = s.poles[1, p] - y * y, -s.poles[0, p] * y
            scale = 1.0 / (a * a + b * b)
            u, v = a * scale, -b * scale
            inverse[0, p], inverse[1, p] = u, v
            # (2 s - 2 Re lambda) / d^2
            real, imaginary = u * u - v * v, 2.0 * u * v
            by_s[0, p] = -s.poles[0, p] * real - 2.0 * y * imaginary
            by_s[1, p] = -s.poles[0, p] * imaginary + 2.0 * y * real
        for o in range(s.D.shape[0]):
            for i in range(s.D.shape[1]):
                re, im, d_re, d_im = s.D[o, i], 0.0, 0.0, 0.0
                for p in range(poles):
                    t, ry = s.numerators[1, o, i, p], s.numerators[0, o, i, p] * y
                    re += t * inverse[0, p] - ry * inverse[1, p]
                    im += t * inverse[1, p] + ry * inverse[0, p]
                    d_re += s.numerators[0, o, i, p] * inverse[0, p] - t * by_s[0, p] + ry * by_s[1, p]
                    d_im += s.numerators[0, o, i, p] * inverse[1, p] - t * by_s[1, p] - ry * by_s[0, p]
                G[k, 0, o, i], G[k, 1, o, i] = re, im
                dG[k, 0, o, i], dG[k, 1, o, i] = -k * d_im, k * d_re


@INNER
def _add(into: Array, row: int, scale: float, what: Array) -> None:
    """A multiple of a row."""
    for i in range(what.shape[0]):
        into[row, i] += scale * what[i]


@INNER
def _add_block(into: Array, a: int, b: int, scale: float, what: Array) -> None:
    """A multiple of a matrix."""
    for i in range(what.shape[0]):
        for q in range(what.shape[1]):
            into[a, b, i, q] += scale * what[i, q]


@INNER
def forces(s: System, x: Array, w: float, static: Array, F: Array) -> tuple[Array, Array, Array]:
    """Coefficients of the local forces and their derivatives.

    Parameters
    ----------
    x : ndarray, (locals, n)
        Coefficients of the local coordinates.
    static : ndarray, (outputs, inputs)
        G at zero frequency.
    F : ndarray, (locals, n)
        Filled.

    Returns
    -------
    dF, by_w, met : ndarray, (locals, locals, n, n), (locals, n), (locals, locals)
        Of force a by coordinate b; the explicit dependence on w; whether force a depends on coordinate b.
    """
    locals_, n = x.shape
    for a in range(locals_):
        for i in range(n):
            F[a, i] = 0.0
    dF, by_w, met = np.zeros((locals_, locals_, n, n)), np.zeros((locals_, n)), np.zeros((locals_, locals_))
    kind, coordinate, auxiliary, kernel = s.elements[0], s.elements[1], s.elements[2], s.elements[3]
    f, j, pair, by = np.zeros(n), np.zeros((n, n)), np.zeros((2, n, n)), np.zeros((2, n))
    for e in range(kind.shape[0]):
        a = coordinate[e]
        if kind[e] == FORCE_FACTOR:
            b, c = int(s.parameters[e, 2]), int(s.parameters[e, 3])
            call_kernel(kernel[e], None, (s.parameters, e, x[b], x[c], s.basis, f, pair))
            _add(F, a, 1.0, f)
            _add_block(dF, a, b, 1.0, pair[0])
            _add_block(dF, a, c, 1.0, pair[1])
            met[a, b] = met[a, c] = 1.0
        elif kind[e] != RUNNING_LOSS:
            call_kernel(kernel[e], None, (kind[e], s.parameters, e, x[a], s.basis, f, j))
            _add(F, a, s.scale[e], f)
            _add_block(dF, a, a, s.scale[e], j)
            met[a, a] = 1.0
    # The running means hold the displacement's static part, which the forces above make.
    for e in range(kind.shape[0]):
        if kind[e] == RUNNING_LOSS:
            a, row = coordinate[e], auxiliary[e]
            offset = 0.0
            for b in range(locals_):
                offset += static[row, 1 + b] * F[b, 0]
            call_kernel(kernel[e], None, (s.parameters, e, x[a], offset, w, f, j, by))
            _add(F, a, s.scale[e], f)
            _add(by_w, a, s.scale[e], by[1])
            _add_block(dF, a, a, s.scale[e], j)
            met[a, a] = 1.0
            if offset != 0.0:
                for b in range(locals_):
                    for c in range(locals_):
                        if met[b, c] > 0.0:
                            met[a, c] = 1.0
                            for i in range(n):
                                for q in range(n):
                                    dF[a, c, i, q] += s.scale[e] * by[0, i] * static[row, 1 + b] * dF[b, c, 0, q]
    return dF, by_w, met


@COMPILED
def residual(s: System, x: Array, drive: SineDrive, R: Array, J: Array, by_w: Array, F: Array) -> None:
    """Residual (N,), its Jacobian (N, N) and derivative by w (N,), and the forces (locals, n), for unknowns x, (N,)."""
    n = s.basis.shape[0]
    locals_, (w, amplitude) = x.shape[0] // n, drive
    G = np.empty((n // 2 + 1, 2, s.D.shape[0], s.D.shape[1]))
    dG = np.empty_like(G)
    call_kernel(s.at.transfer, transfer, (s, w, G, dG))
    dF, explicit, met = call_kernel(s.at.forces, forces, (s, x.reshape(locals_, n), w, G[0, 0], F))
    for i in range(x.shape[0]):
        R[i] = x[i]
        by_w[i] = 0.0
        for q in range(x.shape[0]):
            J[i, q] = 1.0 if i == q else 0.0
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
def drive_slope(s: System, w: float, slope: Array) -> None:
    """Derivative of the residual by the drive's amplitude, (N,): less the linear response to a unit drive."""
    n = s.basis.shape[0]
    G = np.empty((2, 2, s.D.shape[0], s.D.shape[1]))
    call_kernel(s.at.transfer, transfer, (s, w, G, np.empty_like(G)))
    for i in range(slope.shape[0]):
        slope[i] = 0.0
    for a in range(slope.shape[0] // n):
        slope[a * n + 1], slope[a * n + 2] = -G[1, 1, a, 0], -G[1, 0, a, 0]


@INNER
def rounding(s: System, x: Array, drive: SineDrive, F: Array, least: Array) -> None:
    """What rounding may leave in each component of the residual, (N,), for unknowns x and the forces F they make."""
    n = s.basis.shape[0]
    locals_ = F.shape[0]
    G = np.empty((n // 2 + 1, 2, s.D.shape[0], s.D.shape[1]))
    call_kernel(s.at.transfer, transfer, (s, drive.w, G, np.empty_like(G)))
    for a in range(locals_):
        for i in range(n):
            k = (i + 1) // 2
            total = abs(x[a * n + i])
            if k == 1:
                total += (abs(G[1, 0, a, 0]) + abs(G[1, 1, a, 0])) * drive.amplitude
            for b in range(locals_):
                size = abs(F[b, 0]) if k == 0 else abs(F[b, 2 * k - 1]) + abs(F[b, 2 * k])
                total += (abs(G[k, 0, a, 1 + b]) + abs(G[k, 1, a, 1 + b])) * size
            least[a * n + i] = ROUNDING * total
