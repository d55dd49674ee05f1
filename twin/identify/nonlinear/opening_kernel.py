"""Compiled: Newton's method for the harmonics of the layer's openings, step by step.

Real parts of all orders come first among the unknowns, then the imaginary parts of all but order zero: a static opening
has none.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from twin.arrays import Array
from twin.joint.compilation import COMPILED, INNER
from twin.joint.elimination import eliminate, eliminate_columns


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
    waves: Array
    """Cosine and sine of n theta at a period's samples, up to twice the highest order, (2, n, t)."""
    onto: Array
    """The same to transform by, over the number of samples, (2, t, n)."""
    table: Array
    """Openings evenly from zero, the layer's whole force there per weight, and its slope, (p, 3, g)."""
    slap: Array
    """Share of the stiffness lost beyond the gap, where the joint opens; the gap; the force at the gap, (p, 3)."""


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
    force, first, unsettled : ndarray, (s, h, p), (s, p), (s,)
        See :class:`twin.identify.nonlinear.opening_harmonics.OpeningBalance`; Fourier coefficient one of the force
        beyond the secant stiffness.
    """
    orders, compliance = layer.orders, around.compliance
    steps, H, p = X.shape
    n, still = H * p, p if orders[0] == 0 else 0
    _, waves, samples = layer.waves.shape
    path, tangent = np.empty((p, samples)), np.empty((p, samples))
    spectrum, tau = np.empty((p, waves), np.complex128), np.empty((p, waves), np.complex128)
    J, r = np.empty((2 * n - still, 2 * n - still)), np.empty(2 * n - still)
    base, taken = np.empty((H, p), np.complex128), np.empty((H, p), np.complex128)
    miss = np.empty((H, p), np.complex128)
    force, first, unsettled = np.empty_like(X), np.empty((steps, p), np.complex128), np.empty(steps)
    for s in range(steps):
        size = 1e-300
        for i in range(p):
            size = max(size, abs(around.fundamental[s, i]))
        nearest, share, settled = np.inf, 1.0, False
        unsettled[s] = np.inf
        for turn in range(turns + 1):
            _force_of(around, layer, s, X[s], path, tangent)
            _transform(path, layer.onto, spectrum)
            left = _missed(X[s], driven[s], compliance[s], spectrum, orders, force[s], miss)
            if settled:
                break
            # Where a contact opens within a step, whole steps may go round in circles: half of one, until it helps.
            if left < nearest or share <= shortest:
                _transform(tangent, layer.onto, tau)
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
            # The last step is taken too: differences between close balances are meaningful.
            settled = unsettled[s] < balanced
        for i in range(p):
            first[s, i] = spectrum[i, 1]
    return force, first, unsettled


@INNER
def _force_of(around: Around, layer: Layer, s: int, X: Array, path: Array, tangent: Array) -> None:
    """Fill in the force beyond the secant stiffness, (p, t), in a step with harmonics X (h, p), and its tangent."""
    points, samples = path.shape
    waves, slap = layer.waves, layer.slap
    for i in range(points):
        # The openings first, where the force will be.
        a = around.fundamental[s, i]
        for t in range(samples):
            path[i, t] = a.real * waves[0, 1, t] - a.imag * waves[1, 1, t]
        for h in range(len(X)):
            x, order = X[h, i], layer.orders[h]
            for t in range(samples):
                path[i, t] += x.real * waves[0, order, t] - x.imag * waves[1, order, t]
    for i in range(points):
        weight = around.weight[s, i]
        rest = around.secant[s, i] + layer.modulus[i] * weight
        for t in range(samples):
            opening = path[i, t]
            whole, slope = force_at(abs(opening), layer.table[i])
            value = whole if opening >= 0.0 else -whole
            if slap[i, 0] != 0.0 and opening > slap[i, 1]:
                value -= slap[i, 0] * (whole - slap[i, 2])
                slope *= 1.0 - slap[i, 0]
            path[i, t] = weight * value - rest * opening
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


@INNER
def _transform(values: Array, onto: Array, out: Array) -> None:
    """Fill in Fourier coefficients (p, n) of samples (p, t)."""
    _, samples, count = onto.shape
    real, imaginary = np.empty(count), np.empty(count)
    for i in range(len(values)):
        for n in range(count):
            real[n] = imaginary[n] = 0.0
        # Orders inside: a sum along the samples would wait for each addition.
        for t in range(samples):
            value = values[i, t]
            for n in range(count):
                real[n] += value * onto[0, t, n]
                imaginary[n] -= value * onto[1, t, n]
        for n in range(count):
            out[i, n] = complex(real[n], imaginary[n])


@INNER
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
            total += value.real * value.real + value.imag * value.imag
    return sqrt(total)


@INNER
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


@INNER
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
def spectra(around: Around, layer: Layer, X: Array, of_tangent: bool, out: Array) -> None:
    """Fill in Fourier coefficients (s, p, n) of the force beyond the secant stiffness, or of its tangent, at X."""
    steps, p, _ = out.shape
    path, tangent = np.empty((p, layer.waves.shape[2])), np.empty((p, layer.waves.shape[2]))
    for s in range(steps):
        _force_of(around, layer, s, X[s], path, tangent)
        _transform(tangent if of_tangent else path, layer.onto, out[s])


@COMPILED
def follow(compliance: Array, tau: Array, orders: Array, change: Array, out: Array) -> None:
    """Fill in the force's fundamentals and harmonics once the harmonics in balance have followed what changes.

    The implicit function theorem on what :func:`balance` found.

    Parameters
    ----------
    compliance, tau : ndarray, (s, h, p, p) and (s, p, n)
        What is around the openings; the tangent's harmonics from :func:`spectra`.
    change : ndarray, (s, h, p, u)
        Of the harmonics, at forces that are held.
    out : ndarray, (s, 1 + h, p, u)
        The fundamentals first.
    """
    steps, H, p, columns = change.shape
    n, still = H * p, p if orders[0] == 0 else 0
    J, right = np.empty((2 * n - still, 2 * n - still)), np.empty((2 * n - still, columns))
    for s in range(steps):
        for h in range(H):
            for i in range(p):
                row = h * p + i
                for j in range(columns):
                    right[row, j] = change[s, h, i, j].real
                    if row >= still:
                        right[n + row - still, j] = change[s, h, i, j].imag
        _jacobian(compliance[s], tau[s], orders, J)
        eliminate_columns(J, right)
        for row in range(1 + H):
            order = 1 if row == 0 else orders[row - 1]
            half = 0.5 if order == 0 else 1.0
            for i in range(p):
                for j in range(columns):
                    out[s, row, i, j] = 0j
                for h in range(H):
                    k, below = h * p + i, order - orders[h]
                    # The Fourier coefficient of the tangent times a wave Re(x exp(i order theta)), twice.
                    A = half * (tau[s, i, below] if below >= 0 else tau[s, i, -below].conjugate())
                    B = half * tau[s, i, order + orders[h]]
                    for j in range(columns):
                        if k < still:
                            out[s, row, i, j] += 2.0 * A * right[k, j]
                        else:
                            x = complex(right[k, j], right[n + k - still, j])
                            out[s, row, i, j] += A * x + B * x.conjugate()


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
                keep = 0.0 if x == 0.0 else 1.0 - share if x > 0.0 else share - 1.0
                for n in range(knots):
                    taken[n] = keep * taken[n] + share * at_gap[n]
                for m in range(len(onto)):
                    for n in range(knots):
                        out[s, i, m, n] += onto[m, t] * taken[n]
    return out


@INNER
def _taken_off(size: float, spacing: float, off: Array, slope: Array, taken: Array) -> None:
    """Fill in what is taken off at an opening, by each knot (n,): straight slopes between the table's points."""
    place = min(size / spacing, len(off) - 1.0)
    k = min(int(place), len(off) - 2)
    part = place - k
    for n in range(len(taken)):
        here = slope[k, n] + part * (slope[k + 1, n] - slope[k, n])
        taken[n] = off[k, n] + part * spacing * (slope[k, n] + here) / 2
