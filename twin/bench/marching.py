"""Time marching of the rig: poles under first-order hold, local forces solved implicitly at the end of each step.

With z = lambda h, phi1 = (e^z - 1)/z, phi2 = (e^z - 1 - z)/z^2 and w the poles' states less their share of the newest
input, one step is

    y = Re(C w) + (D + Re(C G1)) u,   w <- e^z w + Gamma u,   G1 = h phi2 B,  Gamma = h (phi1 - phi2) B + e^z G1

and the local coordinates solve  y = p + H f(y)  by Newton.  The linear part is exact for inputs that are straight
between samples; an explicit or held joint force instead would add false damping.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from twin.arrays import Array
from twin.bench.force_factor import lost_force
from twin.bench.limits import LIMITS
from twin.bench.linear import Poles
from twin.bench.many_places import correct
from twin.joint.calling import address, call_kernel
from twin.joint.elimination import eliminate
from twin.joint.kernel import COMPILED, INNER, evaluate, remember
from twin.joint.kinds import FORCE_FACTOR, FUNCTIONS, HINGES, POLYNOMIAL, SLIDERS

TOLERANCE = 1e-10
"""Residual of the local equations over the recent size of each coordinate."""
SMALL_STEP = 1e-4
"""Newton step over the recent size after which a smooth law counts as solved."""
FORGET = 0.9995
"""How the recent size decays, a step."""
ITERATIONS = 100
"""Newton steps, and trials of shorter ones, before a step counts as failed; two or three are usual."""
SHORTEST = 0.01
"""Of a Newton step over kinks."""
KINKED = {SLIDERS, HINGES, POLYNOMIAL, FORCE_FACTOR, FUNCTIONS}
"""Laws that may have kinks, over which a step of Newton's may have to be shortened."""
MANY = LIMITS.many_from
"""Local coordinates from which on kinked laws are corrected by what changed, :mod:`twin.bench.many_places`."""


@dataclass(frozen=True)
class Coefficients:
    """One step of size `step_s`: outputs are the local coordinates first, then auxiliary rows, then channels."""

    step_s: float
    decay: Array
    Gamma: Array
    G1: Array
    C: Array
    D: Array

    def packed(self, locals_: int, auxiliaries: int, *, rows: int | None = None) -> Step:
        """The same for the compiled integration; of the outputs, the first `rows` alone if given."""
        C, D = self.C[:rows], np.ascontiguousarray(self.D[:rows])
        return Step(self.step_s, packed(self.decay), packed(self.Gamma.T), packed(C.conj()), D, locals_, auxiliaries)


class Step(NamedTuple):
    """What :func:`integrate` takes of one step: real arrays, padded to whole vectors of m / 2 poles."""

    step_s: float
    decay: Array
    """Real parts of e^z, then imaginary parts, (m,)."""
    Gamma: Array
    """Likewise, (inputs, m)."""
    C: Array
    """Real parts, then minus the imaginary parts, (outputs, m)."""
    D: Array
    """Of the step, not of the rig, (outputs, inputs)."""
    locals_: int
    auxiliaries: int
    """How many of the outputs are local coordinates, and how many auxiliary rows follow them."""


class Elements(NamedTuple):
    """Nonlinear elements as arrays: which law, on which local coordinate, with which auxiliary output (or -1).

    `parameters` and `state` have one row an element; the force on the coordinate is `scale` times the law's.  A force
    factor's row also names the two coordinates that it depends on.
    """

    kind: Array
    coordinate: Array
    auxiliary: Array
    scale: Array
    parameters: Array
    state: Array


def coefficients(poles: Poles, step_s: float) -> Coefficients:
    """Exact propagation over one step under first-order hold."""
    z = poles.pole * step_s
    e = np.exp(z)
    small = np.abs(z) < 1e-3
    safe = np.where(small, 1.0, z)
    phi1 = np.where(small, 1 + z / 2 + z**2 / 6 + z**3 / 24, (e - 1) / safe)
    phi2 = np.where(small, 0.5 + z / 6 + z**2 / 24 + z**3 / 120, (e - 1 - z) / safe**2)
    G1 = (step_s * phi2)[:, None] * poles.B
    Gamma = (step_s * (phi1 - phi2))[:, None] * poles.B + e[:, None] * G1
    D = poles.D + (poles.C @ G1).real
    return Coefficients(step_s, e, Gamma, G1, poles.C, D)


def packed(poles: Array) -> Array:
    """Real parts, then imaginary parts, of poles along the last axis, each with zeros up to whole vectors."""
    n = poles.shape[-1]
    found = np.zeros((*poles.shape[:-1], 2, n + -n % LIMITS.marching_lanes))
    found[..., 0, :n], found[..., 1, :n] = poles.real, poles.imag
    return found.reshape(*poles.shape[:-1], 2 * found.shape[-1])


def integrate(step: Step, elements: Elements, w: Array, y: Array, u: Array, voltage: Array, out: Array) -> int:
    """March over the samples of `voltage`; `w`, `y`, `u` and the elements' states are moved on in place.

    Parameters
    ----------
    w : ndarray, (m,)
        States, real parts, then imaginary parts.
    y : ndarray, (locals,)
        Last local coordinates, the first guess.
    u : ndarray, (1 + locals,)
        Last inputs, filled.
    voltage : ndarray, (count,)
        Generator.
    out : ndarray, (count, channels)
        Filled.

    Returns
    -------
    int
        Newton solves that did not converge.
    """
    smooth, couple_at = KINKED.isdisjoint(elements.kind.tolist()), couple_address(elements)
    correct_at = correct_address() if step.locals_ >= MANY and not smooth and couple_at == 0 else 0
    return int(_integrate(step, elements, w, y, u, voltage, out, smooth, couple_at, correct_at))


@COMPILED
def _integrate(
    step: Step, elements: Elements, w: Array, y: Array, u: Array, voltage: Array, out: Array, smooth: bool,
    couple_at: int, correct_at: int,
) -> int:  # fmt: skip
    """The same, given whether no law has kinks, and where kernels are that few rigs need, or nothing."""
    step_s, decay, Gamma, C, D, locals_, auxiliaries = step
    kind, coordinate, auxiliary, scale, parameters, state = elements
    m, inputs = w.shape[0], locals_ + 1
    half = m // 2
    first = locals_ + auxiliaries
    channels = out.shape[1]
    p = np.zeros(locals_)
    tangent = np.zeros(locals_)
    r = np.zeros(locals_)
    J = np.zeros((locals_, locals_))
    before, earlier, size = np.empty(locals_), np.empty(locals_), np.empty(locals_)
    for a in range(locals_):
        before[a], earlier[a], size[a] = y[a], y[a], abs(y[a])
    coupled, many = couple_at != 0, correct_at != 0
    cross = np.zeros((locals_, locals_))
    kept, S = np.zeros(locals_), np.zeros((locals_, locals_))
    origin, move, length, last = np.zeros(locals_), np.zeros(locals_), 1.0, 0.0
    outputs = first + channels
    free = np.zeros(outputs)
    failures = 0
    for n in range(voltage.shape[0]):
        u[0] = voltage[n]
        for a in range(outputs):
            total = 0.0
            for k in range(m):
                total += C[a, k] * w[k]
            free[a] = total + D[a, 0] * u[0]
        for a in range(locals_):
            p[a] = free[a]
            guess = 3.0 * (y[a] - before[a]) + earlier[a]
            earlier[a], before[a] = before[a], y[a]
            y[a] = guess
            size[a] = max(size[a] * FORGET, abs(before[a]) + 1e-30)
        failures += 1
        for iteration in range(ITERATIONS):
            for a in range(locals_):
                u[1 + a] = 0.0
                tangent[a] = 0.0
            for e in range(kind.shape[0]):
                a = coordinate[e]
                force, slope = evaluate(kind[e], parameters, state, e, y[a])
                u[1 + a] += scale[e] * force
                tangent[a] += scale[e] * slope
            if coupled:
                call_kernel(couple_at, None, (kind, coordinate, parameters, y, u, cross))
            solved = True
            for a in range(locals_):
                value = y[a] - p[a]
                for b in range(locals_):
                    value -= D[a, 1 + b] * u[1 + b]
                r[a] = value
                solved = solved and abs(value) < TOLERANCE * (size[a] + abs(y[a]) + abs(p[a]))
            if solved:
                failures -= 1
                break
            if not smooth:
                # A full step over a kink may land beyond the next one and come back: it is shortened until it helps.
                norm = 0.0
                for a in range(locals_):
                    norm += abs(r[a]) / (size[a] + abs(p[a]))
                if iteration > 0 and norm > (1.0 - 0.25 * length) * last and length > SHORTEST:
                    length *= 0.5
                    for a in range(locals_):
                        y[a] = origin[a] - length * move[a]
                    continue
                last, length = norm, 1.0
            if locals_ == 1:
                r[0] /= 1.0 - D[0, 1] * tangent[0]
            elif locals_ == 2:
                a00, a01 = 1.0 - D[0, 1] * tangent[0], -D[0, 2] * tangent[1]
                a10, a11 = -D[1, 1] * tangent[0], 1.0 - D[1, 2] * tangent[1]
                determinant = a00 * a11 - a01 * a10
                first_step = (a11 * r[0] - a01 * r[1]) / determinant
                r[1] = (a00 * r[1] - a10 * r[0]) / determinant
                r[0] = first_step
            elif many:
                call_kernel(correct_at, None, (D, tangent, kept, S, size, r, iteration))
            else:
                for a in range(locals_):
                    for b in range(locals_):
                        J[a, b] = -D[a, 1 + b] * tangent[b]
                    J[a, a] += 1.0
                if coupled:
                    for a in range(locals_):
                        for b in range(locals_):
                            for c in range(locals_):
                                J[a, b] -= D[a, 1 + c] * cross[c, b]
                eliminate(J, r)
            damping = 0.5 if smooth and iteration >= 12 else 1.0
            small = smooth
            for a in range(locals_):
                origin[a], move[a] = y[a], r[a]
                y[a] -= damping * r[a]
                small = small and abs(r[a]) < SMALL_STEP * size[a]
            # Newton's quadratic error is far below the tolerance: the forces of smooth laws follow their tangents.
            if small:
                for a in range(locals_):
                    u[1 + a] -= tangent[a] * r[a]
                failures -= 1
                break
        for e in range(kind.shape[0]):
            b = auxiliary[e]
            if b < 0 and smooth:
                continue  # nothing to remember
            displacement = 0.0
            if b >= 0:
                displacement = free[b]
                for a in range(1, inputs):
                    displacement += D[b, a] * u[a]
            remember(kind[e], parameters, state, e, y[coordinate[e]], displacement, step_s)
        for c in range(channels):
            total = free[first + c]
            for a in range(1, inputs):
                total += D[first + c, a] * u[a]
            out[n, c] = total
        volts = u[0]
        for k in range(half):
            real = decay[k] * w[k] - decay[half + k] * w[half + k] + Gamma[0, k] * volts
            w[half + k] = decay[k] * w[half + k] + decay[half + k] * w[k] + Gamma[0, half + k] * volts
            w[k] = real
        for a in range(1, inputs):
            value = u[a]
            for k in range(m):
                w[k] += Gamma[a, k] * value
    return failures


@INNER
def couple(kind: Array, coordinate: Array, parameters: Array, y: Array, u: Array, cross: Array) -> None:
    """Add the forces of laws of two coordinates to `u`, and put their slopes, (locals, locals), into `cross`."""
    for a in range(len(y)):
        for b in range(len(y)):
            cross[a, b] = 0.0
    for e in range(kind.shape[0]):
        if kind[e] == FORCE_FACTOR:
            x, z = int(parameters[e, 2]), int(parameters[e, 3])
            force, by_x, by_z = lost_force(parameters, e, y[x], y[z])
            u[1 + coordinate[e]] += force
            cross[coordinate[e], x] += by_x
            cross[coordinate[e], z] += by_z


def couple_address(elements: Elements) -> int:
    """Where :func:`couple` is, for elements that need it; nothing for others."""
    if FORCE_FACTOR not in elements.kind:
        return 0
    y, cross = np.empty(0), np.empty((0, 0))
    return address(couple, elements.kind, elements.coordinate, elements.parameters, y, y, cross)


@cache
def correct_address() -> int:
    """Where :func:`twin.bench.many_places.correct` is."""
    v, m = np.empty(0), np.empty((0, 0))
    return address(correct, m, v, v, m, v, v, 0)
