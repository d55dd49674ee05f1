"""Newton at a point and steps along a branch, compiled; each accepts only what contracts.

Where a step of Newton's is less than half of the last, and the next again, there is one solution in reach of the start
and rounding has no say in which it is.  Where it is not, the start is too far away, and a shorter way is taken: along
the branch, in frequency or in the drive's amplitude, by pseudo-arclength, which passes folds.

Unknowns are measured coordinate by coordinate, each by its own size: an opening in micrometres counts as much as the
volts of a shaker.
"""

import numpy as np
from numpy.typing import NDArray

from twin.joint.kernel import COMPILED
from twin.response.kernel import drive_slope, residual, rounding
from twin.response.outcome import ENDED, FAR, FOUND, LONG, NOT_FINITE, STALLED
from twin.response.solve import solve
from twin.response.system import System

Matrix = NDArray[np.float64]

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


@COMPILED
def _norm(x: Matrix) -> float:
    total = 0.0
    for i in range(x.shape[0]):
        total += x[i] * x[i]
    return float(np.sqrt(total))


@COMPILED
def _measure(x: Matrix, largest: Matrix, size: Matrix) -> None:
    """Sizes of the coordinates, (N,), each coordinate's at all its unknowns; `largest`, (locals,), is kept up."""
    locals_ = largest.shape[0]
    n = x.shape[0] // locals_
    most = 0.0
    for a in range(locals_):
        largest[a] = max(largest[a], _norm(x[a * n : (a + 1) * n]))
        most = max(most, largest[a])
    for a in range(locals_):
        one = max(_norm(x[a * n : (a + 1) * n]), FADED * largest[a], 1e-9 * most)
        size[a * n : (a + 1) * n] = (one if one > 0.0 else 1.0) * np.sqrt(locals_)


@COMPILED
def _length(v: Matrix, size: Matrix) -> float:
    """Of a change of the unknowns, or of a residual, over the size of the coordinates."""
    total = 0.0
    for i in range(v.shape[0]):
        total += (v[i] / size[i]) ** 2
    return float(np.sqrt(total))


@COMPILED
def _rounded(s: System, x: Matrix, R: Matrix, w: float, amplitude: float, F: Matrix, size: Matrix) -> bool:
    """Whether a residual is all rounding."""
    least = np.empty(x.shape[0])
    rounding(s, x, w, amplitude, F, least)
    return _length(R, size) <= _length(least, size)


@COMPILED
def newton(
    s: System, x: Matrix, w: float, amplitude: float, tolerance: float, most: int, contraction: float, F: Matrix
) -> tuple[int, int, float]:
    """Move x, (N,), onto the solution at w that is in reach.

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
    size, largest, last = np.empty(N), np.zeros(F.shape[0]), np.empty(N)
    for iteration in range(most + 1):
        residual(s, x, w, amplitude, R, J, by_w, F)
        _measure(x, largest, size)
        left = _length(R, size)
        if left <= tolerance:
            return FOUND, iteration, left
        if not np.isfinite(left):
            return NOT_FINITE, iteration, left
        step = R.copy()
        solve(J, step.reshape(N, 1))
        length = _length(step, size)
        if not np.isfinite(length):
            return NOT_FINITE, iteration, left
        allowed = contraction if iteration == 1 else max(contraction, CONTRACTION)
        if iteration > 0 and length > allowed * _length(last, size):
            return FOUND if _rounded(s, x, R, w, amplitude, F, size) else FAR, iteration, left
        x -= step
        last[:] = step
    return LONG, most, left


@COMPILED
def _border(J: Matrix, slope: Matrix, size: Matrix, span: float, row: Matrix, bordered: Matrix) -> None:
    N = J.shape[0]
    for i in range(N):
        for j in range(N):
            bordered[i, j] = J[i, j] * size[j] / size[i]
        bordered[i, N] = slope[i] * span / size[i]
    bordered[N] = row


@COMPILED
def _tangent_at(J: Matrix, slope: Matrix, size: Matrix, span: float, heading: Matrix, tangent: Matrix) -> None:
    """Unit tangent of the branch in unknowns over `size` and the parameter over `span`, on the side of `heading`."""
    N = J.shape[0]
    bordered, right = np.empty((N + 1, N + 1)), np.zeros(N + 1)
    _border(J, slope, size, span, heading, bordered)
    right[N] = 1.0
    solve(bordered, right.reshape(N + 1, 1))
    tangent[:] = right / _norm(right)


@COMPILED
def _advance(
    s: System,
    z: Matrix,
    tangent: Matrix,
    size: Matrix,
    span: float,
    h: float,
    kink: bool,
    held: float,
    by_drive: bool,
    unit: Matrix,
    tolerance: float,
    most: int,
    F: Matrix,
) -> tuple[int, float]:
    """One step of arclength along the branch.

    Parameters
    ----------
    z : ndarray, (N + 1,)
        Unknowns over `size` and the parameter over `span`, moved on in place.
    tangent : ndarray, (N + 1,)
        Unit tangent at z; if all goes well replaced by that at the last correction but one.
    kink
        Whether the corrections need not contract, but only stay near.
    held, by_drive, unit
        As in :func:`follow`; `unit` is the slope by the drive, (N,).
    F
        Filled: forces at the end, (locals, n).

    Returns
    -------
    tuple
        The corrections it took, or -1; the contraction at the second of them, nothing if there was none.
    """
    N = z.shape[0] - 1
    R, J, by_w = np.empty(N), np.empty((N, N)), np.empty(N)
    bordered, right, way = np.empty((N + 1, N + 1)), np.empty((N + 1, 2)), tangent.copy()
    own, largest = np.empty(N), np.zeros(F.shape[0])
    contraction, last = 0.0, h
    z += h * tangent
    for iteration in range(most + 1):
        x = z[:N] * size
        w, amplitude = (held, z[N] * span) if by_drive else (z[N] * span, held)
        residual(s, x, w, amplitude, R, J, by_w, F)
        if iteration > 0:
            _measure(x, largest, own)
            if _length(R, own) < tolerance:
                tangent[:] = way
                return iteration, contraction
        _border(J, unit if by_drive else by_w, size, span, tangent, bordered)
        right[:N, 0] = R / size
        right[:N, 1] = 0.0
        right[N, 0], right[N, 1] = 0.0, 1.0  # corrections lie across the tangent; the second column is the next one
        solve(bordered, right)
        length, turned = _norm(right[:, 0]), _norm(right[:, 1])
        if not (np.isfinite(length) and np.isfinite(turned)):
            return -1, contraction
        allowed = BEND * h if kink else (CONTRACTION if iteration > 0 else 1.0) * last
        if length > allowed:
            if iteration > 0 and _rounded(s, x, R, w, amplitude, F, own):
                tangent[:] = way
                return iteration, contraction
            return -1, contraction
        if iteration == 1:
            contraction = min(length / last, AIM) if kink else length / last
        last = length
        z -= right[:, 0]
        way[:] = right[:, 1] / turned
    return -1, contraction


@COMPILED
def turns_beyond(start: float, slope: float, end_slope: float, h: float, target: float) -> bool:
    """Whether a step whose ends lie on one side of a target turns beyond it: as a parabola of these slopes would."""
    if slope * end_slope >= 0.0:
        return False
    highest = start + 0.5 * slope * slope * h / (slope - end_slope)
    return (highest - target) * (start - target) <= 0.0


@COMPILED
def follow(
    s: System,
    start: Matrix,
    begin: float,
    end: float,
    held: float,
    by_drive: bool,
    span: float,
    step: float,
    landing: bool,
    tolerance: float,
    corrections: int,
    X: Matrix,
    P: Matrix,
    F: Matrix,
    iterations: NDArray[np.int64],
) -> tuple[int, int]:
    """Follow the branch in one parameter, through folds.

    Parameters
    ----------
    start : ndarray, (N,)
        Solution at `begin`.
    begin, end, held, by_drive
        The parameter at both ends, and the one that is held: the amplitude of the drive and the frequency, rad/s, if
        `by_drive`, or else the other way round.
    span
        Unit in which the parameter counts for the arclength.
    step
        Greatest arclength of a step.
    landing
        Whether the last point is to lie at `end`, however the branch may turn before; else it ends where it leaves the
        band between the two.
    tolerance, corrections
        Of each point.
    X, P, F, iterations : ndarray, (most, N), (most,), (most, locals, n), (most,)
        Filled with the points after the first; P is the parameter.

    Returns
    -------
    tuple
        How it ended, and how many points.
    """
    N, most = start.shape[0], P.shape[0]
    low, high = min(begin, end), max(begin, end)
    h, target = step / 10.0, end / span
    z, tangent, heading = np.empty(N + 1), np.empty(N + 1), np.zeros(N + 1)
    R, J, by_w, force = np.empty(N), np.empty((N, N)), np.empty(N), np.empty_like(F[0])
    size, new_size, largest, unit, x = np.empty(N), np.empty(N), np.zeros(F.shape[1]), np.zeros(N), start.copy()
    w, amplitude = (held, begin) if by_drive else (begin, held)
    if by_drive:
        drive_slope(s, held, unit)
    residual(s, x, w, amplitude, R, J, by_w, force)
    _measure(x, largest, size)
    heading[N] = 1.0 if end > begin else -1.0
    z[:N], z[N] = start / size, begin / span
    _tangent_at(J, unit if by_drive else by_w, size, span, heading, tangent)
    if not np.isfinite(tangent).all():
        return NOT_FINITE, 0
    trial, way = np.empty(N + 1), np.empty(N + 1)
    count, rejected = 0, 0
    while count < most:
        if h < SHORTEST * step:
            return STALLED, count
        if rejected > 2 * most:
            return LONG, count
        trial[:], way[:] = z, tangent
        kink = h < KINK * step
        corrected, contraction = _advance(
            s, trial, way, size, span, h, kink, held, by_drive, unit, tolerance, corrections, force
        )
        if corrected < 0 or (np.dot(way, tangent) < LEAST_TURN and not kink):
            h /= 2.0
            rejected += 1
            continue
        if landing:
            before, after = z[N] - target, trial[N] - target
            if before * after <= 0.0:
                share = before / (before - after)
                x[:] = (z[:N] + share * (trial[:N] - z[:N])) * size
                w, amplitude = (held, end) if by_drive else (end, held)
                near = BEND if kink else CONTRACTION
                outcome, steps, _ = newton(s, x, w, amplitude, tolerance, corrections, near, force)
                if outcome == FOUND:
                    X[count], P[count], F[count], iterations[count] = x, end, force, steps
                    return FOUND, count + 1
                h /= 2.0
                rejected += 1
                continue
            if not kink and turns_beyond(float(z[N]), float(tangent[N]), float(way[N]), h, target):
                h /= 2.0
                rejected += 1
                continue
        z[:], tangent[:] = trial, way
        if not landing and not low <= z[N] * span <= high:
            return ENDED, count
        x[:] = z[:N] * size
        X[count], P[count], F[count], iterations[count] = x, z[N] * span, force, corrected
        count += 1
        _measure(x, largest, new_size)
        z[:N] = x / new_size
        for i in range(N):
            tangent[i] *= size[i] / new_size[i]
        tangent /= _norm(tangent)
        size[:] = new_size
        h = min(step, h * min(1.5, max(0.5, np.sqrt(AIM / max(contraction, 1e-6)))))
    return LONG, count
