"""Newton at a point and steps along a branch, compiled; each accepts only what contracts.

Where a step of Newton's is less than half of the last, and the next again, there is one solution in reach of the start
and rounding has no say in which it is.  Where it is not, the start is too far away, and a shorter way is taken: along
the branch, in frequency or in the drive's amplitude, by pseudo-arclength, which passes folds.

Unknowns are measured coordinate by coordinate, each by its own size: an opening in micrometres counts as much as the
volts of a shaker.
"""

from math import isfinite, sqrt
from typing import NamedTuple

import numpy as np

from twin.arrays import Array
from twin.joint.calling import address, call_kernel
from twin.joint.kernel import COMPILED, INNER
from twin.joint.kinds import FORCE_FACTOR, RUNNING_LOSS
from twin.response.aft import aft_kernel
from twin.response.kernel import drive_slope, forces, residual, rounding, transfer
from twin.response.limits import LIMITS
from twin.response.outcome import ENDED, FAR, FOUND, LONG, NOT_FINITE, STALLED
from twin.response.solve import solve
from twin.response.system import Addresses, SineDrive, System

CONTRACTION = 0.5
"""Most of the last step of Newton's that the next may be: a parabola without a zero never gets below it."""
AIM = 0.15
"""Contraction at the first correction for which the length of a step along the branch is chosen."""
LEAST_TURN = 0.7
"""Cosine of the angle between the tangents at both ends of a step, at least: another branch goes elsewhere."""
KINK, BEND = 1e-3, 50.0
"""Step over the greatest from which on the branch may have a kink, and the largest correction there over the step.

Where a slider starts to slip, nothing contracts however short the step.  What then converges close by, nearer than the
greatest step is long, is on the branch.
"""
SHORTEST = 1e-7
"""Step over the greatest at which the branch counts as ended."""
FADED = 1e-3
"""Size of a coordinate over its largest so far below which it counts as this."""


class Course(NamedTuple):
    """A way along a branch in one parameter."""

    begin: float
    end: float
    held: float
    by_drive: bool
    """The parameter at both ends, and the one that is held: the amplitude of the drive and the frequency, rad/s, if
    `by_drive`, or else the other way round."""
    span: float
    """Unit in which the parameter counts for the arclength."""
    step: float
    """Greatest arclength of a step."""
    landing: bool
    """Whether the last point is to lie at `end`, however the branch may turn before; else it ends where it leaves the
    band between the two."""
    tolerance: float = LIMITS.balance_tolerance
    corrections: int = 12
    """Of each point."""


class _Point(NamedTuple):
    """Of the branch: unknowns over `size` and the parameter over its span, (N + 1,), and the unit tangent there."""

    z: Array
    tangent: Array
    size: Array


def with_kernels(s: System) -> System:
    """The system that also tells where the kernels are that are called below."""
    v, m, a, drive = np.empty(0), np.empty((0, 0)), np.empty((0, 0, 0, 0)), SineDrive(0.0, 0.0)
    course, single = Course(0.0, 0.0, 0.0, True, 0.0, 0.0, True), (0, m, 0, v, m, v, m)
    given = {RUNNING_LOSS: (m, 0, v, 0.0, 0.0, v, m, m), FORCE_FACTOR: (m, 0, v, v, m, v, np.empty((0, 0, 0)))}
    for e, (kind, row) in enumerate(zip(s.elements[0].tolist(), s.parameters, strict=True)):
        s.elements[3, e] = address(aft_kernel(kind, row), *given.get(kind, single))
    at = Addresses(
        transfer=address(transfer, s, 0.0, a, a),
        forces=address(forces, s, m, 0.0, m, m),
        residual=address(residual, s, v, drive, v, m, v, m),
        rounding=address(rounding, s, v, drive, m, v),
        drive_slope=address(drive_slope, s, 0.0, v),
        solve=address(solve, m, m),
        newton=address(newton, s, v, drive, 0.0, 0, 0.0, m),
        advance=address(_advance, s, _Point(v, v, v), course, 0.0, v, m),
    )
    return s._replace(at=at)


@INNER
def _drive_at(course: Course, parameter: float) -> SineDrive:
    return SineDrive(course.held, parameter) if course.by_drive else SineDrive(parameter, course.held)


@INNER
def _measure(x: Array, largest: Array, size: Array) -> None:
    """Sizes of the coordinates, (N,), each coordinate's at all its unknowns; `largest`, (locals,), is kept up."""
    locals_ = largest.shape[0]
    n = x.shape[0] // locals_
    most = 0.0
    for a in range(locals_):
        total = 0.0
        for i in range(a * n, (a + 1) * n):
            total += x[i] * x[i]
        size[a * n] = sqrt(total)
        largest[a] = max(largest[a], size[a * n])
        most = max(most, largest[a])
    for a in range(locals_):
        one = max(size[a * n], FADED * largest[a], 1e-9 * most)
        for i in range(a * n, (a + 1) * n):
            size[i] = (one if one > 0.0 else 1.0) * sqrt(locals_)


@INNER
def _length(v: Array, size: Array) -> float:
    """Of a change of the unknowns, or of a residual, over the size of the coordinates."""
    total = 0.0
    for i in range(v.shape[0]):
        total += (v[i] / size[i]) ** 2
    return sqrt(total)


@INNER
def _rounded(s: System, x: Array, R: Array, drive: SineDrive, F: Array, size: Array) -> bool:
    """Whether a residual is all rounding."""
    least = np.empty(x.shape[0])
    call_kernel(s.at.rounding, rounding, (s, x, drive, F, least))
    return _length(R, size) <= _length(least, size)


@COMPILED
def newton(
    s: System, x: Array, drive: SineDrive, tolerance: float, most: int, contraction: float, F: Array
) -> tuple[int, int, float]:
    """Move x, (N,), onto the solution that is in reach.

    Parameters
    ----------
    tolerance
        Of the residual over the size of the unknowns.
    contraction
        Most of the first step that the second may be; later ones, of the one before: this or :data:`CONTRACTION`.
    F : ndarray, (locals, n)
        Filled.

    Returns
    -------
    tuple
        How it ended, the steps it took, and the residual over the size of the unknowns.
    """
    N = x.shape[0]
    R, J, by_w = np.empty(N), np.empty((N, N)), np.empty(N)
    size, largest, last, right = np.empty(N), np.zeros(F.shape[0]), np.empty(N), np.empty((N, 1))
    step = np.empty(N)
    for iteration in range(most + 1):
        call_kernel(s.at.residual, residual, (s, x, drive, R, J, by_w, F))
        _measure(x, largest, size)
        left = _length(R, size)
        if left <= tolerance:
            return FOUND, iteration, left
        if not isfinite(left):
            return NOT_FINITE, iteration, left
        for i in range(N):
            right[i, 0] = R[i]
        call_kernel(s.at.solve, solve, (J, right))
        for i in range(N):
            step[i] = right[i, 0]
        length = _length(step, size)
        if not isfinite(length):
            return NOT_FINITE, iteration, left
        allowed = contraction if iteration == 1 else max(contraction, CONTRACTION)
        if iteration > 0 and length > allowed * _length(last, size):
            return FOUND if _rounded(s, x, R, drive, F, size) else FAR, iteration, left
        for i in range(N):
            x[i] -= step[i]
            last[i] = step[i]
    return LONG, most, left


@INNER
def _border(J: Array, slope: Array, size: Array, span: float, row: Array, bordered: Array) -> None:
    """The Jacobian in unknowns over `size`, with the slope by the parameter over `span` and a last `row`."""
    N = J.shape[0]
    for i in range(N):
        for j in range(N):
            bordered[i, j] = J[i, j] * size[j] / size[i]
        bordered[i, N] = slope[i] * span / size[i]
    for j in range(N + 1):
        bordered[N, j] = row[j]


@INNER
def _tangent_at(s: System, J: Array, slope: Array, size: Array, span: float, heading: Array, tangent: Array) -> bool:
    """Unit tangent of the branch in unknowns over `size` and the parameter over `span`, on the side of `heading`.

    Whether there is one is told.
    """
    N = J.shape[0]
    bordered, right = np.empty((N + 1, N + 1)), np.empty((N + 1, 1))
    _border(J, slope, size, span, heading, bordered)
    for i in range(N + 1):
        right[i, 0] = 1.0 if i == N else 0.0
    call_kernel(s.at.solve, solve, (bordered, right))
    total = 0.0
    for i in range(N + 1):
        total += right[i, 0] * right[i, 0]
    for i in range(N + 1):
        tangent[i] = right[i, 0] / sqrt(total)
    return isfinite(total)


@INNER
def _advance(s: System, point: _Point, course: Course, h: float, unit: Array, F: Array) -> tuple[int, float]:
    """One step of arclength `h` along the branch; where it is a short one, corrections need only stay near.

    Parameters
    ----------
    point
        Moved on in place; its tangent is then that at the last correction but one.
    unit
        The slope by the drive, (N,).
    F
        Filled: forces at the end, (locals, n).

    Returns
    -------
    tuple
        The corrections it took, or -1; the contraction at the second of them, nothing if there was none.
    """
    z, tangent, size = point
    by_drive, span = course.by_drive, course.span
    N, kink = z.shape[0] - 1, h < KINK * course.step
    R, J, by_w = np.empty(N), np.empty((N, N)), np.empty(N)
    bordered, right, across = np.empty((N + 1, N + 1)), np.empty((N + 1, 2)), np.empty(N + 1)
    own, largest, x = np.empty(N), np.zeros(F.shape[0]), np.empty(N)
    contraction, last = 0.0, h
    for i in range(N + 1):
        z[i] += h * tangent[i]
        across[i] = tangent[i]
    for iteration in range(course.corrections + 1):
        for i in range(N):
            x[i] = z[i] * size[i]
        drive = _drive_at(course, z[N] * span)
        call_kernel(s.at.residual, residual, (s, x, drive, R, J, by_w, F))
        if iteration > 0:
            _measure(x, largest, own)
            if _length(R, own) < course.tolerance:
                return iteration, contraction
        _border(J, unit if by_drive else by_w, size, span, across, bordered)
        for i in range(N):
            right[i, 0], right[i, 1] = R[i] / size[i], 0.0
        right[N, 0], right[N, 1] = 0.0, 1.0  # corrections lie across the tangent; the second column is the next one
        call_kernel(s.at.solve, solve, (bordered, right))
        length, turned = 0.0, 0.0
        for i in range(N + 1):
            length += right[i, 0] * right[i, 0]
            turned += right[i, 1] * right[i, 1]
        length, turned = sqrt(length), sqrt(turned)
        if not (isfinite(length) and isfinite(turned)):
            return -1, contraction
        allowed = BEND * h if kink else (CONTRACTION if iteration > 0 else 1.0) * last
        if length > allowed:
            rounded = iteration > 0 and _rounded(s, x, R, drive, F, own)
            return iteration if rounded else -1, contraction
        if iteration == 1:
            contraction = min(length / last, AIM) if kink else length / last
        last = length
        for i in range(N + 1):
            z[i] -= right[i, 0]
            tangent[i] = right[i, 1] / turned
    return -1, contraction


@INNER
def turns_beyond(start: float, slope: float, end_slope: float, h: float, target: float) -> bool:
    """Whether a step whose ends lie on one side of a target turns beyond it: as a parabola of these slopes would."""
    if slope * end_slope >= 0.0:
        return False
    highest = start + 0.5 * slope * slope * h / (slope - end_slope)
    return (highest - target) * (start - target) <= 0.0


@COMPILED
def follow(s: System, start: Array, course: Course, X: Array, P: Array, F: Array, iterations: Array) -> tuple[int, int]:
    """Follow the branch in one parameter, through folds.

    Parameters
    ----------
    start : ndarray, (N,)
        Solution where the course begins.
    X, P, F, iterations : ndarray, (most, N), (most,), (most, locals, n), (most,)
        Filled with the points after the first; P is the parameter.

    Returns
    -------
    tuple
        How it ended, and how many points.
    """
    begin, end, held, by_drive, span, step, landing, tolerance, corrections = course
    N, most = start.shape[0], P.shape[0]
    low, high = min(begin, end), max(begin, end)
    h, target = step / 10.0, end / span
    z, tangent, trial, way = np.empty(N + 1), np.empty(N + 1), np.empty(N + 1), np.empty(N + 1)
    R, J, by_w = np.empty(N), np.empty((N, N)), np.empty(N)
    size, new_size, largest, unit = np.empty(N), np.empty(N), np.zeros(F.shape[1]), np.zeros(N)
    if by_drive:
        call_kernel(s.at.drive_slope, drive_slope, (s, held, unit))
    call_kernel(s.at.residual, residual, (s, start, _drive_at(course, begin), R, J, by_w, F[0]))
    _measure(start, largest, size)
    for i in range(N):
        z[i], way[i] = start[i] / size[i], 0.0
    z[N], way[N] = begin / span, 1.0 if end > begin else -1.0
    if not _tangent_at(s, J, unit if by_drive else by_w, size, span, way, tangent):
        return NOT_FINITE, 0
    count, rejected = 0, 0
    while count < most:
        if h < SHORTEST * step:
            return STALLED, count
        if rejected > 2 * most:
            return LONG, count
        for i in range(N + 1):
            trial[i], way[i] = z[i], tangent[i]
        x, force, kink = X[count], F[count], h < KINK * step
        given = s, _Point(trial, way, size), course, h, unit, force
        corrected, contraction = call_kernel(s.at.advance, _advance, given)
        turned = 0.0
        for i in range(N + 1):
            turned += way[i] * tangent[i]
        accepted = corrected >= 0 and (turned >= LEAST_TURN or kink)
        if accepted and landing:
            before, after = z[N] - target, trial[N] - target
            if before * after <= 0.0:
                share = before / (before - after)
                for i in range(N):
                    x[i] = (z[i] + share * (trial[i] - z[i])) * size[i]
                near, drive = BEND if kink else CONTRACTION, _drive_at(course, end)
                found = call_kernel(s.at.newton, newton, (s, x, drive, tolerance, corrections, near, force))
                outcome, steps, _ = found
                if outcome == FOUND:
                    P[count], iterations[count] = end, steps
                    return FOUND, count + 1
                accepted = False
            elif not kink:
                accepted = not turns_beyond(float(z[N]), float(tangent[N]), float(way[N]), h, target)
        if not accepted:
            h /= 2.0
            rejected += 1
            continue
        if not landing and not low <= trial[N] * span <= high:
            return ENDED, count
        for i in range(N):
            x[i] = trial[i] * size[i]
        P[count], iterations[count] = trial[N] * span, corrected
        count += 1
        _measure(x, largest, new_size)
        total = way[N] * way[N]
        for i in range(N):
            z[i] = x[i] / new_size[i]
            tangent[i] = way[i] * size[i] / new_size[i]
            total += tangent[i] * tangent[i]
            size[i] = new_size[i]
        z[N], tangent[N] = trial[N], way[N]
        for i in range(N + 1):
            tangent[i] /= sqrt(total)
        h = min(step, h * min(1.5, max(0.5, sqrt(AIM / max(contraction, 1e-6)))))
    return LONG, count
