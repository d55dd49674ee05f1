"""The bench's scheme of marching written by hand in numba, once for one saturating law and once for Jenkins elements.

First-order hold of the poles, local forces implicit at the end of each step; what a specialist would write for one rig.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from twin.bench.marching import Coefficients

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

COMPILED = njit(cache=True, fastmath=True, error_model="numpy")


def march_saturating(c: Coefficients, k: float, e0: float, drive: Array) -> Array:
    """The shown channel, (count,), of a rig with one saturating law, ``f = k e / sqrt(1 + (e/e0)^2)``."""
    pole, Gamma, C = (_split(each) for each in (c.decay, c.Gamma.T, c.C))
    out = np.empty(len(drive))
    _saturating(*pole, *Gamma, *C, c.D, k, e0, drive, out)
    return out


def march_jenkins(c: Coefficients, stiffness: float, slip: float, drive: Array) -> Array:
    """The shown channel, (count,), of a rig with equal Jenkins elements."""
    pole, Gamma, C = (_split(each) for each in (c.decay, c.Gamma.T, c.C))
    out = np.empty(len(drive))
    assert _jenkins(*pole, *Gamma, *C, np.ascontiguousarray(c.D), stiffness, slip, drive, out) == 0
    return out


def _split(values: Complex) -> tuple[Array, Array]:
    return np.ascontiguousarray(values.real), np.ascontiguousarray(values.imag)


@COMPILED
def _saturating(
    a: Array, b: Array, gr: Array, gi: Array, cr: Array, ci: Array, D: Array, k: float, e0: float, drive: Array,
    out: Array,
) -> None:  # fmt: skip
    poles = a.shape[0]
    x, z = np.zeros(poles), np.zeros(poles)
    e, before, earlier, H, size = 0.0, 0.0, 0.0, D[0, 1], 1e-30
    for n in range(drive.shape[0]):
        u = drive[n]
        free, shown = D[0, 0] * u, D[1, 0] * u
        for p in range(poles):
            free += cr[0, p] * x[p] - ci[0, p] * z[p]
            shown += cr[1, p] * x[p] - ci[1, p] * z[p]
        e, earlier, before = 3.0 * (e - before) + earlier, before, e
        size = max(0.9995 * size, abs(before))
        force = 0.0
        for _ in range(100):
            q = 1.0 / (1.0 + (e / e0) * (e / e0))
            root = np.sqrt(q)
            force, slope = k * root * e, k * q * root
            step = (e - free - H * force) / (1.0 - H * slope)
            e -= step
            if abs(step) < 1e-4 * size:
                force -= slope * step
                break
        out[n] = shown + D[1, 1] * force
        for p in range(poles):
            real = a[p] * x[p] - b[p] * z[p] + gr[0, p] * u + gr[1, p] * force
            z[p] = a[p] * z[p] + b[p] * x[p] + gi[0, p] * u + gi[1, p] * force
            x[p] = real


@COMPILED
def _jenkins(
    a: Array, b: Array, gr: Array, gi: Array, cr: Array, ci: Array, D: Array, k: float, slip: float, drive: Array,
    out: Array,
) -> int:  # fmt: skip
    poles, places = a.shape[0], D.shape[1] - 1
    x, z = np.zeros(poles), np.zeros(poles)
    free, e, old, held, force = (
        np.zeros(places), np.zeros(places), np.zeros(places), np.zeros(places), np.zeros(places)
    )  # fmt: skip
    J, r, sticks, failures = np.zeros((places, places)), np.zeros(places), np.zeros(places, np.bool_), 0
    for n in range(drive.shape[0]):
        u = drive[n]
        shown = D[places, 0] * u
        for p in range(poles):
            shown += cr[places, p] * x[p] - ci[places, p] * z[p]
        for i in range(places):
            free[i] = D[i, 0] * u
            for p in range(poles):
                free[i] += cr[i, p] * x[p] - ci[i, p] * z[p]
        failures += 1
        for iteration in range(30):
            changed = iteration == 0
            for i in range(places):
                trial = held[i] + k * (e[i] - old[i])
                stuck = abs(trial) <= slip
                changed = changed or stuck != sticks[i]
                sticks[i] = stuck
                force[i] = trial if stuck else np.copysign(slip, trial)
            if not changed:
                failures -= 1
                break
            # Once the states are known the equations are linear: one solution by LAPACK.
            for i in range(places):
                r[i] = free[i]
                for j in range(places):
                    J[i, j] = -D[i, 1 + j] * k if sticks[j] else 0.0
                    r[i] += D[i, 1 + j] * (held[j] - k * old[j] if sticks[j] else force[j])
                J[i, i] += 1.0
            e[:] = np.linalg.solve(J, r)
        for i in range(places):
            old[i], held[i] = e[i], force[i]
            shown += D[places, 1 + i] * force[i]
        out[n] = shown
        for p in range(poles):
            real, imaginary = a[p] * x[p] - b[p] * z[p] + gr[0, p] * u, a[p] * z[p] + b[p] * x[p] + gi[0, p] * u
            for i in range(places):
                real += gr[1 + i, p] * force[i]
                imaginary += gi[1 + i, p] * force[i]
            x[p], z[p] = real, imaginary
    return failures
