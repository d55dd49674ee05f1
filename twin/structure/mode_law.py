"""A law of the layer's points seen through one mode: uniform moduli over a sensor's amplitude X.

The papers give the whole layer E' - g1(X) and G' + j g2(X), with X the amplitude of one sensor in the first mode.  The
joint's own law takes off E' at each point what its opening takes off, and loses by its slip.  Both are the same for one
mode where they give it the same complex eigenvalue at every X, that is the same frequency and damping::

    (K - g1 K_E + j g2 K_G) phi = lambda M phi        (K + sum w_i (- s(o_i) r_i r_i' + j l(q_i) t_i t_i')) phi = ...

One complex equation has two real unknowns: from the law of the points follow g1 and g2 at each X, in any mode.  The way
back is :mod:`twin.structure.law_of_mode`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr, solve

from twin.arrays import Array
from twin.joint import Curve
from twin.structure.layer_points import LayerPoints
from twin.structure.limits import LIMITS
from twin.structure.modes import normal_modes, rigid_motions
from twin.structure.structure import Structure

Function = Callable[[Array], Array]

TURNS, TOLERANCE = 80, 1e-10
TINY = 1e-300


@dataclass(frozen=True, eq=False)
class LayerPointLaw:
    """What a point's opening (m) takes off E', and what its slip (m) adds to G' as a loss modulus, N/m2."""

    softening: Curve
    loss: Curve


@dataclass(frozen=True)
class ComplexMode:
    """Its eigenvalue omega^2, and its shape with phi' phi = 1 in coordinates whose mass is one."""

    value: complex
    shape: Array


@dataclass(frozen=True, eq=False)
class LayerModes:
    """A structure in few coordinates: its lowest modes, and the statics of forces on its layer."""

    squares: Array
    """Of the elastic natural frequencies with the linear layer, (rad/s)^2, which are the diagonal of the stiffness,
    (m,)."""
    K_E: Array
    K_G: Array
    """Stiffness of the layer per unit of E' and of G', (m, m)."""
    rows: Array
    weights: Array
    """Of the layer's points, openings before slips, (2 p, m), (2 p,)."""
    sensor: Array
    """Row of the deflection whose amplitude X is, (m,)."""

    @staticmethod
    def of(
        structure: Structure, points: LayerPoints, *, E: float, G: float, sensor: Array, joint: int = 0
    ) -> LayerModes:  # fmt: skip
        """Reduce `structure` with linear layers of moduli E, G (N/m2); the amplitude of `sensor`, a row (n,), is X.

        Rigid motions are left out: the layer's forces are in balance, so none of them moves by the law.
        """
        layer = structure.joints[joint]
        K = structure.stiffness(E, G)
        modes = normal_modes(structure.M, K, 24)
        rigid = rigid_motions(modes.omega)
        held = modes.omega[rigid] * (structure.M @ modes.Phi[:, :rigid])
        statics = solve(K + held @ held.T, np.vstack([layer.B_E, layer.B_G]).T, assume_a="pos")
        statics -= modes.Phi @ (modes.Phi.T @ (structure.M @ statics))
        basis = qr(statics / np.linalg.norm(statics, axis=0), mode="economic", pivoting=True)
        V = np.hstack(
            [
                modes.Phi[:, rigid:],
                basis[0][:, np.abs(np.diag(basis[1])) > LIMITS.mode_law_independent * abs(basis[1][0, 0])],
            ]
        )
        # In modes of the reduced structure, and from factors: mode 1 feels a minute part of the layer's stiffness.
        own = normal_modes(V.T @ structure.M @ V, V.T @ K @ V)
        V = V @ own.Phi
        B_E, B_G = layer.B_E @ V, layer.B_G @ V
        return LayerModes(own.omega**2, B_E.T @ B_E, B_G.T @ B_G, points.rows @ V, points.weights, sensor @ V)

    @property
    def points(self) -> int:
        """Number of the layer's points."""
        return len(self.weights) // 2

    def linear(self, number: int) -> ComplexMode:
        """The mode of that number, from 1, with the linear layer."""
        return ComplexMode(complex(self.squares[number - 1]), np.eye(len(self.squares))[number - 1] + 0j)

    def uniform(self, softening: float, loss: float, near: ComplexMode) -> ComplexMode:
        """The mode with E' - softening and G' + j loss in the whole layer, N/m2."""
        return self._mode(np.diag(self.squares) - softening * self.K_E + 1j * loss * self.K_G, near)

    def local(self, moduli: Array, near: ComplexMode) -> ComplexMode:
        """The mode with complex changes of the moduli (2 p,) at the points, N/m2."""
        return self._mode(np.diag(self.squares) + self._at_points(moduli), near)

    def by_moduli(self, mode: ComplexMode) -> Array:
        """d(eigenvalue) / d(moduli at the points), (2 p,)."""
        return np.asarray(self.weights * (self.rows @ mode.shape) ** 2)

    def amplitude_per_X(self, mode: ComplexMode, number: int) -> Array:
        """Openings and slips (2 p,) of the points per unit of X.

        X is the sensor's acceleration amplitude over the square of that mode's natural frequency with the linear layer.
        """
        reached = abs(self.sensor @ mode.shape) * abs(mode.value) / self.squares[number - 1]
        return np.abs(self.rows @ mode.shape) / max(reached, TINY)

    def log_amplitude_by_moduli(self, moduli: Array, mode: ComplexMode) -> Array:
        """Complex d(log motion at the points per X) / d(moduli at the points), (2 p, 2 p)."""
        K, shape, m = np.diag(self.squares) + self._at_points(moduli), mode.shape, len(self.squares)
        bordered = np.zeros((m + 1, m + 1), complex)
        bordered[:m, :m] = K - mode.value * np.eye(m)
        bordered[:m, m], bordered[m, :m] = -shape, shape
        motion = self.rows @ shape
        loads = np.vstack([-(self.rows * (self.weights * motion)[:, None]).T, np.zeros((1, len(motion)))])
        scale = np.append(self._scale(mode), 1.0)
        found = np.linalg.solve(bordered * scale * scale[:, None], loads * scale[:, None]) * scale[:, None]
        change, value = found[:m], found[m]
        own = (self.rows @ change) / np.where(motion == 0, TINY, motion)[:, None]
        return np.asarray(own - (self.sensor @ change) / (self.sensor @ shape) - value / mode.value)

    def receptance(self, moduli: Array, omega: float, forces: Array) -> Array:
        """Motion (m, f) by forces (f, m) of frequency omega, without damping but for that of the moduli (2 p,)."""
        dynamic = np.diag(self.squares - omega**2) + self._at_points(moduli)
        return np.asarray(np.linalg.solve(dynamic, forces.T + 0j))

    def _at_points(self, moduli: Array) -> Array:
        return np.asarray((self.rows.T * (self.weights * moduli)) @ self.rows)

    def _scale(self, mode: ComplexMode) -> Array:
        """Units (m,) in which stiffnesses near a mode are of order one.

        Those of the layer's statics are twenty decades above the lowest mode's, and rounding would decide.
        """
        return np.asarray(1.0 / np.sqrt(self.squares + abs(mode.value)))

    def _mode(self, K: Array, near: ComplexMode) -> ComplexMode:
        """The eigenvalue nearest to a guess, by inverse iteration with Rayleigh quotients."""
        value, shape, scale = near.value, near.shape, self._scale(near)
        scaled, mass = K * scale * scale[:, None], np.diag(scale**2)
        for _ in range(TURNS):
            shape = scale * np.linalg.solve(scaled - value * (1 + 1e-12) * mass, scale * shape)
            shape = shape / np.sqrt(shape @ shape)
            before, value = value, complex(shape @ K @ shape)
            if abs(value - before) < TOLERANCE * abs(value):
                break
        if not 0.1 < abs(value) / abs(near.value) < 10.0 or not np.isfinite(value):
            raise ValueError("joint.law: the structure has no mode near the one asked for at some amplitude")
        return ComplexMode(value, shape)


@dataclass(frozen=True)
class ModeFunctions:
    """Uniform moduli E' - softening and G' + j loss that act on one mode as the law of the points does."""

    amplitude_m: Array
    """X, (n,): the sensor's acceleration amplitude over the square of the mode's natural frequency with the linear
    layer."""
    softening: Array
    loss: Array
    """N/m2, (n,); NaN where no uniform moduli do."""
    eigenvalue: Array
    """Of the mode, complex, (rad/s)^2, (n,)."""
    motion_m: Array
    """Openings, then slips of the points, (n, 2 p)."""
    by_moduli: Array
    """Derivatives of softening and loss by the softening at each point's opening and by the loss at each point's slip,
    once the points' motion has followed, (n, 2, 2 p): times the law's basis at `motion_m` they are those by the law's
    values."""


def mode_functions(
    modes: LayerModes, softening: Function, loss: Function, amplitude_m: Array, *, number: int = 1
) -> ModeFunctions:
    """What a law of the points is to one mode.

    ValueError if at some amplitude the structure has no mode near the linear one of this number.

    Parameters
    ----------
    softening, loss
        Of openings and of slips (p,), m; N/m2.
    amplitude_m : ndarray, (n,)
        X of :class:`ModeFunctions`, rising from 0 or above.
    number
        Of the mode, from 1.
    """
    X = np.asarray(amplitude_m, float)
    p = modes.points
    g, values = np.full((2, len(X)), np.nan), np.zeros(len(X), complex)
    motion, by_moduli = np.zeros((len(X), 2 * p)), np.zeros((len(X), 2, 2 * p))
    mode = uniform = modes.linear(number)
    own = np.zeros(2)
    for n, x in enumerate(X):
        mode, motion[n], growth = _balanced(modes, softening, loss, x, mode, number)
        values[n] = mode.value
        own, uniform, by_value = _uniform_moduli(modes, mode.value, own, uniform)
        if not np.all(np.isfinite(own)):
            own, uniform = np.zeros(2), modes.linear(number)
            continue
        g[:, n] = own
        follow = modes.log_amplitude_by_moduli(_moduli(softening, loss, motion[n], p), mode)
        signs = np.repeat([-1.0, 1j], p)
        moved = np.eye(2 * p) - (follow * growth).real
        change = np.eye(2 * p) * signs + growth[:, None] * np.linalg.solve(moved, (follow * signs).real)
        eigenvalue = modes.by_moduli(mode) @ change
        by_moduli[n] = np.linalg.solve(by_value, np.array([eigenvalue.real, eigenvalue.imag]))
    return ModeFunctions(X, g[0], g[1], values, motion, by_moduli)


def _moduli(softening: Function, loss: Function, motion: Array, p: int) -> Array:
    return np.concatenate([-softening(motion[:p]) + 0j, 1j * loss(motion[p:])])


def _balanced(
    modes: LayerModes, softening: Function, loss: Function, X: float, near: ComplexMode, number: int
) -> tuple[ComplexMode, Array, Array]:
    """The mode at an amplitude, the points' motion (2 p,) and the growth of their moduli with its logarithm."""
    p, motion = modes.points, X * modes.amplitude_per_X(near, number)
    if X == 0:
        return modes.local(_moduli(softening, loss, motion, p), near), motion, np.zeros(2 * p, complex)
    log_a, share, worst = np.log(np.maximum(motion, TINY)), 1.0, np.inf
    trial, mode, growth = log_a, near, np.zeros(2 * p, complex)
    step = np.zeros(2 * p)
    for _ in range(TURNS):
        a = np.exp(trial)
        k = _moduli(softening, loss, a, p)
        up, down = (_moduli(softening, loss, a * (1 + side * LIMITS.mode_law_difference), p) for side in (1, -1))
        slope = (up - down) / (2 * LIMITS.mode_law_difference)
        found = modes.local(k, mode)
        gap = np.log(np.maximum(X * modes.amplitude_per_X(found, number), TINY)) - trial
        if np.max(np.abs(gap)) < worst or share < 1 / 64:
            log_a, mode, growth, worst, share = trial, found, slope, float(np.max(np.abs(gap))), 1.0
            if worst < TOLERANCE:
                break
            follow = modes.log_amplitude_by_moduli(k, found)
            step = np.linalg.solve(np.eye(2 * p) - (follow * slope).real, gap)
        else:
            share /= 4
        trial = log_a + share * np.clip(step, -LIMITS.mode_law_longest, LIMITS.mode_law_longest)
    return mode, np.exp(log_a), growth


def _uniform_moduli(
    modes: LayerModes, meant: complex, start: Array, near: ComplexMode
) -> tuple[Array, ComplexMode, Array]:
    """Softening and loss (2,) of the whole layer that give a mode an eigenvalue; NaN if none do; d(value) / d(them).

    Newton's steps are halved until the eigenvalue comes nearer: beyond the most damping that uniform moduli can give
    the mode there is no answer, and whole steps would wander until they met a layer stiffer or more lossy than any.
    """
    own, mode, trial, share = start, near, start, 1.0
    step: Array = np.zeros(2)
    closest, by_value = np.inf, np.eye(2)
    for _ in range(TURNS):
        try:
            found = modes.uniform(trial[0], trial[1], mode)
            miss = meant - found.value
        except ValueError:
            miss = complex(np.inf)
        if abs(miss) < closest:
            own, mode, closest, share = trial, found, abs(miss), 1.0
            by = np.array([-(mode.shape @ modes.K_E @ mode.shape), 1j * (mode.shape @ modes.K_G @ mode.shape)])
            by_value = np.array([by.real, by.imag])
            if closest < TOLERANCE * abs(meant):
                return own, mode, by_value
            step = np.asarray(np.linalg.solve(by_value, [miss.real, miss.imag]))
        elif share < LIMITS.least_share:
            break
        else:
            share /= 2
        trial = own + share * step
    return np.full(2, np.nan), mode, by_value
