"""Compiled: Newton's method for the harmonics of the layer's openings, step by step.

Real parts of all orders come first among the unknowns, then the imaginary parts of all but order zero: a static opening
has none.
"""

import numpy as np

from twin.arrays import Array
from twin.joint.elimination import COMPILED, eliminate, eliminate_columns

__all__ = ["balance", "by_softening", "force_at", "growth"]


@COMPILED
def balance(
    fundamental: Array, secant: Array, weight: Array, compliance: Array, driven: Array, modulus: Array, orders: Array,
    cosines: Array, sines: Array, table: Array, slap: Array, X: Array, force: Array, more: Array, unsettled: Array,
    turns: int, balanced: float, shortest: float,
) -> None:  # fmt: skip
    """Move harmonics X (s, h, p) to where they are in balance.

    Parameters
    ----------
    fundamental, secant, weight, compliance, driven, modulus, orders
        As in :class:`twin.identify.nonlinear.opening_harmonics.Openings`; order zero, if any, comes first.
    cosines, sines : ndarray, (n, t)
        Of n theta at a period's samples, up to twice the highest order.
    table : ndarray, (p, 3, g)
        Openings evenly from zero, the layer's whole force there per weight, and its slope.
    slap : ndarray, (p, 3)
        Share of the stiffness that is lost beyond the gap, where the joint opens; the gap; the force at the gap.
    force, more, unsettled : ndarray, (s, h, p), (s, p), (s,)
        Filled: see :class:`twin.identify.nonlinear.opening_harmonics.OpeningBalance`.
    turns, balanced, shortest
        Most Newton steps, the size of one that ends them, and the share that is taken though it comes no nearer.
    """
    steps, H, p = X.shape
    n, samples = H * p, cosines.shape[1]
    still = p if orders[0] == 0 else 0
    around, path, tangent = np.empty((p, samples)), np.empty((p, samples)), np.empty((p, samples))
    onto = np.ascontiguousarray(cosines.T), np.ascontiguousarray(sines.T)
    spectrum, tau = np.empty((p, len(cosines)), np.complex128), np.empty((p, len(cosines)), np.complex128)
    J, r = np.empty((2 * n - still, 2 * n - still)), np.empty(2 * n - still)
    base, taken = np.empty((H, p), np.complex128), np.empty((H, p), np.complex128)
    miss, none = np.empty((H, p), np.complex128), np.zeros(slap.shape)
    for s in range(steps):
        size = 1e-300
        for i in range(p):
            size = max(size, abs(fundamental[s, i]))
        nearest, share = np.inf, 1.0
        unsettled[s] = np.inf
        for turn in range(turns + 1):
            _open(fundamental[s], X[s], orders, cosines, sines, around)
            _forces(around, secant[s], weight[s], modulus, table, slap, path, tangent)
            _transform(path, onto, spectrum)
            left = _missed(X[s], driven[s], compliance[s], spectrum, orders, force[s], miss)
            # Where a contact opens within a step, whole steps may go round in circles: half of one, until it helps.
            if left < nearest or share <= shortest:
                _transform(tangent, onto, tau)
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
                _open(fundamental[s], X[s], orders, cosines, sines, around)
                _forces(around, secant[s], weight[s], modulus, table, slap, path, tangent)
                _transform(path, onto, spectrum)
                _missed(X[s], driven[s], compliance[s], spectrum, orders, force[s], miss)
                break
        # Less what the time form makes of the fundamental alone: nothing, but for its table and its least slope.
        _open(fundamental[s], X[s], orders[:0], cosines, sines, around)
        _forces(around, secant[s], weight[s], modulus, table, none, path, tangent)
        _transform(path, onto, tau)
        for i in range(p):
            a = fundamental[s, i]
            more[s, i] = 2.0 * (spectrum[i, 1] - tau[i, 1]) / (a if a != 0.0 else 1.0 + 0.0j)


@COMPILED
def _open(fundamental: Array, X: Array, orders: Array, cosines: Array, sines: Array, around: Array) -> None:
    """Fill in the openings (p, t) along a period."""
    for i in range(len(fundamental)):
        a = fundamental[i]
        for t in range(cosines.shape[1]):
            around[i, t] = a.real * cosines[1, t] - a.imag * sines[1, t]
        for h in range(len(orders)):
            x, order = X[h, i], orders[h]
            for t in range(cosines.shape[1]):
                around[i, t] += x.real * cosines[order, t] - x.imag * sines[order, t]


@COMPILED
def _forces(
    around: Array, secant: Array, weight: Array, modulus: Array, table: Array, slap: Array, path: Array, tangent: Array
) -> None:
    """Fill in the force beyond the secant stiffness, and its tangent, (p, t)."""
    for i in range(len(around)):
        rest = secant[i] + modulus[i] * weight[i]
        for t in range(around.shape[1]):
            size = abs(around[i, t])
            sign = 1.0 if around[i, t] >= 0.0 else -1.0
            whole, slope = force_at(size, table[i])
            value = sign * whole
            if slap[i, 0] != 0.0 and around[i, t] > slap[i, 1]:
                value -= slap[i, 0] * (whole - slap[i, 2])
                slope *= 1.0 - slap[i, 0]
            path[i, t] = weight[i] * value - rest * around[i, t]
            tangent[i, t] = weight[i] * slope - rest


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
def _transform(values: Array, onto: tuple[Array, Array], out: Array) -> None:
    """Fill in Fourier coefficients (p, n) of samples (p, t)."""
    cosines, sines = onto
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
def growth(
    fundamental: Array, secant: Array, weight: Array, compliance: Array, modulus: Array, orders: Array,
    cosines: Array, sines: Array, table: Array, slap: Array, X: Array, more: Array, grown: Array,
) -> None:  # fmt: skip
    """Fill in how the stiffness that harmonics add changes with the fundamentals, which the harmonics follow.

    The implicit function theorem on what :func:`balance` found.

    Parameters
    ----------
    grown : ndarray, (s, p, p)
        Filled: change of `more` at each point by the logarithm of the fundamental at each.
    """
    steps, H, p = X.shape
    n, samples = H * p, cosines.shape[1]
    still = p if orders[0] == 0 else 0
    around, path, tangent = np.empty((p, samples)), np.empty((p, samples)), np.empty((p, samples))
    onto = np.ascontiguousarray(cosines.T), np.ascontiguousarray(sines.T)
    tau, alone = np.empty((p, len(cosines)), np.complex128), np.empty((p, len(cosines)), np.complex128)
    J, right, none = np.empty((2 * n - still, 2 * n - still)), np.empty((2 * n - still, p)), np.zeros(slap.shape)
    for s in range(steps):
        _open(fundamental[s], X[s], orders[:0], cosines, sines, around)
        _forces(around, secant[s], weight[s], modulus, table, none, path, tangent)
        _transform(tangent, onto, alone)
        _open(fundamental[s], X[s], orders, cosines, sines, around)
        _forces(around, secant[s], weight[s], modulus, table, slap, path, tangent)
        _transform(tangent, onto, tau)
        for h in range(H):
            twice = 1.0 if orders[h] == 0 else 2.0
            for j in range(p):
                force = twice * _wave(fundamental[s, j], 1, tau[j], orders[h])
                for i in range(p):
                    row = h * p + i
                    value = -compliance[s, h, i, j] * force
                    right[row, j] = value.real
                    if row >= still:
                        right[n + row - still, j] = value.imag
        _jacobian(compliance[s], tau, orders, J)
        eliminate_columns(J, right)
        for i in range(p):
            a = fundamental[s, i]
            for j in range(p):
                force = 0j
                for h in range(H):
                    k = h * p + i
                    x = complex(right[k, j], right[n + k - still, j] if k >= still else 0.0)
                    force += _wave(x, orders[h], tau[i], 1)
                if i == j:
                    force += _wave(a, 1, tau[i], 1) - _wave(a, 1, alone[i], 1)
                grown[s, i, j] = 2.0 * force / (a if a != 0.0 else 1.0 + 0.0j) - (more[s, i] if i == j else 0.0)


@COMPILED
def by_softening(
    opening: Array, lost: Array, gap: Array, spacing: float, off: Array, slope: Array, onto: Array, out: Array
) -> None:
    """Fill in what a unit of softening at each knot takes off the force, per weight, projected on waves.

    Parameters
    ----------
    opening, lost : ndarray, (s, p, t)
        Along a period, and the share of the stiffness that is lost there since the `gap` (p,).
    spacing, off, slope : float, ndarray (g, n)
        Of the table's openings; what is taken off there by each knot, and its slope.
    onto : ndarray, (m, t)
    out : ndarray, (s, p, m, n)
    """
    knots = off.shape[1]
    taken, at_gap = np.empty(knots), np.empty(knots)
    out[:] = 0.0
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
