"""Marching in time: each mode exactly between samples (Nigam and Jennings), local elements by Newton's method.

Forces are linear between samples.  The local elements' forces at the new sample act already within the step, so that
they neither feed nor take energy by being late.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tests.second_bench.mechanics.laws import Kind, element_force
from tests.second_bench.mechanics.structure import Modes

Array = NDArray[np.float64]

CLOSE = 1e-5
"""Of an element's own largest motion so far: Newton's next iterate is then as near as doubles can say."""
ITERATIONS = 100
FULL_STEPS = 8
"""Of Newton's; later ones go half way, which ends a walk to and fro across the kink where a slip turns."""

SAMPLES_A_PERIOD = 4
"""Fewer do not follow a mode; it then only yields as a spring does."""
SOON_AT_REST = 0.2
"""Damping ratio of such modes."""


def recurrence(omega: Array, damping: Array, step_s: float) -> Array:
    """Coefficients that carry an oscillator over a step under a force that is linear in it, (8, n).

    With g the force per mass before and after,

        q1 = c0 q + c1 p + c2 g0 + c3 g1,   p1 = c4 q + c5 p + c6 g0 + c7 g1.

    Parameters
    ----------
    omega, damping : ndarray, (n,)
        rad/s, and ratios below one.
    step_s
        s.
    """
    w, z, h = omega, damping, step_s
    wd = w * np.sqrt(1 - z**2)
    decay, s, c = np.exp(-z * w * h), np.sin(wd * h), np.cos(wd * h)
    a11, a12 = decay * (c + z * w / wd * s), decay * s / wd
    a21, a22 = -(w**2) * a12, decay * (c - z * w / wd * s)
    # The particular solution of g0 + (g1 - g0) t / h is a line; what it misses at the start decays as the mode does.
    k, lag = w**2, 2 * z / w
    start0, slope0 = (1 + lag / h) / k, -1 / (h * k)
    start1, slope1 = -lag / h / k, 1 / (h * k)
    b11 = start0 + slope0 * h - a11 * start0 - a12 * slope0
    b12 = start1 + slope1 * h - a11 * start1 - a12 * slope1
    b21 = slope0 - a21 * start0 - a22 * slope0
    b22 = slope1 - a21 * start1 - a22 * slope1
    return np.array([a11, a12, b11, b12, a21, a22, b21, b22])


def followed(modes: Modes, rate_Hz: float) -> Array:
    """Damping ratios with which a march at a rate is sound, (n,): what it cannot follow comes to rest soon.

    Undamped, such modes ring between the samples with the friction's kinks until all is lost.
    """
    fast = modes.omega > 2 * np.pi * rate_Hz / SAMPLES_A_PERIOD
    return np.where(fast, np.maximum(modes.damping, SOON_AT_REST), modes.damping)


@dataclass(eq=False)
class State:
    """Where a march stands; a march changes it.

    Attributes
    ----------
    q, p, g : ndarray, (n,)
        Modal displacements, velocities and forces.
    y, memory, reach : ndarray, (3, e), (e,) and (e,)
        The elements' motion, now and one and two samples ago; their memories, of force or grip, and of how far they
        lately slipped.
    time_s
        Since the start.
    """

    q: Array
    p: Array
    g: Array
    y: Array
    memory: Array
    reach: Array
    time_s: float = 0.0


def at_rest(modes: Modes) -> State:
    """Nothing moves."""
    n, e = len(modes.omega), len(modes.kinds)
    return State(np.zeros(n), np.zeros(n), np.zeros(n), np.zeros((3, e)), np.zeros(e), np.zeros(e))


def march(modes: Modes, state: State, force: Array, rate_Hz: float, *, layer: float = 1.0, all_moduli: float = 1.0):
    """Go on under a force.

    Parameters
    ----------
    modes
        Of the linear structure.
    state
        Where it stands; carried on.
    force : ndarray, (t,)
        At the drive, N.
    rate_Hz
        Samples a second.
    layer, all_moduli
        Factors on the layer's normal modulus and on all moduli, the layer's among them.

    Returns
    -------
    ndarray, (s, t)
        Acceleration of the sensors, m/s2.

    Raises
    ------
    ArithmeticError
        If the elements' forces find no balance.
    """
    step_s = 1.0 / rate_Hz
    omega = modes.omega * np.sqrt(all_moduli)
    damping = followed(modes, rate_Hz)
    c = recurrence(omega, damping, step_s)
    of_velocity = np.array([Kind(kind).of_velocity for kind in modes.kinds])
    gain = np.where(of_velocity[:, None], modes.elements * c[7], modes.elements * c[3]) @ modes.elements.T
    scale = np.where(modes.kinds == Kind.SOFTENING, layer, 1.0)
    # The linear structure holds the layer at rest; the factor on all moduli has gone into the modes for that part.
    parameters = modes.parameters.copy()
    for kind, shape in ((Kind.SOFTENING, 6), (Kind.RIDING_FRICTION, 4)):
        parameters[modes.kinds == kind, shape] *= all_moduli
        parameters[modes.kinds == kind, 0] *= all_moduli
    accelerations = np.empty((len(modes.sensors), len(force)))
    failed = _march(
        c, omega**2, 2 * damping * omega, modes.drive, modes.sensors, modes.elements, of_velocity,
        gain + modes.residual / all_moduli, modes.kinds, parameters, scale,
        state.q, state.p, state.g, state.y, state.memory, state.reach, force, state.time_s, step_s, accelerations,
    )  # fmt: skip
    state.time_s += len(force) * step_s
    if failed >= 0:
        raise ArithmeticError(f"the local elements found no balance at {state.time_s:g} s")
    return accelerations


@njit(cache=True, fastmath={"reassoc", "contract", "arcp", "nsz"})
def _solve(A, b):
    """Solve A x = b in place, without pivots: a flexibility times a stiffness, plus one, needs none."""
    n = len(b)
    for i in range(n):
        for r in range(i + 1, n):
            factor = A[r, i] / A[i, i]
            if factor != 0.0:
                for j in range(i + 1, n):
                    A[r, j] -= factor * A[i, j]
                b[r] -= factor * b[i]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            b[i] -= A[i, j] * b[j]
        b[i] /= A[i, i]


@njit(cache=True, fastmath={"reassoc", "contract", "arcp", "nsz"})
def _march(
    c, square, loss, drive, sensors, rows, of_velocity, gain, kinds, parameters, scale,
    q, p, g, y, memory, reach, force, time_s, step_s, accelerations,
):  # fmt: skip
    """March; the index of the sample without balance, or -1."""
    n, e = len(q), len(kinds)
    known, f, slope, kept = np.empty(e), np.empty(e), np.empty(e), np.empty((2, e))
    new, A, b = np.empty(e), np.empty((e, e)), np.empty(e)
    q1, p1 = np.empty(n), np.empty(n)
    largest = np.abs(y[0])
    for t in range(len(force)):
        now = time_s + (t + 1) * step_s
        for m in range(n):
            drive_force = drive[m] * force[t]
            q1[m] = c[0, m] * q[m] + c[1, m] * p[m] + c[2, m] * g[m] + c[3, m] * drive_force
            p1[m] = c[4, m] * q[m] + c[5, m] * p[m] + c[6, m] * g[m] + c[7, m] * drive_force
        for i in range(e):
            known[i] = 0.0
            for m in range(n):
                known[i] += rows[i, m] * (p1[m] if of_velocity[i] else q1[m])
            new[i] = 3 * (y[0, i] - y[1, i]) + y[2, i]
        balanced = False
        for iteration in range(ITERATIONS):
            for i in range(e):
                f[i], slope[i], kept[0, i], kept[1, i] = element_force(
                    kinds[i], parameters[i], new[i], y[0, i], memory[i], reach[i], now, scale[i]
                )
            for i in range(e):
                b[i] = known[i] - new[i]
                for j in range(e):
                    b[i] -= gain[i, j] * f[j]
                    A[i, j] = gain[i, j] * slope[j]
                A[i, i] += 1.0
            _solve(A, b)
            balanced = True
            for i in range(e):
                new[i] += b[i] if iteration < FULL_STEPS else b[i] / 2
                largest[i] = max(largest[i], abs(new[i]))
                if not abs(b[i]) <= CLOSE * largest[i]:  # nor is what is no number
                    balanced = False
            if balanced:
                break
        if not balanced:
            return t
        for i in range(e):
            f[i] += slope[i] * b[i]
            memory[i], reach[i] = kept[0, i], kept[1, i]
            y[2, i], y[1, i], y[0, i] = y[1, i], y[0, i], new[i]
        for m in range(n):
            from_elements = 0.0
            for i in range(e):
                from_elements -= rows[i, m] * f[i]
            g[m] = drive[m] * force[t] + from_elements
            q[m] = q1[m] + c[3, m] * from_elements
            p[m] = p1[m] + c[7, m] * from_elements
        for s in range(len(sensors)):
            total = 0.0
            for m in range(n):
                total += sensors[s, m] * (g[m] - loss[m] * p[m] - square[m] * q[m])
            accelerations[s, t] = total
    return -1
