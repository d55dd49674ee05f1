"""The softening that acts as is meant although the layer's openings have harmonics of their own.

A softening force has a third harmonic, a tenth of the first and more, and a layer that gives way to it opens at that
harmonic, too.  The fundamental of the force is then another by some per cent than under pure sines of the openings, of
which a law's table tells.  Where a file means E'(X) as the layer acts in its first mode, the table must differ by that
much; it is found by going round, as long as it helps: balance the harmonics at some amplitudes, compare, correct.  The
correction is smooth whatever corners the functions have; were every knot corrected by itself, they would part.
"""

import numpy as np
from scipy.interpolate import PchipInterpolator

from twin.arrays import Array
from twin.joint import Curve, table_of_softening
from twin.structure.limits import LIMITS
from twin.structure.mode_law import LayerModes, LayerPointLaw, mode_functions

ORDERS = np.array([3, 5, 7])
SAMPLES = 128
AMPLITUDES = 40
TURNS, INNER_TURNS, TOLERANCE = 12, 80, 1e-6


def with_own_harmonics(modes: LayerModes, law: LayerPointLaw, largest_m: float) -> LayerPointLaw:
    """The law to tabulate so that the points act with the softening of `law` in the first mode.

    Parameters
    ----------
    largest_m
        Largest amplitude X of the sensor that `law` goes to.
    """
    meant, p = law.softening, modes.points
    if not np.any(meant.values):
        return law
    X = np.linspace(0.0, largest_m, AMPLITUDES + 1)[1:]
    motion, compliance = _surroundings(modes, law, X)
    farthest = np.argmax(np.abs(motion), axis=1)
    row, a = np.arange(len(X)), np.abs(motion).max(axis=1)
    secant = meant(np.abs(motion))
    table, best, least, correction = meant, meant, np.inf, np.zeros(len(X))
    for _ in range(TURNS):
        acting = _acting(table, motion, secant, modes.weights[:p], compliance)[row, farthest]
        miss = meant(a) - acting
        missed = float(np.linalg.norm(miss))
        if not missed < least:
            break
        best, least = table, missed
        correction = correction + LIMITS.own_harmonics_relaxation * miss
        more = PchipInterpolator([0.0, *a], [0.0, *correction])(np.clip(meant.knots, 0.0, a[-1]))
        table = Curve(meant.knots, meant.values + more)
    return LayerPointLaw(best, law.loss)


def _surroundings(modes: LayerModes, law: LayerPointLaw, X: Array) -> tuple[Array, Array]:
    """Complex openings (x, p) in the first mode, m, and receptances (x, h, p, p) among them at its harmonics."""
    p, found = modes.points, mode_functions(modes, law.softening, law.loss, X)
    motion, compliance = np.zeros((len(X), p), complex), np.zeros((len(X), len(ORDERS), p, p), complex)
    near, rows = modes.linear(1), modes.rows[:p]
    for n, amplitude in enumerate(found.motion_m):
        moduli = np.concatenate([-law.softening(amplitude[:p]) + 0j, 1j * law.loss(amplitude[p:])])
        near = modes.local(moduli, near)
        phase = rows @ near.shape / (modes.sensor @ near.shape)
        motion[n] = amplitude[:p] * phase / np.abs(phase)
        for h, order in enumerate(ORDERS):
            compliance[n, h] = rows @ modes.receptance(moduli, order * np.sqrt(near.value.real), rows)
    return motion, compliance


def _acting(table: Curve, motion: Array, secant: Array, weights: Array, compliance: Array) -> Array:
    """Softening (x, p) that acts on the fundamentals, with the openings' harmonics in balance with the force's."""
    force = table_of_softening(table, limit_m=2.0 * max(float(table.knots[-1]), float(np.abs(motion).max())))
    theta = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    onto, back = np.exp(-1j * np.outer(theta, ORDERS)) * 2 / SAMPLES, np.exp(1j * np.outer(ORDERS, theta))
    sine = (motion[:, :, None] * np.exp(1j * theta)).real
    o = np.zeros((len(motion), motion.shape[1], len(ORDERS)), complex)
    for _ in range(INNER_TURNS):
        opening = sine + (o @ back).real
        # Most of the force is linear in the opening and in the receptances already; the rest is soon in balance.
        rest = (force.force_history(opening) + secant[:, :, None] * opening) * weights[:, None]
        before, o = o, o + LIMITS.own_harmonics_relaxation * (-np.einsum("xhpq,xqh->xph", compliance, rest @ onto) - o)
        if np.max(np.abs(o - before)) < TOLERANCE * np.max(np.abs(motion)):
            break
    first = force.force_history(sine + (o @ back).real) @ np.exp(-1j * theta) * 2 / SAMPLES
    return np.asarray(-(first / motion).real)
