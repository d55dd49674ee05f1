"""Forces that go by a port's own motion: the joint's law at the layer's points, and what causes add elsewhere.

The stiffness of a port depends on its own amplitude, and that on all the ports' stiffness: Newton's method finds both.
With L the receptances among the ports and r those from the drive,

    d = (1 + L S(|d|))^-1 r F,        response = r_out F - R_out,d S d.

The force F is not needed where a response was measured, which tells how far everything moves: |d| = |d / response|
times its amplitude has one solution where a given force has three, and folds do no harm.  The implicit function theorem
says how the ports follow any other change of the model; without it a sensitivity near a slider that begins to slip is
wrong by half of itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.jenkins import RIPPLES, common_spring
from twin.identify.limits import LIMITS
from twin.identify.model_modification import NoiseMotion, NonlinearForce
from twin.identify.nonlinear.balance import Added, Balance
from twin.identify.nonlinear.balance_kernel import NEWTON, PackedPorts, PackedSliders, Turn, settle
from twin.identify.nonlinear.joint_law import LayerLaw, packed_laws
from twin.identify.nonlinear.running_amplitude import running_loss_basis
from twin.identify.slipping import Slider
from twin.identify.slipping_kernel import slide_address


@dataclass(frozen=True)
class Surroundings:
    """The rig around n ports, without their forces, at s steps."""

    among: Array
    """Receptances among the ports, (s, n, n)."""
    driven: Array
    """Displacement of the ports per drive force, (s, n)."""
    reference: Array
    """What the reference channel reads per drive force, (s,)."""
    to_reference: Array
    """The same per force on each port, (s, n)."""
    amplitude: Array
    """Complex, that channel's measured reading, (s,)."""

    def of_steps(self, rows: NDArray[np.intp]) -> Surroundings:
        """At some of the steps."""
        return Surroundings(*(values[rows] for values in vars(self).values()))

    def motion(self, stiffness: Array) -> Array:
        """Complex amplitudes (s, n) of the ports with `stiffness` (s, n) there."""
        with_springs = np.eye(stiffness.shape[1]) + self.among * stiffness[:, None, :]
        driven = np.linalg.solve(with_springs, self.driven[:, :, None])[:, :, 0]
        reading = self.reference - np.sum(self.to_reference * stiffness * driven, axis=1)
        return np.asarray(driven / reading[:, None] * self.amplitude[:, None])

    def reading(self, stiffness: Array) -> tuple[Array, Array, Array]:
        """The ports' motion (s, n), what the reference channel reads per force (s,), d log of that / d stiffness."""
        n = stiffness.shape[1]
        right = np.concatenate([self.driven[:, :, None], self.among], axis=2)
        solved = np.linalg.solve(np.eye(n) + self.among * stiffness[:, None, :], right)
        driven, among = solved[:, :, 0], solved[:, :, 1:]
        held = self.to_reference * stiffness
        reading = self.reference - np.sum(held * driven, axis=1)
        to_reference = self.to_reference - (held[:, None, :] @ among)[:, 0]
        motion = driven / reading[:, None] * self.amplitude[:, None]
        return motion, reading, -to_reference * driven / reading[:, None]


@dataclass(frozen=True)
class Influence:
    """What stiffness at the ports does."""

    motion: Array
    """d log (complex amplitude of port i) / d (stiffness of port j), (s, n, n)."""
    response: Array
    """d log (response) / d (stiffness of port j), (s, o, n)."""


@dataclass(frozen=True)
class LocalForces:
    """Forces of the joints' laws at the layers' points, openings before slips, then nonlinear forces.

    Each acts on its own port.
    """

    forces: tuple[NonlinearForce, ...]
    weights: Array
    """Of the layers' points at each step: a modulus times its weight is a stiffness, (s, 2 p)."""
    joint: NDArray[np.int64]
    """Whose law each point has, (p,)."""
    ripples: Array | None = None
    """Displacement of each force's port by a force there at 3, 5 and 7 times the drive's frequency, m/N, with what the
    law does at each step; without the law's doing if not given, (s, m, 3)."""

    def of_steps(self, rows: NDArray[np.intp]) -> LocalForces:
        """At some of the steps."""
        ripples = None if self.ripples is None else self.ripples[rows]
        return replace(self, weights=self.weights[rows], ripples=ripples)

    @property
    def points(self) -> int:
        """Number of the layers' points."""
        return len(self.joint)

    def of_joint(self, joint: int) -> NDArray[np.intp]:
        """Which points are a joint's."""
        return np.flatnonzero(self.joint == joint)

    def stiffness(
        self, laws: Sequence[LayerLaw], amplitude: Array, omega: Array, squares: Array
    ) -> tuple[Array, Array]:
        """Equivalent stiffness at amplitudes (s, n), and its derivative with the logarithm of each; (s, n) both.

        Parameters
        ----------
        squares
            What harmonics add to the slips', see :attr:`Added.squares`.
        """
        p = self.points
        k, growth = np.zeros((2, len(amplitude), 2 * p), complex)
        for number, law in enumerate(laws):
            opening, slip = self.of_joint(number), p + self.of_joint(number)
            by_opening, open_slope = law.softening_with_slope(amplitude[:, opening])
            by_slip, slip_slope = running_loss_basis(law, amplitude[:, slip], squares[:, self.of_joint(number)])
            k[:, opening], k[:, slip] = -(by_opening @ law.softening), 1j * (by_slip @ law.loss)
            growth[:, opening], growth[:, slip] = -(open_slope @ law.softening), 1j * (slip_slope @ law.loss)
        k, growth = k * self.weights, growth * self.weights
        if not self.forces:
            return k, growth
        own, own_growth = self._with_growth(amplitude[:, 2 * p :], omega, np.arange(len(omega)))
        return np.concatenate([k, own], axis=1), np.concatenate([growth, own_growth], axis=1)

    def by_law(self, laws: Sequence[LayerLaw], amplitude: Array, squares: Array) -> list[tuple[Array, Array]]:
        """Derivatives of :meth:`stiffness` at each joint's p points by its softening (s, p, n) and loss (s, p, m)."""
        found = []
        for number, law in enumerate(laws):
            opening, slip = self.of_joint(number), self.points + self.of_joint(number)
            by_softening = -self.weights[:, opening, None] * law.softening_basis(amplitude[:, opening])
            by_loss, _ = running_loss_basis(law, amplitude[:, slip], squares[:, self.of_joint(number)])
            found.append((by_softening, 1j * self.weights[:, slip, None] * by_loss))
        return found

    @property
    def act_in_noise(self) -> bool:
        """Whether any nonlinear force is felt in a broadband run."""
        return any(force.random is not None for force in self.forces)

    def substitutes(self, motion: tuple[NoiseMotion, ...], omega: Array) -> Array:
        """Dynamic stiffness (f, n) of the forces' best linear substitutes under noise that moves their ports so."""
        Z = np.zeros((len(omega), len(self.forces)), complex)
        for i, force in enumerate(self.forces):
            if force.random is not None:
                Z[:, i] = force.random(motion[i], omega)
        return Z

    def balance(
        self, laws: Sequence[LayerLaw], omega: Array, around: Surroundings, *, added: Added | None = None,
        start: Array | None = None,
    ) -> Balance:  # fmt: skip
        """Stiffness at the amplitudes that it itself allows.

        Bounded; the disagreement that is left of each step is told.

        Parameters
        ----------
        added
            Stiffness beside that of the law and the forces; none by default.
        start : ndarray, (s, n)
            Complex amplitudes to begin from; those without any force by default.
        """
        added = added or Added.nothing(around.driven.shape, self.points)
        omega = omega.real  # a motion that still grows has its frequency's forces
        if not around.driven.size:  # nothing of the rig goes by an amplitude
            return Balance(around.driven, around.driven, added, np.zeros(len(omega)))
        if start is None:
            start = around.motion(np.zeros_like(around.driven))
        motion = np.where(start == 0, 1e-300 + 0j, start)
        arrays = (
            *packed_laws(laws, self.joint), self.weights, around.among, around.driven, around.reference,
            around.to_reference, around.amplitude, added.stiffness, added.growth, added.log_amplitude,
            added.squares,
        )  # fmt: skip
        ports = PackedPorts(*(np.ascontiguousarray(a) for a in arrays))  # one layout, one compilation
        now = Turn.of(motion)
        self._settle(ports, omega, motion, np.arange(len(omega)), now)
        self._settle_beside(ports, omega, motion, now)
        return Balance(now.motion, now.stiffness, added, now.left, self.ripples)

    def _settle_beside(self, ports: PackedPorts, omega: Array, motion: Array, now: Turn) -> None:
        """Begin steps that did not settle anew from where a neighbour did, as far as that leads from step to step."""
        size = np.maximum(np.abs(ports.amplitude), 1e-300)
        left, before = int(np.sum(~now.settled)), len(omega) + 1
        while 0 < left < before:
            for side in (1, -1):
                settled = np.flatnonzero(now.settled)
                rows = np.setdiff1d(settled[(settled + side >= 0) & (settled + side < len(omega))] + side, settled)
                begun, found = motion.copy(), Turn.of(motion)
                begun[rows] = motion[rows - side] * (size[rows] / size[rows - side])[:, None]
                self._settle(ports, omega, begun, rows, found)
                better = rows[found.settled[rows]]
                motion[better] = begun[better]
                now.take(found, better)
            left, before = int(np.sum(~now.settled)), left

    def _settle(self, ports: PackedPorts, omega: Array, motion: Array, rows: NDArray[np.intp], now: Turn) -> None:
        """Newton's method at some rows from a motion of assumed size, which it moves; `now` is filled in there."""
        sliders = [force.slider for force in self.forces if force.slider]
        if len(sliders) == len(self.forces):
            own, growth = np.empty((2, len(motion), len(sliders)), complex)
            settle(ports, own, growth, motion, rows, now, self._packed(sliders, omega), NEWTON, True)
            return
        self._turn(ports, omega, motion, rows, now, sizes_alone=True)
        assumed, trial = motion.copy(), Turn.of(motion)
        trial.take(now, rows)
        for _ in range(NEWTON.turns):
            rows = rows[~now.settled[rows]]
            if not len(rows):
                break
            here, step = assumed[rows], trial.step[rows]
            longest = NEWTON.longest * np.maximum(np.abs(here), np.abs(trial.motion[rows]))
            assumed[rows] = here + np.minimum(1.0, longest / np.maximum(np.abs(step), 1e-300)) * step
            self._turn(ports, omega, assumed, rows, trial)
            better = rows[trial.left[rows] < now.left[rows]]
            motion[better] = assumed[better]
            now.take(trial, better)

    def _turn(
        self, ports: PackedPorts, omega: Array, motion: Array, rows: Array, out: Turn, *, sizes_alone: bool = False
    ) -> None:
        """Fill in `out` at some rows, for an assumed motion."""
        own, growth = np.empty((2, len(motion), len(self.forces)), complex)
        own[rows], growth[rows] = self._with_growth(np.abs(motion[rows, 2 * self.points :]), omega[rows], rows)
        no_turns = NEWTON._replace(turns=0)
        settle(ports, own, growth, motion, rows, out, self._packed([], omega), no_turns, sizes_alone)

    def follow(
        self, laws: Sequence[LayerLaw], amplitude: Array, omega: Array, influence: Influence, motion: Array,
        response: Array, added: Added,
    ) -> tuple[Array, Array]:  # fmt: skip
        """Changes of log motion (s, n, u) and log response (s, o, u) once the stiffness has followed the amplitude.

        Parameters
        ----------
        motion, response
            The same changes at a stiffness that is held.
        added
            What else of the stiffness follows.
        """
        own_growth = self.stiffness(laws, amplitude, omega.real, added.squares)[1]
        growth = own_growth[:, :, None] * np.eye(amplitude.shape[1])
        growth[:, : self.points, : self.points] += added.growth
        own = np.eye(amplitude.shape[1]) - (influence.motion @ growth).real
        k = growth @ np.linalg.solve(own, motion.real)
        return motion + influence.motion @ k, response + influence.response @ k

    def harmonics(self, motion: Array, count: int, omega: Array) -> Array:
        """Harmonics 1 ... count (s, n, count) of the nonlinear forces for complex amplitudes (s, n) of their ports."""
        amplitude, rows = np.abs(motion), np.arange(len(omega))
        values = [
            force.harmonics(amplitude[:, i], count, omega, *self._ripples(i, rows))
            for i, force in enumerate(self.forces)
        ]
        return np.stack(values, axis=1) * turned(motion, count)

    def harmonics_of(self, orders: Sequence[int], motion: Array, omega: Array) -> Array:
        """Harmonics (h, s, n) of some orders as in :meth:`harmonics`; a static part counts as none."""
        if not self.forces:
            return np.zeros((len(orders), *motion.shape), complex)
        found = self.harmonics(motion, max(orders), omega)
        return np.stack([found[:, :, h - 1] if h else np.zeros_like(motion) for h in orders])

    def harmonic_changes(self, here: Array, motion: Array, count: int, omega: Array, log_motion: Array) -> Array:
        """Changes (s, n, count, u) of :meth:`harmonics`, now `here`, with log motion (s, n, u)."""
        step = LIMITS.local_difference
        by_size = (self.harmonics(motion * (1 + step), count, omega) - here) / step
        by_phase = 1j * np.arange(1, count + 1) * here
        return np.asarray(
            by_size[..., None] * log_motion.real[:, :, None, :] + by_phase[..., None] * log_motion.imag[:, :, None, :]
        )

    def _with_growth(self, amplitude: Array, omega: Array, rows: Array) -> tuple[Array, Array]:
        """Stiffness of the forces at their ports' amplitudes at some steps, its derivative by their logarithms."""
        step = LIMITS.local_difference
        k, beyond = (self.equivalent(a, omega, rows) for a in (amplitude, amplitude * (1 + step)))
        return k, (beyond - k) / step

    def equivalent(self, amplitude: Array, omega: Array, rows: Array | None = None) -> Array:
        """Stiffness (s, n) of the nonlinear forces at their ports' amplitudes (s, n), at all steps or some."""
        rows = np.arange(len(omega)) if rows is None else rows
        values = [f.equivalent(amplitude[:, i], omega, *self._ripples(i, rows)) for i, f in enumerate(self.forces)]
        return np.stack(values, axis=1)

    def _ripples(self, number: int, rows: Array) -> tuple[Array, ...]:
        """What a slider slips into at some steps; nothing for another force, or where that is not known."""
        if self.ripples is None or self.forces[number].slider is None:
            return ()
        return (self.ripples[rows, number],)

    def _packed(self, sliders: Sequence[Slider], omega: Array) -> PackedSliders:
        values, compliance = np.empty((len(sliders), 2)), np.empty((len(omega), len(sliders), len(RIPPLES)), complex)
        common = np.empty((len(omega), len(sliders)))
        for i, slider in enumerate(sliders):
            values[i] = slider.stiffness, slider.slip_force
            compliance[:, i] = slider.compliance(omega) if self.ripples is None else self.ripples[:, i]
            common[:, i] = common_spring(compliance[:, i])
        at = slide_address() if sliders else 0
        return PackedSliders(values, compliance, common, LIMITS.local_difference, at)


def turned(motion: Array, count: int) -> Array:
    """Phases (..., count) of harmonics 1 ... count of a force whose motion (...,) has its own."""
    return np.exp(1j * np.angle(motion)[..., None] * np.arange(1, count + 1))
