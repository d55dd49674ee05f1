"""Compiled: the motion of a few ports and the stiffness that goes with it, step by step.

Every step is a small problem of its own: n ports, a complex elimination with n + 1 right sides, a real one for Newton's
step.  That moves complex amplitudes: a slip that changes its sign along a layer passes through zero, where logarithms
have no way through; what acts at a port goes by the size alone, and so as many real unknowns decide.
"""

from __future__ import annotations

from math import log, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.jenkins import LEAST_SLIP, RIPPLES
from twin.identify.limits import LIMITS
from twin.identify.slipping_kernel import room_to_slide
from twin.joint.calling import call_kernel
from twin.joint.compilation import COMPILED, INNER
from twin.joint.elimination import eliminate, eliminate_columns


class NewtonLimits(NamedTuple):
    """Most turns after the first, the disagreement that ends them, and the longest step."""

    turns: int
    settled: float
    longest: float


NEWTON = NewtonLimits(100, LIMITS.local_settled, LIMITS.local_longest)


class PackedPorts(NamedTuple):
    """What acts at n ports beside the nonlinear forces, and the rig around them, at s steps."""

    opening: Array
    slip: Array
    """Softening and loss at each point as cubics, from :func:`~twin.identify.nonlinear.joint_law.packed_laws`."""
    weights: Array
    """Of the layers' points, (s, 2 p)."""
    among: Array
    driven: Array
    reference: Array
    to_reference: Array
    amplitude: Array
    """As in :class:`twin.identify.nonlinear.local_forces.Surroundings`."""
    more: Array
    more_growth: Array
    more_at: Array
    squares: Array
    """As in :class:`twin.identify.nonlinear.balance.Added`."""


class Turn(NamedTuple):
    """Motion and stiffness (s, n) at an assumed motion, how far that is off over the largest, and Newton's step."""

    motion: Array
    stiffness: Array
    gap: Array
    step: Array

    @staticmethod
    def of(assumed: Array) -> Turn:
        """Room for one."""
        motion, stiffness, step = (np.empty(assumed.shape, complex) for _ in range(3))
        return Turn(motion, stiffness, np.empty(assumed.shape), step)

    @property
    def left(self) -> Array:
        """Norm of what each step misses, (s,)."""
        with np.errstate(all="ignore"):  # a step may lead anywhere
            return np.asarray(np.linalg.norm(self.gap, axis=1))

    @property
    def settled(self) -> NDArray[np.bool_]:
        """Which steps miss nothing, (s,)."""
        return np.asarray(self.left <= NEWTON.settled)

    def take(self, other: Turn, rows: Array) -> None:
        """Copy some rows."""
        for own, taken in zip(self, other, strict=True):
            own[rows] = taken[rows]


class PackedSliders(NamedTuple):
    """Sliders, which act at the last ports; none where there are other forces, too."""

    values: Array
    """Stiffness and slip force of each, as in :class:`twin.identify.slipping.Slider`, (m, 2)."""
    compliance: Array
    common: Array
    """What each slips into (s, m, 3), and the :func:`~twin.identify.jenkins.common_spring` of that (s, m)."""
    difference: float
    """Relative step of an amplitude for the derivative of a slider's stiffness."""
    slide_at: int
    """:func:`~twin.identify.slipping_kernel.slide_address`, if there is one."""


@COMPILED
def settle(
    ports: PackedPorts, own: Array, growth: Array, assumed: Array, rows: Array, out: Turn, sliders: PackedSliders,
    limits: NewtonLimits, sizes_alone: bool,
) -> None:  # fmt: skip
    """Motion and stiffness of some steps at an assumed motion, what that misses, and Newton's step; turn by turn.

    With turns, `assumed` is moved to where nothing is missed, or the least.  No amplitude moves by more than `longest`
    times its own size.  A step is taken whether it helps or not: over the bends of a rough law searches that come down
    alone end in dead ends (163 of 1242 steps of eight fits with such laws, where 3 are left of those taken anyhow).

    Parameters
    ----------
    own, growth : ndarray, (s, n - 2 p)
        Stiffness of the nonlinear forces at these amplitudes, and its derivative by their logarithms; filled where all
        of them are sliders, since others allow no turns.
    assumed : ndarray, (s, n)
        The assumed complex amplitudes.
    rows : ndarray of int
        Which steps.
    out
        Filled there.
    sizes_alone
        Whether only the sizes are assumed: the phases become those of the motion that these lead to.
    """
    n = assumed.shape[1]
    trial, slope = np.empty(n, np.complex128), np.empty(n, np.complex128)
    new = Turn(np.empty(n, np.complex128), np.empty(n, np.complex128), np.empty(n), np.empty(n, np.complex128))
    # For one step's system of equations, and Newton's.
    room = np.empty((n, n), np.complex128), np.empty((n, n + 1), np.complex128), slope, np.empty((n, n)), np.empty(n)
    force, slip = np.empty(1 + len(RIPPLES), np.complex128), room_to_slide()
    for s in rows:
        least = np.inf
        for i in range(n):
            trial[i] = assumed[s, i]
        for turn in range(limits.turns + 1):
            if len(sliders.values) > 0:
                _slide_all(sliders, s, trial, own[s], growth[s], force, slip)
            _turn_one(ports, s, own[s], growth[s], trial, new, room, sizes_alone and turn == 0)
            left = 0.0
            for i in range(n):
                left += new.gap[i] * new.gap[i]
            left = sqrt(left)
            if turn == 0 or left < least:
                least = left
                for i in range(n):
                    assumed[s, i], out.motion[s, i], out.stiffness[s, i] = trial[i], new.motion[i], new.stiffness[i]
                    out.gap[s, i], out.step[s, i] = new.gap[i], new.step[i]
            if not left > limits.settled:
                break
            for i in range(n):
                longest, size = limits.longest * max(abs(trial[i]), abs(new.motion[i])), abs(new.step[i])
                trial[i] += (1.0 if size <= longest else longest / size) * new.step[i]


@INNER
def _slide_all(
    sliders: PackedSliders, s: int, assumed: Array, own: Array, growth: Array, force: Array, room: tuple[Array, ...]
) -> None:
    """Stiffness of the sliders at a step, and its derivative by the log amplitude of each."""
    first = len(assumed) - len(sliders.values)
    for i in range(len(sliders.values)):
        a, k, slip_force = abs(assumed[first + i]), sliders.values[i, 0], sliders.values[i, 1]
        common, compliance = sliders.common[s, i], sliders.compliance[s, i]
        for beside in range(2):
            call_kernel(sliders.slide_at, None, (a, k, slip_force, common, compliance, force, room))
            growth[i] = force[0] / max(a, LEAST_SLIP) - k
            if beside == 0:
                own[i] = growth[i]
                a *= 1.0 + sliders.difference
        growth[i] = (growth[i] - own[i]) / sliders.difference


@INNER
def _turn_one(
    ports: PackedPorts, s: int, own: Array, growth: Array, assumed: Array, out: Turn, room: tuple[Array, ...],
    sizes_alone: bool,
) -> None:  # fmt: skip
    """:func:`settle`'s turn of one step, whose rows `own`, `growth`, `assumed` and `out` are."""
    weights, more, more_growth, more_at = ports.weights[s], ports.more[s], ports.more_growth[s], ports.more_at[s]
    among, driven, to_reference = ports.among[s], ports.driven[s], ports.to_reference[s]
    z, k, gap, step = out
    A, right, slope, J, r = room
    n, points = len(driven), len(weights) // 2
    for i in range(n):
        if i < points:
            value, by_log = _cubic(ports.opening[i], abs(assumed[i]))
            k[i], slope[i] = complex(-weights[i] * value, 0.0), complex(-weights[i] * by_log, 0.0)
        elif i < 2 * points:
            value, by_log = _running(ports.slip[i - points], abs(assumed[i]), ports.squares[s, i - points])
            k[i], slope[i] = complex(0.0, weights[i] * value), complex(0.0, weights[i] * by_log)
        else:
            k[i], slope[i] = own[i - 2 * points], growth[i - 2 * points]
        k[i] += more[i]
        if i < points:
            for j in range(points):
                k[i] += more_growth[i, j] * (log(max(abs(assumed[j]), 1e-300)) - more_at[j])
    for i in range(n):
        right[i, 0] = driven[i]
        for j in range(n):
            A[i, j] = among[i, j] * k[j]
            right[i, 1 + j] = among[i, j]
        A[i, i] += 1.0
    eliminate_columns(A, right)
    reading = ports.reference[s]
    for i in range(n):
        reading -= to_reference[i] * k[i] * right[i, 0]
    largest = 1e-300
    for i in range(n):
        z[i] = right[i, 0] / reading * ports.amplitude[s]
        largest = max(largest, abs(z[i]))
    for i in range(n):
        if sizes_alone:
            assumed[i] = abs(assumed[i]) * (z[i] / abs(z[i]) if z[i] != 0 else 1.0)
        gap[i] = abs(z[i] - assumed[i]) / largest
    for i in range(n):
        for j in range(n):
            J[i, j] = 1.0 if i == j else 0.0
    by_stiffness = A  # what was eliminated there is not needed any more
    for j in range(n):
        onto = to_reference[j]
        for i in range(n):
            onto -= to_reference[i] * k[i] * right[i, 1 + j]
        for i in range(n):
            moved = onto * z[i] - right[i, 1 + j] * ports.amplitude[s]
            by_stiffness[i, j] = moved * right[j, 0] / reading
    # What the logarithms of the sizes change, which alone act.
    for i in range(n):
        inverse = 1.0 / assumed[i] if assumed[i] != 0 else 0j
        for j in range(n):
            J[i, j] -= (by_stiffness[i, j] * slope[j] * inverse).real
            if j < points:
                for m in range(points):
                    J[i, m] -= (by_stiffness[i, j] * more_growth[j, m] * inverse).real
        r[i] = ((z[i] - assumed[i]) * inverse).real
    eliminate(J, r)
    for i in range(n):
        step[i] = z[i] - assumed[i]
    for j in range(n):
        change = slope[j] * r[j]
        if j < points:
            for m in range(points):
                change += more_growth[j, m] * r[m]
        for i in range(n):
            step[i] += by_stiffness[i, j] * change


@INNER
def _running(c: Array, a: float, squares: Array) -> tuple[float, float]:
    """:func:`~twin.identify.nonlinear.running_amplitude.running_loss` of one slip, and its derivative by log a."""
    a2 = max(a * a, 1e-300)
    displacement, velocity = a2 + squares[0], a2 + squares[1]
    fall = sqrt(displacement / velocity)
    value, by_log = _cubic(c, sqrt(displacement))
    share = a2 / displacement
    return value * fall, (by_log * share + value * (share - a2 / velocity)) * fall


@INNER
def _cubic(c: Array, x: float) -> tuple[float, float]:
    """A law at an amplitude, and its derivative by the logarithm of that."""
    offset = c[5, 0]
    u = log(x + offset)
    i, beyond = 0, c.shape[1] - 1
    while beyond - i > 1:
        middle = (i + beyond) // 2
        if c[4, middle] < u:
            i = middle
        else:
            beyond = middle
    t = u - c[4, i]
    value = ((c[0, i] * t + c[1, i]) * t + c[2, i]) * t + c[3, i]
    return value, ((3.0 * c[0, i] * t + 2.0 * c[1, i]) * t + c[2, i]) * x / (x + offset)
