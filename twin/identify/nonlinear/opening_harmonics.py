"""Harmonics of the layer's openings: the law's time form moves the layer at multiples of the drive frequency, too.

The law's softening is a describing function; the one odd, single-valued force that has it is its time form here.  Its
harmonics move the openings, the structure's other modes answer them (the third harmonic of a sweep about one mode may
fall on another mode's resonance), and what they do comes back to the fundamental.  With the fundamentals given, the
other harmonics X_h of all points together solve

    X_h = C_h (drive's own harmonic F_h) - C_h (force - secant stiffness x opening)_h,

C_h the receptances with the law's secant stiffness in them, by alternating frequency-time and Newton's method with the
exact Jacobian, which is Toeplitz and Hankel in the harmonics of the tangent.

The law is the joint's own.  A layer that loses contact where it opens (a slap) goes on beyond the gap with `factor` of
its slope, on that side only: even harmonics, and less stiffness for the fundamental.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from twin.arrays import Array
from twin.identify.limits import LIMITS
from twin.identify.model_modification import Opening
from twin.identify.nonlinear.joint_law import LayerLaw, spacing, spline_basis
from twin.identify.nonlinear.opening_kernel import Around, Layer, balance, by_softening, follow, force_at, spectra

SAMPLES = 64
"""Of a period."""
TURNS, SHORTEST = 24, 1 / 16
"""Newton steps; three to five are usual.  And the share of one that is taken though it comes no nearer."""
GRID = 400
"""Points of a force's table."""
SHORTEST_WAVE = 1.0
"""Of a softening over the logarithm of opening, that its time form follows by half.  Harmonics follow its slopes, and
waves of a quarter's length, which noise makes and the fundamental hardly feels, would grow from fit to fit.  A law that
saturates keeps its harmonics to half a per cent, 4 % at its largest opening; with twice the length to 8 and 13 %."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(60)


@dataclass(frozen=True)
class Openings:
    """The p openings at s steps, and what surrounds them."""

    fundamental: Array
    """Complex amplitudes, m, (s, p)."""
    secant: Array
    """Stiffness that the law takes off each there, N/m (negative), (s, p)."""
    weight: Array
    """A modulus times it is a stiffness, (s, p)."""
    modulus: Array
    """E' of the joints, N/m2, (j,)."""
    joint: NDArray[np.int64]
    """Which of them each point belongs to, (p,)."""
    orders: tuple[int, ...]
    """The harmonics in question."""
    compliance: Array
    """Receptances among the openings at these harmonics, (s, h, p, p)."""
    driven: Array
    """Their motion by the drive's own harmonics, m, (s, h, p)."""
    to_slips: Array
    """Receptances from forces on the openings to the slips, (s, h, p, p)."""
    slips_driven: Array
    """The slips' motion by the drive's own harmonics, m, (s, h, p)."""

    def of_steps(self, rows: NDArray[np.intp]) -> Openings:
        """At some of the steps."""
        names = ("fundamental", "secant", "weight", "compliance", "driven", "to_slips", "slips_driven")
        return replace(self, **{name: getattr(self, name)[rows] for name in names})

    def slips(self, balance: OpeningBalance) -> Array:
        """Harmonics (s, h, p) of the slips that go with the openings', m."""
        return np.asarray(self.slips_driven - np.einsum("shpq,shq->shp", self.to_slips, balance.force))


@dataclass(frozen=True)
class OpeningBalance:
    """Harmonics in balance."""

    motion: Array
    """Of the openings, m, (s, h, p)."""
    force: Array
    """Of the law's force beyond its secant stiffness, N, (s, h, p)."""
    more: Array
    """Stiffness that the harmonics add to the fundamental's secant one, N/m, (s, p)."""
    unsettled: float
    """Largest Newton step that was left, over the fundamental."""


def at_harmonic(stiffness: Array, h: int) -> Array:
    """The law's stiffness at the points as harmonic h of their motion meets it.

    Within a period the loss is a force in proportion to velocity, whose coefficient the running amplitude sets.
    """
    return np.asarray(stiffness.real + 1j * h * stiffness.imag)


def has_harmonics(laws: Sequence[LayerLaw], slaps: Sequence[Opening | None]) -> bool:
    """Whether any layer's force has harmonics that its openings follow: it is not linear, or loses contact."""
    return any(np.any(law.vector) for law in laws) or any(slap is not None for slap in slaps)


def balance_openings(
    laws: Sequence[LayerLaw], openings: Openings, slaps: Sequence[Opening | None] = (), *, start: Array | None = None
) -> OpeningBalance:
    """Find the harmonics that go with given fundamentals.

    Parameters
    ----------
    slaps
        Lost contact in each joint, if there is any; the orders must then hold the even ones.
    start : ndarray, (s, h, p)
        Motion to begin from.
    """
    a = openings.fundamental
    shape = (len(a), len(openings.orders), a.shape[1])
    X = np.zeros(shape, complex) if start is None else start.copy()
    if not laws:
        return OpeningBalance(X, X, np.zeros(a.shape, complex), 0.0)
    layer = _layer(laws, openings, slaps)
    force, first, unsettled = np.empty(shape, complex), np.empty(a.shape, complex), np.empty(len(a))

    def settle(rows: NDArray[np.int64], share: float) -> None:
        """Balance these steps with a share of what is lost."""
        driven, motion = _one_layout(openings.driven[rows], X[rows])
        less = layer._replace(slap=layer.slap * [share, 1.0, 1.0])
        around = _around(openings, rows)
        found = balance(around, driven, less, motion, TURNS, LIMITS.opening_balanced, SHORTEST)
        X[rows], (force[rows], first[rows], unsettled[rows]) = motion, found

    settle(np.arange(len(a)), 1.0)
    stuck = np.flatnonzero(unsettled > LIMITS.opening_stuck)
    if len(stuck) and layer.slap[:, 0].any():
        X[stuck] = 0.0
        for share in LIMITS.little_by_little:
            settle(stuck, share)
    # Less what the time form makes of the fundamental alone: nothing, but for its table and its least slope.
    more = 2.0 * (first - _alone(openings, layer, of_tangent=False)[:, :, 1]) / _where_moving(a)
    return OpeningBalance(X, force, more, float(np.max(unsettled, initial=0.0)))


def growth_of_more(
    laws: Sequence[LayerLaw], openings: Openings, balance: OpeningBalance, slaps: Sequence[Opening | None] = ()
) -> Array:
    """Derivatives (s, p, p) of the stiffness that harmonics add, by the logarithms of the fundamentals, N/m."""
    a = openings.fundamental
    if not laws:
        return np.zeros((*a.shape, a.shape[1]), complex)
    layer, points = _layer(laws, openings, slaps), np.arange(a.shape[1])
    tau = _spectra(openings, layer, balance.motion, of_tangent=True)
    # The force's harmonics by the logarithms of the fundamentals, from orders 1 - h and 1 + h of the tangent.
    waves = np.stack([_of_wave(a, tau, h) * (1.0 if h == 0 else 2.0) for h in openings.orders], axis=1)
    grown = _followed(openings, layer, tau, -openings.compliance * waves[:, :, None, :])[:, 0].copy()
    alone = _alone(openings, layer, of_tangent=True)
    grown[:, points, points] += 2.0 * (_of_wave(a, tau, 1) - _of_wave(a, alone, 1))
    grown /= _where_moving(a)[:, :, None]
    grown[:, points, points] -= balance.more
    return grown


def sensitivity(
    laws: Sequence[LayerLaw], openings: Openings, motion: Array, moved: Array, *, slaps: Sequence[Opening | None] = ()
) -> tuple[list[tuple[Array, Array]], tuple[Array, Array]]:
    """Derivatives of the stiffness that harmonics add to the fundamental's, and of the slips' harmonics.

    The fundamentals are held, and the harmonics follow: the implicit function theorem on the balance of
    :func:`balance_openings`.

    Parameters
    ----------
    motion : ndarray, (s, h, p)
        Harmonics in balance.
    moved : ndarray, (s, h, 2 p, u)
        Change of the openings' harmonics, and of the slips' behind them, with parameters of what is around the
        openings, at forces that are held.

    Returns
    -------
    list of tuple of ndarray, (s, p, n) and (s, h, p, n)
        Per joint, by its law's softening at the knots; that moves the harmonics at the other joints' points as well.
    tuple of ndarray, (s, p, u) and (s, h, p, u)
        By these parameters.
    """
    a, orders = openings.fundamental, np.array(openings.orders)
    of_openings, of_slips = np.split(moved, 2, axis=2)
    if not laws:
        return [], (np.zeros((*a.shape, moved.shape[3]), complex), of_slips)
    layer = _layer(laws, openings, slaps)
    tau = _spectra(openings, layer, motion, of_tangent=True)
    waves = np.exp(1j * np.outer(_theta(), np.append(orders, 1)))
    # Amounts of these waves, the fundamental's last.  A static part is its mean.
    onto = (np.append(np.where(orders == 0, 1.0, 2.0), 2.0) / SAMPLES * waves.conj()).T
    alone = (a[:, :, None] * waves[:, -1]).real
    opening = alone + (motion.transpose(0, 2, 1) @ waves[:, :-1].T).real
    share, gap = layer.slap[:, :2].T
    lost = np.where(opening > gap[:, None], share[:, None], 0.0)
    at_rest = _where_moving(a)[:, :, None]
    out = []
    for joint, law in enumerate(laws):
        own = np.flatnonzero(openings.joint == joint)
        held = _abel(law.opening_knots.tobytes(), law.run_out), gap[own], openings.weight[:, own]
        by_law = _taken_off(opening[:, own], lost[:, own], onto, *held)
        alone_too = _taken_off(alone[:, own], 0 * alone[:, own], onto[-1:], *held)
        harmonics = by_law[:, :, :-1].swapaxes(1, 2)
        force = _followed(openings, layer, tau, -openings.compliance[..., own] @ harmonics)
        force[:, 0, own] += by_law[:, :, -1] - alone_too[:, :, 0]
        force[:, 1:, own] += harmonics
        out.append((force[:, 0] / at_rest, -openings.to_slips @ force[:, 1:]))
    force = _followed(openings, layer, tau, of_openings)
    return out, (force[:, 0] / at_rest, of_slips - openings.to_slips @ force[:, 1:])


def _around(openings: Openings, rows: NDArray[np.int64] | slice = slice(None)) -> Around:
    """What the kernel takes of some steps."""
    arrays = openings.fundamental, openings.secant, openings.weight, openings.compliance
    return Around(*_one_layout(*(array[rows] for array in arrays)))


def _layer(laws: Sequence[LayerLaw], openings: Openings, slaps: Sequence[Opening | None]) -> Layer:
    """What it takes of the layer."""
    orders, joint = np.array(openings.orders), openings.joint
    angle = np.outer(np.arange(2 * orders[-1] + 1), _theta())
    tables = np.array([_odd_force(law, E) for law, E in zip(laws, openings.modulus, strict=True)])
    lost = np.zeros((len(tables), 3))
    for row, slap, table in zip(lost, slaps or [None] * len(tables), tables, strict=True):
        if slap is not None:
            row[:] = 1 - slap.factor, slap.gap_m, force_at(slap.gap_m, table)[0]
    waves = np.array([np.cos(angle), np.sin(angle)])
    arrays = openings.modulus[joint], orders, waves, waves.transpose(0, 2, 1) / SAMPLES, tables[joint], lost[joint]
    return Layer(*_one_layout(*arrays))


def _spectra(openings: Openings, layer: Layer, motion: Array, *, of_tangent: bool) -> Array:
    """Fourier coefficients (s, p, n) of the force beyond the secant stiffness, or of its tangent."""
    out = np.empty((*openings.fundamental.shape, layer.waves.shape[1]), complex)
    spectra(_around(openings), layer, *_one_layout(motion), of_tangent, out)
    return out


def _alone(openings: Openings, layer: Layer, *, of_tangent: bool) -> Array:
    """The same of the fundamental alone, which loses no contact."""
    none = np.zeros((len(openings.fundamental), 0, len(layer.modulus)), complex)
    alone = layer._replace(orders=layer.orders[:0], slap=np.zeros_like(layer.slap))
    return _spectra(openings, alone, none, of_tangent=of_tangent)


def _followed(openings: Openings, layer: Layer, tau: Array, change: Array) -> Array:
    """Fundamentals and harmonics (s, 1 + h, p, u) of the force once the harmonics have followed their change."""
    steps, h, p, columns = change.shape
    force = np.empty((steps, 1 + h, p, columns), complex)
    compliance, change = _one_layout(openings.compliance, change)
    follow(compliance, tau, layer.orders, change, force)
    return force


def _of_wave(a: Array, tau: Array, h: int) -> Array:
    """Fourier coefficient h (s, p) of tangents tau (s, p, n) times the fundamentals' waves Re(a exp(i theta))."""
    below = tau[:, :, h - 1] if h else tau[:, :, 1].conj()
    return np.asarray(0.5 * (a * below + a.conj() * tau[:, :, h + 1]))


def _where_moving(a: Array) -> Array:
    """Fundamentals to divide by."""
    return np.where(a == 0, 1.0, a)


def _theta() -> Array:
    """A period's samples, (t,)."""
    return np.asarray(2 * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)


def _one_layout(*arrays: Any) -> list[Any]:
    """For one compilation whatever the arrays' order in memory."""
    return [np.ascontiguousarray(array) for array in arrays]


def _taken_off(
    opening: Array, lost: Array, onto: Array, table: tuple[Array, Array, Array], gap: Array, weight: Array
) -> Array:
    """What a unit of softening at each knot takes off the force along a period: amounts of waves, (s, p, m, n)."""
    (x, off, slope), m = table, len(onto)
    opening, lost, gap, parts = _one_layout(opening, lost, gap, np.vstack([onto.real, onto.imag]))
    projected = by_softening(opening, lost, gap, x[1], off, slope, parts)
    return np.asarray(-weight[:, :, None, None] * (projected[:, :, :m] + 1j * projected[:, :, m:]))


def _odd_force(law: LayerLaw, modulus: float) -> tuple[Array, Array, Array]:
    """Openings, the layer's whole force there per weight, and its slope: what has the law as its describing function.

    The inverse of f -> N(a) = 2 / (pi a) int_0^pi f(a cos t) cos t dt is Abel's; with u = sin t it reads
    f(x) = x / 2 int_0^(pi/2) (3 sin^3 t N(x sin t) + x sin^4 t N'(x sin t)) dt.
    """
    x, _, slopes = _abel(law.opening_knots.tobytes(), law.run_out)
    slope = np.maximum(modulus - slopes @ law.softening, LIMITS.least_tangent * modulus)
    # The integral of a slope that is straight between the grid's points, as the kernel has it.
    return x, cumulative_trapezoid(slope, x, initial=0.0), slope


@lru_cache(maxsize=16)
def _abel(knots: bytes, run_out: float) -> tuple[Array, Array, Array]:
    """A grid of openings (g,), and matrices (g, n) from a softening at the knots to the force it takes off there.

    The second one is that force's slope, of which the first is the integral as of one that is straight between points.
    """
    at = np.frombuffer(knots)
    last = at[-1]
    x = np.linspace(0.0, 1.5 * last, GRID)
    sine = np.sin((NODES + 1) * np.pi / 4)
    B, by_log = spline_basis(at, x[:, None] * sine, run_out)
    # x sin N' is the derivative by the logarithm
    matrix = np.einsum("t,gtn->gn", WEIGHTS * np.pi / 4 * sine**3, 3 * B + by_log) * (x / 2)[:, None]
    # Third differences, as the law's prior has them: second ones would straighten its whole course.
    third = np.diff(np.eye(len(at)), 3, axis=0)
    waves = (SHORTEST_WAVE / (2 * np.pi * spacing(at))) ** 6
    slopes = np.gradient(matrix @ np.linalg.inv(np.eye(len(at)) + waves * third.T @ third), x, axis=0)
    return x, cumulative_trapezoid(slopes, x, axis=0, initial=0.0), slopes
