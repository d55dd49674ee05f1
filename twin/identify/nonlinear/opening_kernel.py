"""Compiled: Newton's method for the harmonics of the layer's openings, step by step.

Real parts of all orders come first among the unknowns, then the imaginary parts of all but order zero: a static opening
has none.
"""

from typing import NamedTuple

import numpy as np

from twin.arrays import Array
from twin.joint.elimination import COMPILED, eliminate, eliminate_columns


class Around(NamedTuple):
    """The openings and what surrounds them, as in :class:`twin.identify.nonlinear.opening_harmonics.Openings`."""

    fundamental: Array
    secant: Array
    weight: Array
    compliance: Array


class Layer(NamedTuple):
    """The layers' forces at p points, and waves at a period's samples."""

    modulus: Array
    """E', N/m2, (p,)."""
    orders: Array
    """The harmonics in question; order zero, if any, comes first, (h,)."""
    cosines: Array
    sines: Array
    """Of n theta at a period's samples, up to twice the highest order, (n, t)."""
    table: Array
    """Openings evenly from zero, the layer's whole force there per weight, and its slope, (p, 3, g)."""
    slap: Array
    """Share of the stiffness lost beyond the gap, where the joint opens; the gap; the force at the gap, (p, 3)."""


class _Period(NamedTuple):
    """Room for openings, the force beyond the secant stiffness, its tangent, (p, t); waves (t, n) to transform by."""

    opening: Array
    path: Array
    tangent: Array
    cosines: Array
    sines: Array


@COMPILED
def balance(
    around: Around, driven: Array, layer: Layer, X: Array, turns: int, balanced: float, shortest: float
) -> tuple[Array, Array, Array]:
    """Move harmonics X (s, h, p) to where they are in balance.

    Parameters
    ----------
    driven : ndarray, (s, h, p)
        As in :class:`twin.identify.nonlinear.opening_harmonics.Openings`.
    turns, balanced, shortest
        Most Newton steps, the size of one that ends them, and the share that is taken though it comes no nearer.

    Returns
    -------
    force, more, unsettled : ndarray, (s, h, p), (s, p), (s,)
        See :class:`twin.identify.nonlinear.opening_harmonics.OpeningBalance`.
    """
    orders, compliance = layer.orders, around.compliance
    steps, H, p = X.shape
    n, still = H * p, p if orders[0] == 0 else 0
    period, spectrum, tau = _room(layer)
    J, r = np.empty((2 * n - still, 2 * n - still)), np.empty(2 * n - still)
    base, taken = np.empty((H, p), np.complex128), np.empty((H, p), np.complex128)
    miss = np.empty((H, p), np.complex128)
    force, more, unsettled = np.empty_like(X), np.empty((steps, p), np.complex128), np.empty(steps)
    for s in range(steps):
        size = 1e-300
        for i in range(p):
            size = max(size, abs(around.fundamental[s, i]))
        nearest, share = np.inf, 1.0
        unsettled[s] = np.inf
        for turn in range(turns + 1):
            _force_of(around, layer, s, X[s], orders, layer.slap, period)
            _transform(period.path, period, spectrum)
            left = _missed(X[s], driven[s], compliance[s], spectrum, orders, force[s], miss)
            # Where a contact opens within a step, whole steps may go round in circles: half of one, until it helps.
            if left < nearest or share <= shortest:
                _transform(period.tangent, period, tau)
                _newton(compliance[s], tau, orders, miss, J, r)
                longest = 0.0
                for h in range(H):
                    for i in range(p):
                        k = h * p + i
                        taken[h, i] = complex(r[k], r[n + k - still] if k >= still else 0.0)
                        longest = max(longest, abs(taken[h, i]))
                unsettled[s] = longest / size
                # Nor is any step larger than half the motion itself to be trusted.
                most = min(1.0, 0.5 / max(unsettled[s], 1e-300))
                for h in range(H):
                    for i in range(p):
                        base[h, i], taken[h, i] = X[s, h, i], most * taken[h, i]
                nearest, share = left, 1.0
            else:
                share /= 2.0
            if turn == turns:
                break
            for h in range(H):
                for i in range(p):
                    X[s, h, i] = base[h, i] - share * taken[h, i]
            if unsettled[s] < balanced:
                # The last step is taken too: differences between close balances are meaningful.
                _force_of(around, layer, s, X[s], orders, layer.slap, period)
                _transform(period.path, period, spectrum)
                _missed(X[s], driven[s], compliance[s], spectrum, orders, force[s], miss)
                break
        # Less what the time form makes of the fundamental alone: nothing, but for its table and its least slope.
        _force_of(around, layer, s, X[s], orders[:0], np.zeros(layer.slap.shape), period)
        _transform(period.path, period, tau)
        for i in range(p):
            a = around.fundamental[s, i]
            more[s, i] = 2.0 * (spectrum[i, 1] - tau[i, 1]) / (a if a != 0.0 else 1.0 + 0.0j)
    return force, more, unsettled


@COMPILED
def _room(layer: Layer) -> tuple[_Period, Array, Array]:
    """Of a period, and for two sets of Fourier coefficients (p, n)."""
    (waves, samples), p = layer.cosines.shape, len(layer.modulus)
    onto = np.ascontiguousarray(layer.cosines.T), np.ascontiguousarray(layer.sines.T)
    period = _Period(np.empty((p, samples)), np.empty((p, samples)), np.empty((p, samples)), onto[0], onto[1])
    return period, np.empty((p, waves), np.complex128), np.empty((p, waves), np.complex128)


@COMPILED
def _force_of(around: Around, layer: Layer, s: int, X: Array, orders: Array, slap: Array, period: _Period) -> None:
    """Fill in a step's openings with harmonics X (h, p), the force beyond the secant stiffness, and its tangent."""
    opening, path, tangent = period.opening, period.path, period.tangent
    for i in range(len(opening)):
        a = around.fundamental[s, i]
        for t in range(opening.shape[1]):
            opening[i, t] = a.real * layer.cosines[1, t] - a.imag * layer.sines[1, t]
        for h in range(len(orders)):
            x, order = X[h, i], orders[h]
            for t in range(opening.shape[1]):
                opening[i, t] += x.real * layer.cosines[order, t] - x.imag * layer.sines[order, t]
    for i in range(len(opening)):
        weight = around.weight[s, i]
        rest = around.secant[s, i] + layer.modulus[i] * weight
        for t in range(opening.shape[1]):
            size = abs(opening[i, t])
            sign = 1.0 if opening[i, t] >= 0.0 else -1.0
            whole, slope = force_at(size, layer.table[i])
            value = sign * whole
            if slap[i, 0] != 0.0 and opening[i, t] > slap[i, 1]:
                value -= slap[i, 0] * (whole - slap[i, 2])
                slope *= 1.0 - slap[i, 0]
            path[i, t] = weight * value - rest * opening[i, t]
            tangent[i, t] = weight * slope - rest


@COMPILED
def force_at(size: float, table: Array) -> tuple[float, float]:
    """The layer's whole force per weight at an opening, and its slope: straight between the table's points."""
    last, spacing = table.shape[1] - 1, table[0, 1]
    inside = min(size, table[0, last])
    k = min(int(inside / spacing), last - 1)
    u = inside / spacing - k
    slope = table[2, k] + u * (table[2, k + 1] - table[2, k])
    whole = table[1, k] + u * spacing * (table[2, k] + slope) / 2
    return whole + (size - inside) * table[2, last], slope


@COMPILED
def _transform(values: Array, period: _Period, out: Array) -> None:
    """Fill in Fourier coefficients (p, n) of samples (p, t)."""
    cosines, sines = period.cosines, period.sines
    samples, count = cosines.shape
    real, imaginary = np.empty(count), np.empty(count)
    for i in range(len(values)):
        real[:] = 0.0
        imaginary[:] = 0.0
        # Orders inside: a sum along the samples would wait for each addition.
        for t in range(samples):
            value = values[i, t]
            for n in range(count):
                real[n] += value * cosines[t, n]
                imaginary[n] -= value * sines[t, n]
        for n in range(count):
            out[i, n] = complex(real[n] / samples, imaginary[n] / samples)


@COMPILED
def _missed(
    X: Array, driven: Array, compliance: Array, spectrum: Array, orders: Array, force: Array, miss: Array
) -> float:
    """Fill in the force's harmonics, and what those of the motion miss, (h, p); the length of that."""
    H, p = X.shape
    total = 0.0
    for h in range(H):
        twice = 1.0 if orders[h] == 0 else 2.0
        for i in range(p):
            force[h, i] = twice * spectrum[i, orders[h]]
        for i in range(p):
            value = X[h, i] - driven[h, i]
            for j in range(p):
                value += compliance[h, i, j] * force[h, j]
            miss[h, i] = value
            total += value.real**2 + value.imag**2
    return float(np.sqrt(total))


@COMPILED
def _newton(compliance: Array, tau: Array, orders: Array, miss: Array, J: Array, r: Array) -> None:
    """Fill in r with the changes that undo `miss`."""
    H, p = miss.shape
    n = H * p
    still = p if orders[0] == 0 else 0
    for h in range(H):
        for i in range(p):
            row = h * p + i
            r[row] = miss[h, i].real
            if row >= still:
                r[n + row - still] = miss[h, i].imag
    _jacobian(compliance, tau, orders, J)
    eliminate(J, r)


@COMPILED
def _jacobian(compliance: Array, tau: Array, orders: Array, J: Array) -> None:
    """Fill in what is missed by the harmonics of the motion: Toeplitz and Hankel in the tangent's harmonics."""
    H, p = len(orders), compliance.shape[1]
    n = H * p
    still = p if orders[0] == 0 else 0
    for h in range(H):
        half = 0.5 if orders[h] == 0 else 1.0
        for i in range(p):
            row = h * p + i
            for k in range(H):
                order = orders[h] - orders[k]
                for j in range(p):
                    column = k * p + j
                    wave = tau[j, order] if order >= 0 else tau[j, -order].conjugate()
                    A = compliance[h, i, j] * wave * half
                    B = compliance[h, i, j] * tau[j, orders[h] + orders[k]] * half
                    if orders[k] == 0:
                        A, B = 2.0 * A, 0j
                    one = 1.0 if row == column else 0.0
                    J[row, column] = one + (A + B).real
                    if column >= still:
                        J[row, n + column - still] = (B - A).imag
                    if row >= still:
                        J[n + row - still, column] = (A + B).imag
                        if column >= still:
                            J[n + row - still, n + column - still] = one + (A - B).real


@COMPILED
def follow(around: Around, layer: Layer, X: Array, change: Array, out: Array) -> None:
    """Fill in the force's fundamentals once the harmonics in balance have followed what changes.

    The implicit function theorem on what :func:`balance` found.

    Parameters
    ----------
    change : ndarray, (s, h, p, u)
        Of the harmonics X (s, h, p), at forces that are held.
    out : ndarray, (s, p, u)
    """
    period, tau, _ = _room(layer)
    for s in range(len(X)):
        _force_of(around, layer, s, X[s], layer.orders, layer.slap, period)
        _transform(period.tangent, period, tau)
        _followed(around.compliance[s], tau, layer.orders, change[s], out[s])


@COMPILED
def growth(around: Around, layer: Layer, X: Array, more: Array, grown: Array) -> None:
    """Fill in how the stiffness that harmonics add changes with the fundamentals, which the harmonics follow.

    Parameters
    ----------
    grown : ndarray, (s, p, p)
        Filled: change of `more` at each point by the logarithm of the fundamental at each.
    """
    fundamental, orders = around.fundamental, layer.orders
    steps, H, p = X.shape
    period, tau, alone = _room(layer)
    change = np.empty((H, p, p), np.complex128)
    for s in range(steps):
        _force_of(around, layer, s, X[s], orders[:0], np.zeros(layer.slap.shape), period)
        _transform(period.tangent, period, alone)
        _force_of(around, layer, s, X[s], orders, layer.slap, period)
        _transform(period.tangent, period, tau)
        for h in range(H):
            twice = 1.0 if orders[h] == 0 else 2.0
            for j in range(p):
                force = twice * _wave(fundamental[s, j], 1, tau[j], orders[h])
                for i in range(p):
                    change[h, i, j] = -around.compliance[s, h, i, j] * force
        _followed(around.compliance[s], tau, orders, change, grown[s])
        for i in range(p):
            a = fundamental[s, i]
            grown[s, i, i] += 2.0 * (_wave(a, 1, tau[i], 1) - _wave(a, 1, alone[i], 1))
            for j in range(p):
                grown[s, i, j] /= a if a != 0.0 else 1.0 + 0.0j
            grown[s, i, i] -= more[s, i]


@COMPILED
def _followed(compliance: Array, tau: Array, orders: Array, change: Array, out: Array) -> None:
    """What :func:`follow` fills in at one step, with the tangent's harmonics tau (p, n)."""
    H, p, columns = change.shape
    n, still = H * p, p if orders[0] == 0 else 0
    J, right = np.empty((2 * n - still, 2 * n - still)), np.empty((2 * n - still, columns))
    for h in range(H):
        for i in range(p):
            row = h * p + i
            for j in range(columns):
                right[row, j] = change[h, i, j].real
                if row >= still:
                    right[n + row - still, j] = change[h, i, j].imag
    _jacobian(compliance, tau, orders, J)
    eliminate_columns(J, right)
    out[:] = 0.0
    for h in range(H):
        for i in range(p):
            k = h * p + i
            for j in range(columns):
                x = complex(right[k, j], right[n + k - still, j] if k >= still else 0.0)
                out[i, j] += 2.0 * _wave(x, orders[h], tau[i], 1)


@COMPILED
def by_softening(
    opening: Array, lost: Array, gap: Array, spacing: float, off: Array, slope: Array, onto: Array
) -> Array:
    """What a unit of softening at each knot takes off the force, per weight, projected on waves, (s, p, m, n).

    Parameters
    ----------
    opening, lost : ndarray, (s, p, t)
        Along a period, and the share of the stiffness that is lost there since the `gap` (p,).
    spacing, off, slope : float, ndarray (g, n)
        Of the table's openings; what is taken off there by each knot, and its slope.
    onto : ndarray, (m, t)
    """
    knots = off.shape[1]
    taken, at_gap = np.empty(knots), np.empty(knots)
    out = np.zeros((*opening.shape[:2], len(onto), knots))
    for s in range(opening.shape[0]):
        for i in range(opening.shape[1]):
            _taken_off(gap[i], spacing, off, slope, at_gap)
            for t in range(opening.shape[2]):
                x, share = opening[s, i, t], lost[s, i, t]
                _taken_off(abs(x), spacing, off, slope, taken)
                keep = (1.0 - share) * np.sign(x)
                for n in range(knots):
                    taken[n] = keep * taken[n] + share * at_gap[n]
                for m in range(len(onto)):
                    for n in range(knots):
                        out[s, i, m, n] += onto[m, t] * taken[n]
    return out


@COMPILED
def _taken_off(size: float, spacing: float, off: Array, slope: Array, taken: Array) -> None:
    """Fill in what is taken off at an opening, by each knot (n,): straight slopes between the table's points."""
    place = min(size / spacing, len(off) - 1.0)
    k = min(int(place), len(off) - 2)
    part = place - k
    for n in range(len(taken)):
        here = slope[k, n] + part * (slope[k + 1, n] - slope[k, n])
        taken[n] = off[k, n] + part * spacing * (slope[k, n] + here) / 2


@COMPILED
def _wave(x: complex, order: int, tau: Array, h: int) -> complex:
    """Fourier coefficient h >= 0 of a tangent times a wave Re(x exp(i order theta))."""
    if order == 0:
        return tau[h] * x.real
    below = tau[h - order] if h >= order else tau[order - h].conjugate()
    return 0.5 * (x * below + x.conjugate() * tau[h + order])
