"""The rig with what an extension changes: what its channels answer to the drive, at each step and in broadband runs.

At every step the joint's law and local nonlinear forces have the stiffness that the motion of their own ports gives
them.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward.linear_forward_model import LinearForwardModel
from twin.identify.forward.shaker_impedance import drive_stiffness
from twin.identify.frequency_shifts import shift_of_run, shift_of_steps
from twin.identify.jenkins import RIPPLES
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import LinearParameters
from twin.identify.linear.structural_modification import update_receptance
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.identify.nonlinear.balance import Added, Balance, accelerated, finite_log
from twin.identify.nonlinear.local_forces import LocalForces, Surroundings
from twin.identify.nonlinear.opening_harmonics import (
    OpeningBalance,
    Openings,
    at_harmonic,
    balance_openings,
    growth_of_more,
    has_harmonics,
)
from twin.identify.nonlinear.running_amplitude import running_loss, squares_of
from twin.identify.spectra.broadband import BinnedResponse

Free = tuple[Array, Array]
"""Receptances (s, p, p) at a multiple of the drive frequency, and omega (s,)."""
AtHarmonic = tuple[Array, Array, Array]
"""Receptances (s, p, p) at a multiple of the drive frequency, the drive's force there (s,), and omega (s,)."""

HARMONIC_TURNS, HARMONICS_SETTLED, LOSS_SETTLED = 16, 1e-6, 1e-4
"""Most turns of fundamentals and harmonics; the change of what the latter add to the former, over the law's largest
stiffness, that ends them; and that below which the slips' loss, as harmonics meet it, changes no more."""


class ForwardModel(LinearForwardModel):
    """The same with the joint's law and local nonlinear forces at the steps.

    Attributes
    ----------
    moving : ndarray of int
        Ports of the points, openings before slips, and of the extension's nonlinear forces.
    local : LocalForces
        What acts there.
    slaps : tuple of Opening or None, j
        One-sided contact in each joint.
    """

    def __init__(self, evidence: MeasuredData, modification: ModelModification | None = None) -> None:
        super().__init__(evidence, modification)
        count = len(self.model.ports.outer)
        forces = np.arange(count)[self.nonlinear_ports]
        self.moving = np.concatenate([np.arange(count, len(self.step_model.ports.outer)), forces])
        self.slaps = tuple(self.modification.opening.get(joint.name) for joint in self.model.structure.joints)
        weights = self.weights_at(self.step_times)
        self.local = LocalForces(self.modification.nonlinear, weights, self.points.joint)

    def weights_at(self, time_s: Array) -> Array:
        """Of the layer's points (t, 2 p): what a drift has left of E' is left of what the law takes off it, too."""
        weights = np.tile(self.points.weights, (len(time_s), 1))
        weights[:, : len(self.points)] *= self.normal_left(time_s)[:, self.points.joint]
        return weights

    def broadband_receptance(
        self, data: BinnedResponse, baseline: BaselineParameters, omega: Array, *, inner: bool = False
    ) -> tuple[Array, Array]:
        """Receptances at the run's time, without local nonlinear forces; and the rig's own omega."""
        time = self.run_times(data, omega)
        omega = self.clock(omega, time)
        base = self.base_in(data, baseline)
        return self.receptance(omega, base, time, inner=inner, drive=data.drive), omega

    def base_in(self, data: BinnedResponse, baseline: BaselineParameters) -> LinearParameters:
        """The linear parameters as they were in a broadband run."""
        shift = shift_of_run(self.evidence, data, baseline.shifts)
        return baseline.base.shifted(data.frequency_offset + shift)

    def step_omega(self, baseline: BaselineParameters) -> Array:
        """Complex frequencies (s,) at which the model without drift and shift responds as the rig does at the steps."""
        omega = self.clock(self.evidence.steps.complex_omega, self.step_times)
        return np.asarray(omega / (1 + shift_of_steps(self.evidence, baseline.shifts)))

    def step_receptance(
        self, baseline: BaselineParameters, *, inner: bool = True, held: Balance | None = None
    ) -> tuple[Array, Array, Balance]:
        """Receptances at the steps' drive frequencies, with all that acts at the moving ports; omega; their balance.

        Parameters
        ----------
        held
            A balance nearby: what the harmonics added there is added here, too, instead of being found anew.
        """
        time = self.step_times
        omega = self.step_omega(baseline)
        free = self.receptance(omega, baseline.base, time, inner=inner, points=True, drive=self.evidence.steps.drive)
        around = self.surroundings(free, omega)
        if held is not None:
            # A model with further forces may be held to a balance without them: they come last.
            stiffness, added = np.zeros_like(around.driven), held.added.of_ports(len(self.moving))
            stiffness[:, : held.stiffness.shape[1]] = held.stiffness
            start = around.motion(stiffness)
            found = self.local_at(held).balance(baseline.laws, omega, around, added=added, start=start)
        else:
            found = self._with_harmonics(baseline, omega, around)
        return update_receptance(free, self.moving, found.stiffness), omega, found

    def _with_harmonics(self, baseline: BaselineParameters, omega: Array, around: Surroundings) -> Balance:
        """Fundamentals and harmonics of the layer's openings, in turn."""
        found = self.local.balance(baseline.laws, omega, around)
        if not (has_harmonics(baseline.laws, self.slaps) and len(omega)):
            return found
        p, changed, largest = len(self.points), np.inf, 0.0
        harmonics = np.zeros((len(omega), len(self.orders), p), complex)
        before: tuple[Added, Array] | None = None
        rows = np.arange(len(omega))
        free = {h: self._free_at_harmonic(h, baseline) for h in self.orders}
        for turn in range(HARMONIC_TURNS):
            # The second time at least, with the loss that the slips' harmonics leave.
            if turn < 2 or changed > LOSS_SETTLED * largest:
                at_harmonics = [self.at_harmonic(h, baseline, found, free=free[h]) for h in self.orders]
                ports = self.moving[2 * p :]
                rippling = [around[0] for h, around in zip(self.orders, at_harmonics, strict=True) if h in RIPPLES]
                found = replace(found, ripples=np.stack([R[:, ports, ports] for R in rippling], axis=2))
                secant = self._secant(found)[:, :p].real
                largest = float(np.max(np.abs(secant), initial=0.0))
            # Not the secant, which the compliances at the harmonics contain: only both together are exact.
            openings = replace(self.openings(baseline, found, at_harmonics), secant=secant).of_steps(rows)
            balance = balance_openings(baseline.laws, openings, self.slaps, start=harmonics[rows])
            here, harmonics[rows] = found.of_steps(rows), balance.motion
            squares = squares_of(openings.slips(balance), openings.orders)
            local = self.local_at(found).of_steps(rows)
            beyond = self.added_by_harmonics(baseline, local, here, balance, squares)
            change = np.abs(beyond).max(axis=1, initial=0.0)
            changed = float(change.max())
            amplitude, more = np.abs(here.motion), np.zeros_like(here.stiffness)
            more[:, :p] = balance.more
            growth = growth_of_more(baseline.laws, openings, balance, self.slaps)
            added, used = Added(more, growth, finite_log(amplitude[:, :p]), squares), here.added.squares
            taken = accelerated(added, used, before)
            moved = local.balance(baseline.laws, omega[rows], around.of_steps(rows), added=taken, start=here.motion)
            found = found.with_steps(rows, moved)
            if turn:
                left = np.flatnonzero(change >= HARMONICS_SETTLED * largest)
                rows, before = rows[left], (added.of_steps(left), used[left])
            if not len(rows):
                break
        return found

    def local_at(self, balance: Balance) -> LocalForces:
        """The local forces, with what they slip into at a balance; if that knows all of them."""
        ripples = balance.ripples
        known = ripples is not None and ripples.shape[1] == len(self.local.forces)
        return replace(self.local, ripples=ripples) if known else self.local

    def added_by_harmonics(
        self, baseline: BaselineParameters, local: LocalForces, found: Balance, harmonics: OpeningBalance,
        squares: Array,
    ) -> Array:  # fmt: skip
        """Stiffness (s, 2 p) that harmonics, with these squares of the slips, add beyond what they add in a balance."""
        p = len(self.points)
        slips = np.abs(found.motion[:, p : 2 * p])
        now, before = (
            running_loss(baseline.laws, self.points.joint, slips, each) for each in (squares, found.added.squares)
        )
        lossier = 1j * local.weights[:, p:] * (now - before)
        return np.concatenate([harmonics.more, lossier], axis=1) - found.more[:, : 2 * p]

    def surroundings(self, free: Array, omega: Array) -> Surroundings:
        """What is around the moving ports at the steps, from receptances without what acts there."""
        return self.surroundings_of(self.evidence.reference, free, omega, self.undrifted_reading)

    def surroundings_of(self, output: int, free: Array, omega: Array, reading: Array) -> Surroundings:
        """The same at any frequencies (f,), from the readings (f,) of any one output."""
        at, outputs, into = self.moving, self.model.ports.outputs, self.driven(free, omega)
        driven = self.measured(into[:, outputs], omega)[:, output]
        to_output = self.measured_change(free[:, outputs][:, :, at], omega)[:, output]
        return Surroundings(free[:, at[:, None], at], into[:, at], driven, to_output, reading)

    @cached_property
    def undrifted_reading(self) -> Array:
        """What the reference channel would show (s,) of the motion that it measured, at :meth:`clock`'s omega."""
        reference = self.evidence.reference
        faster = self.moduli_left(self.step_times) ** -0.5
        return np.asarray(
            self.evidence.steps.response[:, reference, 0] * faster ** self.model.outputs[reference].derivative
        )

    @property
    def orders(self) -> tuple[int, ...]:
        """Harmonics of the openings that are balanced."""
        return LIMITS.even_too if self.modification.opening else LIMITS.odd_harmonics

    def openings(
        self, baseline: BaselineParameters, balance: Balance, around: Sequence[AtHarmonic] | None = None
    ) -> Openings:
        """The layer's openings at the steps, and what surrounds them at multiples of the drive frequency.

        Parameters
        ----------
        around
            What :meth:`at_harmonic` returns for each of the :attr:`orders`, where it is known.
        """
        p, drive, orders = len(self.points), self.model.ports.drive, self.orders
        at = self.moving[: 2 * p]
        compliance, driven = [], []
        around = around or [self.at_harmonic(h, baseline, balance) for h in orders]
        for (R, force, _), own in zip(around, self.forced_harmonics(baseline, balance, orders), strict=True):
            compliance.append(R[:, at[:, None], at[:p]])
            by_own = R[:, at][:, :, self.nonlinear_ports] @ own[:, :, None]
            driven.append(R[:, at, drive] * force[:, None] - by_own[:, :, 0])
        to_points, points_driven = np.stack(compliance, axis=1), np.stack(driven, axis=1)
        return Openings(
            balance.motion[:, :p], self._secant(balance)[:, :p].real, self.local.weights[:, :p], baseline.base.E,
            self.points.joint, orders, to_points[:, :, :p], points_driven[:, :, :p], to_points[:, :, p:],
            points_driven[:, :, p:],
        )  # fmt: skip

    def forced_harmonics(self, baseline: BaselineParameters, balance: Balance, orders: Sequence[int]) -> Array:
        """Harmonics (h, s, m) of the nonlinear forces at a balance."""
        omega = self.step_omega(baseline).real
        return self.local_at(balance).harmonics_of(orders, balance.motion[:, 2 * len(self.points) :], omega)

    def _secant(self, balance: Balance) -> Array:
        """The law's stiffness (s, 2 p) at the points, without what harmonics add to the openings'."""
        p = len(self.points)
        secant = balance.stiffness[:, : 2 * p].copy()
        secant[:, :p] -= balance.more[:, :p]
        return secant

    def _free_at_harmonic(self, h: int, baseline: BaselineParameters, *, inner: bool = False) -> Free:
        """Receptances at a multiple of the drive frequency without the joint's law, and omega."""
        time = self.step_times
        omega = h * self.step_omega(baseline).real
        drive = self.evidence.steps.drive
        return self.receptance(omega, baseline.base, time, inner=inner, points=True, drive=drive), omega

    def at_harmonic(
        self, h: int, baseline: BaselineParameters, balance: Balance, *, inner: bool = False, free: Free | None = None
    ) -> AtHarmonic:
        """Receptances at a multiple of the drive frequency, with the law's secant stiffness; drive force (s,); omega.

        Where a harmonic of the force was not measured, the shaker is there in its place.  Even ones move the openings
        too little to be taken into account: what lost contact does is many times that.  `free` is the same without law
        and shaker, where it is known.
        """
        steps = self.evidence.steps
        R, omega = free or self._free_at_harmonic(h, baseline, inner=inner)
        secant = self._secant(balance)
        R = update_receptance(R, self.moving[: 2 * len(self.points)], at_harmonic(secant, h))
        force = np.zeros(len(steps), complex)
        if 0 < h <= steps.force.shape[1]:
            known = np.isfinite(steps.force_variance[:, h - 1])
            force = np.where(known, steps.force[:, h - 1], 0.0)
            if not known.all():
                softening = (secant.real * balance.motion[:, : secant.shape[1]])[:, : len(self.points)]
                shaker = np.where(known, 0.0, self._held_by_shaker(h, R, omega, softening))
                R = update_receptance(R, np.array([self.model.ports.drive]), shaker[:, None])
        return R, force * (h % 2), omega

    def read_of_openings(self, around: Sequence[AtHarmonic]) -> Array:
        """What the response channels read (s, h, o, p) per force on the openings, from :meth:`at_harmonic`."""
        at, outputs = self.moving[: len(self.points)], self.model.ports.outputs
        read = [
            (self.model.to_quantity(omega) * self.channel_factors(omega)[0])[:, :, None] * R[:, outputs][:, :, at]
            for R, _, omega in around
        ]
        return np.stack(read, axis=1)

    def _held_by_shaker(self, h: int, R: Array, omega: Array, softening: Array) -> Array:
        """Dynamic stiffness (s,) that the shaker opposes to a harmonic of the motion, N/m.

        The rig file's is a guess, as good as its own size; the force over the reference channel's response says it
        better where that stands out of the noise.  The joint's `softening` (s, p), as it is shared out at the
        fundamental, makes the response beside the force.
        """
        steps, reference, p = self.evidence.steps, self.evidence.reference, len(self.points)
        drive = self.model.ports.drive
        each = np.array([drive_stiffness(shaker, omega) for shaker in self.evidence.shakers])
        guess = each[steps.drive, np.arange(len(steps))]
        ratio, error = steps.force_ratio[:, h - 1], steps.force_ratio_std[:, h - 1]
        measured = np.isfinite(error)
        if not measured.any():
            return guess
        at, outputs = self.moving[:p], self.model.ports.outputs
        to_outputs = R[:, outputs]
        both = np.concatenate([to_outputs[:, :, at] @ softening[:, :, None], to_outputs[:, :, [drive]]], axis=2)
        read = self.measured_change(both, omega)[:, reference]
        at_drive = np.einsum("sp,sp->s", R[:, drive, at], softening)
        # The drive's motion beside the force, where so much softening makes a unit of response.
        motion = (1 - read[:, 1] * ratio) * at_drive + R[:, drive, drive] * ratio * read[:, 0]
        measured &= motion != 0
        found = np.where(measured, -ratio * read[:, 0] / np.where(measured, motion, 1.0), 0.0)
        variance = np.abs(found * np.where(measured, error, 0.0)) ** 2
        weight = np.where(measured, np.abs(guess) ** 2 / np.maximum(variance, 1e-200), 0.0)
        return np.asarray((guess + weight * found) / (1 + weight))

    @property
    def nonlinear_ports(self) -> slice:
        """Where the nonlinear forces' ports are."""
        stop = self.model.ports.extra.stop - (1 if self.modification.base_receptance else 0)
        return slice(stop - len(self.modification.nonlinear), stop)
