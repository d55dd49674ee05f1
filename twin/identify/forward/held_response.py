"""A rig while the amplitude of one of its channels is held: how its layer moves, and what force that takes.

With the reading held, the motion of the layer's points follows from it, and with that their stiffness and the force:
one of each, where a force that is held may have three responses.  The openings' own harmonics are found at some
amplitudes; what they add to the fundamental's stiffness is a hundredth of it and smooth in between.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.arrays import Array
from twin.identify.forward.forward_model import ForwardModel
from twin.identify.forward.shaker_impedance import drive_stiffness
from twin.identify.jenkins import RIPPLES
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import LinearParameters
from twin.identify.linear.structural_modification import update_receptance
from twin.identify.nonlinear.balance import Added, finite_log
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.nonlinear.local_forces import LocalForces, Surroundings
from twin.identify.nonlinear.opening_harmonics import (
    Openings,
    at_harmonic,
    balance_openings,
    growth_of_more,
    has_harmonics,
)
from twin.identify.nonlinear.running_amplitude import squares_of

CHUNK = 4096
HARMONIC_TURNS = 2
"""Each leaves some twentieth of what harmonics add, most where a harmonic meets another resonance."""


@dataclass(frozen=True)
class HeldStates:
    """States of the rig, s of them."""

    motion: Array
    """Complex amplitudes of the moving ports: openings, slips, ports of nonlinear forces, m, (s, n)."""
    stiffness: Array
    """Of the law and the forces there, N/m, (s, n)."""
    response: Array
    """The channel's reading per force, (s,)."""
    by_stiffness: Array
    """d log(response) / d(stiffness at each port), m/N, (s, n)."""
    unsettled: Array
    """Relative disagreement of motion and stiffness, (s,)."""


class HeldRig:
    """A rig at f frequencies of its drive.

    Parameters
    ----------
    rig
        With its effects.
    laws
        Of each joint's points, nothing where they do not move.
    rest
        Softening and loss there, N/m2.
    output
        Number of the channel that is held.
    frequency : ndarray, (f,)
        Of the drive, rad/s.
    own_harmonics
        Whether the openings' harmonics act on their fundamental.
    """

    def __init__(
        self, rig: ForwardModel, base: LinearParameters, laws: Sequence[LayerLaw], rest: Sequence[tuple[float, float]],
        output: int, frequency: Array, *, own_harmonics: bool,
    ) -> None:  # fmt: skip
        self._rig, self._base, self.laws, self._rest, self._output = rig, base, laws, rest, output
        now = np.zeros(len(frequency))
        self.weights = rig.weights_at(now)
        self._at_rest = self.weights * self._at_points(rest)
        self._frequency, self.omega = frequency, rig.clock(frequency, now)
        self._per_reading = rig.surroundings_of(output, self._free(), self.omega, np.ones(len(frequency), complex))
        self._own_harmonics = own_harmonics and has_harmonics(laws, rig.slaps)

    def _at_points(self, of_joints: Sequence[tuple[float, float]]) -> Array:
        """Complex modulus (2 p,) that softening and loss of each joint, N/m2, are at its points."""
        joint = self._rig.points.joint
        softening, loss = np.reshape(of_joints, (-1, 2)).T
        return np.concatenate([-softening[joint], 1j * loss[joint]])

    @property
    def points(self) -> int:
        """Number of the layer's points."""
        return len(self._rig.points)

    def by_damping(self, rows: Array, states: HeldStates, mode: int) -> Array:
        """D log(response) (s,) / d log(damping ratio) of a mode, at the stiffness that `states` have."""
        zeta = self._base.zeta.copy()
        zeta[mode] *= 1 + LIMITS.held_response_difference
        base = replace(self._base, zeta=zeta)
        other = HeldRig(
            self._rig, base, self.laws, self._rest, self._output, self._frequency, own_harmonics=False
        )  # fmt: skip
        _, response, _ = other._per_reading.of_steps(rows).reading(states.stiffness)
        return np.asarray(np.log(response / states.response) / LIMITS.held_response_difference)

    def at_ends_of_law(self) -> tuple[Array, Array, Array]:
        """Responses (f,) without the law and with its last values; readings (f,) at which it has these.

        The latter are zero where there is no law.
        """
        p, around = self.points, self._per_reading
        last = self._at_points([(law.softening[-1], law.loss[-1]) for law in self.laws])
        stiffness = np.zeros_like(around.driven)
        stiffness[:, : 2 * p] = last * self.weights
        linear, most = around.reference, np.zeros(len(around.reference))
        _, at_last, _ = around.reading(stiffness)
        for k in (np.zeros_like(stiffness), stiffness):
            motion = np.abs(around.motion(k))
            for number, law in enumerate(self.laws):
                own = np.flatnonzero(self._rig.points.joint == number)
                if np.any(law.softening):
                    most = np.maximum(most, law.opening_knots[-1] / motion[:, own].max(axis=1))
                if np.any(law.loss):
                    most = np.maximum(most, law.slip_knots[-1] / motion[:, p + own].max(axis=1))
        return linear, at_last, most

    def at_resonance(self) -> float:
        """The largest response of the linear rig at a natural frequency within twice the drive's highest."""
        natural = self._rig.model.basis.omega
        natural = natural[natural < 2 * self._frequency.max()]
        now = np.zeros(len(natural))
        free = self._rig.receptance(natural, self._base, now, inner=False)
        return float(np.max(np.abs(self._rig.responses(free, natural)[:, self._output]), initial=0.0))

    def branch(self, low: Array, high: Array) -> HeldBranch:
        """Find the motion at readings from `low` to `high` (f,).

        From the least amplitude upwards, each from the ones before, so that all are on one branch.
        """
        every = np.arange(len(low))
        first = np.floor(np.log(low) / LIMITS.held_response_stride).astype(int)
        count = int(np.max(np.ceil(np.log(high) / LIMITS.held_response_stride) - first)) + 3
        shape = (count, *self._per_reading.driven.shape)
        more, log_motion = np.zeros(shape, complex), np.zeros(shape)
        added, ripples = Added.nothing(shape, self.points), self._linear_ripples(count)
        for turn in range(1 + HARMONIC_TURNS if self._own_harmonics else 1):
            motion, stiffness = np.zeros_like(more), np.zeros_like(more)
            for c in range(count):
                around = self.surroundings(every, np.exp((first + c) * LIMITS.held_response_stride))
                if turn:
                    start = log_motion[c]
                elif c < 2:
                    start = finite_log(np.abs(around.motion(np.zeros_like(around.driven))))
                else:
                    start = 2 * log_motion[c - 1] - log_motion[c - 2]
                found = self.forces(every, ripples[c]).balance(
                    self.laws, self.omega, around, added=added.of_steps(c), start=np.exp(start)
                )
                more[c] = found.more
                motion[c], stiffness[c] = found.motion, found.stiffness - more[c]
                log_motion[c] = finite_log(np.abs(found.motion))
            if self._own_harmonics and turn < HARMONIC_TURNS:
                added = self._by_harmonics(motion, stiffness, log_motion, ripples)
        return HeldBranch(self, first, more, added.squares, log_motion, ripples)

    def surroundings(self, rows: Array, reading: Array) -> Surroundings:
        """What is around the moving ports at some frequencies, with these readings."""
        return replace(self._per_reading.of_steps(rows), amplitude=reading + 0j)

    def forces(self, rows: Array, ripples: Array) -> LocalForces:
        """What acts at the moving ports there."""
        return LocalForces(self._rig.modification.nonlinear, self.weights[rows], self._rig.points.joint, ripples)

    def _linear_ripples(self, count: int) -> Array:
        """What the nonlinear forces slip into before the law takes anything off, (c, f, m, 3)."""
        if not self._rig.modification.nonlinear:
            return np.zeros((count, len(self.omega), 0, len(RIPPLES)), complex)
        own = slice(2 * self.points, None)
        among = [np.diagonal(self._at_harmonic(h)[:, own, own], axis1=1, axis2=2) for h in RIPPLES]
        return np.tile(np.stack(among, axis=2), (count, 1, 1, 1))

    def _by_harmonics(self, motion: Array, stiffness: Array, log_motion: Array, ripples: Array) -> Added:
        """What harmonics add (c, f, n) at each amplitude passed; `ripples` are filled with what sliders slip into."""
        p, orders = self.points, self._rig.orders
        among = [self._at_harmonic(h) for h in orders]
        added = replace(Added.nothing(motion.shape, p), log_amplitude=log_motion[..., :p].copy())
        joint = self._rig.points.joint
        softened = stiffness[:, :, :p].real / (self.weights[:, :p] * self._base.E[joint])
        gaps = np.array([slap.gap_m if slap else np.inf for slap in self._rig.slaps])[joint]
        lost = np.any(np.abs(motion[:, :, :p]) > gaps, axis=2)
        softer = np.abs(softened.min(axis=2)) > LIMITS.held_response_felt
        felt = np.argwhere(lost | softer | bool(self._rig.modification.nonlinear))
        for k in range(0, len(felt), CHUNK):
            c, rows = felt[k : k + CHUNK].T
            secant = stiffness[c, rows, : 2 * p]
            pairs = zip(among, orders, strict=True)
            with_law = [update_receptance(R[rows], slice(0, 2 * p), at_harmonic(secant, h)) for R, h in pairs]
            around = np.stack(with_law, axis=1)
            own = np.diagonal(around[:, [orders.index(h) for h in RIPPLES], 2 * p :, 2 * p :], axis1=2, axis2=3)
            ripples[c, rows] = own.swapaxes(1, 2)
            forces = self.forces(rows, ripples[c, rows])
            pushed = forces.harmonics_of(orders, motion[c, rows, 2 * p :], self.omega[rows]).swapaxes(0, 1)
            driven = -(around[:, :, :, 2 * p :] @ pushed[..., None])[..., 0]
            openings = Openings(
                motion[c, rows, :p], secant[:, :p].real, self.weights[rows, :p], self._base.E, joint, orders,
                around[:, :, :p, :p], driven[:, :, :p], around[:, :, p : 2 * p, :p], driven[:, :, p : 2 * p],
            )  # fmt: skip
            balance = balance_openings(self.laws, openings, self._rig.slaps)
            added.stiffness[c, rows, :p] = balance.more
            added.squares[c, rows] = squares_of(openings.slips(balance), orders)
            added.growth[c, rows] = growth_of_more(self.laws, openings, balance, self._rig.slaps)
        return added

    def _free(self, h: int = 1) -> Array:
        """Receptances at a multiple of the drive's frequency, with the law as it is where nothing moves."""
        omega = h * self.omega
        free = self._rig.receptance(omega, self._base, np.zeros(len(omega)), inner=False, points=True)
        return update_receptance(free, self._rig.moving[: 2 * self.points], at_harmonic(self._at_rest, h))

    def _at_harmonic(self, h: int) -> Array:
        """Receptances (f, n, n) among the moving ports at a multiple of the drive frequency, the shaker holding on."""
        rig, omega = self._rig, h * self.omega
        free = self._free(h)
        shaker = drive_stiffness(rig.evidence.rig.shaker, omega)
        free = update_receptance(free, np.array([rig.model.ports.drive]), shaker[:, None])
        at = rig.moving
        return np.asarray(free[:, at[:, None], at])


@dataclass(frozen=True, eq=False)
class HeldBranch:
    """What was found from small readings to large ones, for states in between to begin from."""

    rig: HeldRig
    first: Array
    """Number (f,) of the least reading in :data:`LIMITS.held_response_stride`, logarithmic."""
    more: Array
    """Stiffness that harmonics add, N/m, (c, f, n),"""
    squares: Array
    """what they add to the slips' running squares, m2, (c, f, p, 2),"""
    log_motion: Array
    """the logarithm of the moving ports' amplitudes,"""
    ripples: Array
    """and what sliders slip into, at each reading passed."""

    def states(self, rows: Array, reading: Array) -> HeldStates:
        """States at the frequencies `rows` (s,) and amplitudes (s,) of the channel's reading."""
        pieces = [self._chunk(rows[k : k + CHUNK], reading[k : k + CHUNK]) for k in range(0, max(len(rows), 1), CHUNK)]
        fields = zip(*(vars(piece).values() for piece in pieces), strict=True)
        return HeldStates(*map(np.concatenate, fields))

    def _chunk(self, rows: Array, reading: Array) -> HeldStates:
        rig, place = self.rig, np.log(reading) / LIMITS.held_response_stride - self.first[rows]
        lower = np.clip(place.astype(int), 1, len(self.more) - 3)
        share = (place - lower)[:, None]
        start = (1 - share) * self.log_motion[lower, rows] + share * self.log_motion[lower + 1, rows]
        t = np.clip(share, 0.0, 1.0)
        # Lagrange's cubics through the four amplitudes around.
        cubics = (t * (1 - t) * (t - 2) / 6, (t * t - 1) * (t - 2) / 2, t * (t + 1) * (2 - t) / 2, t * (t * t - 1) / 6)
        more, squares, ripples = (
            sum(
                cubic.reshape(-1, *(1,) * (known.ndim - 2)) * known[lower + n, rows]
                for n, cubic in enumerate(cubics, -1)
            )
            for known in (self.more, self.squares, self.ripples)
        )
        around = rig.surroundings(rows, reading)
        nothing, squares = Added.nothing(start.shape, rig.points), np.maximum(squares, 0.0)
        added = replace(nothing, stiffness=np.asarray(more), squares=squares)
        found = rig.forces(rows, np.asarray(ripples)).balance(
            rig.laws, rig.omega[rows], around, added=added, start=np.exp(start)
        )
        motion, response, by_stiffness = around.reading(found.stiffness)
        return HeldStates(motion, found.stiffness, response, by_stiffness, found.unsettled)
