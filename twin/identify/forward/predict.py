"""Responses of an identified rig: the force for a given acceleration, or every acceleration that a force may give.

The joint's law goes by the motion of each of the layer's points.  Where the amplitude of a channel is held, that motion
follows, and with it the moduli: the force that holds an amplitude A at a frequency is F = A / |H(omega, A)|, one for
each A.  Its crossings of a given force are all the steady states at that force.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.backbones.modal_prediction import ModalResponse
from twin.identify.forward.forward_model import ForwardModel
from twin.identify.forward.held_response import HeldBranch, HeldRig
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import Output, build_linear_model, nominal_parameters
from twin.identify.measured_data import MeasuredData, no_steps, reference_output
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.joint import Curve
from twin.rigs import LawTable, LayerLawTable, Rig, preload_name
from twin.structure.law_table import layer_table

GRID_POINTS = 240
TURNS, HALVINGS = 30, 60
"""Of the bracketed search for a root; and halvings of the bracket of those that it has not found by then."""
SETTLED = 1e-6
"""Relative disagreement of motion and stiffness that is told."""


def blank_data(rig: Rig, preload: str | None = None) -> MeasuredData:
    """A rig with all its response channels and nothing measured: what a prediction stands on."""
    outputs = tuple(Output(s.channel, s.quantity, rig.place_of(s.channel)) for s in rig.response_sensors)
    model = build_linear_model(rig, list(outputs), preload=preload)
    return MeasuredData(
        rig=rig,
        preload=preload_name(rig, preload),
        model=model,
        outputs=outputs,
        force=rig.force_sensor.channel,
        reference=reference_output(model),
        broadband=(),
        steps=no_steps(len(outputs)),
        unsettled=(),
        linear=None,
        runs=(),
    )


@dataclass(frozen=True)
class RigPrediction(ModalResponse):
    """One row a solution, as a :class:`ModalResponse`."""

    beyond: Array
    """Amplitude of the layer's points over the last that the law knows, the largest of opening and slip, (r,); where it
    exceeds one, `std` is wide.  Zero without a law."""
    unsettled: NDArray[np.bool_]
    """Where no motion of the layer was found that agrees with its own moduli, (r,)."""

    @property
    def unseen(self) -> NDArray[np.bool_]:
        """Where the layer moves farther than the law knows, (r,)."""
        return self.beyond > LIMITS.predict_seen


@dataclass(frozen=True)
class _Law:
    """A joint's law in a file: splines beside what it is at rest, and std of E' - softening and of the loss."""

    spline: LayerLaw
    rest: tuple[float, float]
    softening: Curve
    loss: Curve
    softening_std: Curve
    loss_std: Curve

    @staticmethod
    def of(table: LayerLawTable | None) -> _Law:
        nothing = np.zeros(2)
        if table is None:
            none = Curve(np.array([0.0, 1.0]), nothing)
            return _Law(LayerLaw.zero(*2 * (np.array([0.5, 1.0]),)), (0.0, 0.0), none, none, none, none)
        o, q = np.array(table.opening_m), np.array(table.slip_m)
        softening, loss = Curve(o, np.array(table.softening)), Curve(q, np.array(table.loss))
        stds = (Curve(x, np.array(s or np.zeros(len(x)))) for x, s in ((o, table.softening_std), (q, table.loss_std)))
        knots = [np.geomspace(max(x[0], LIMITS.least_knot * x[-1]), x[-1], LIMITS.law_knots) for x in (o, q)]
        rest = (float(softening.values[0]), float(loss.values[0]))
        off, lost = (curve(x) - zero for curve, x, zero in zip((softening, loss), knots, rest, strict=True))
        spline = LayerLaw(knots[0], knots[1], off, lost, LIMITS.corner)
        return _Law(spline, rest, softening, loss, *stds)

    def errors(self, opening: Array, slip: Array) -> tuple[Array, Array, Array]:
        """Standard deviations (s, p) of the moduli at openings and at slips (s, p); farthest over the law's last (s,).

        The law's own error goes with its value.  Beyond its last knot it is anybody's guess: it may go on as steeply
        as it went there.
        """
        std, farthest = [], np.zeros(len(opening))
        halves = ((opening, self.softening, self.softening_std), (slip, self.loss, self.loss_std))
        for amplitude, value, own in halves:
            past = amplitude / value.knots[-1]
            guess = np.ptp(value.values) * np.log(np.maximum(past, 1.0))
            known = np.hypot(own(amplitude), LIMITS.law_error * value(amplitude))
            std.append(np.hypot(known, guess))
            if np.any(value.values):
                farthest = np.maximum(farthest, past.max(axis=1))
        return std[0], std[1], farthest


class RigResponse:
    """Predicts the response of a rig at one of its channels.

    Parameters
    ----------
    evidence
        As from :func:`blank_data`.
    channel
        The one that is held or asked for: that of the file's law, or the one that moves most in the first mode.
    own_harmonics
        Whether the openings' own harmonics act on their fundamental.

    Raises
    ------
    ValueError
        If the rig file's law is not what a law of the layer could be.
    """

    def __init__(self, evidence: MeasuredData, *, channel: str | None = None, own_harmonics: bool = True) -> None:
        self._rig = ForwardModel(evidence)
        base = nominal_parameters(evidence.rig, evidence.preload)
        more_E, more_G = self._rig.moduli_factors
        self._laws = tuple(
            _Law.of(layer_table(evidence.rig, E=float(E), G=float(G), joint=joint))
            for joint, (E, G) in enumerate(zip(base.E * more_E, base.G * more_G, strict=True))
        )
        self._base = base
        table, names = next((joint.law for joint in evidence.rig.joints), None), evidence.channels
        asked = table.channel if channel is None and isinstance(table, LawTable) else channel
        self.channel = asked or names[evidence.reference]
        self._at = names.index(self.channel)
        self._derivative = evidence.outputs[self._at].derivative
        self._own_harmonics = own_harmonics

    def held(self, frequency_Hz: Array, acceleration_m_per_s2: Array) -> RigPrediction:
        """The forces that hold given acceleration amplitudes of the channel; `std` is the force's."""
        f, A = np.asarray(frequency_Hz, float), np.asarray(acceleration_m_per_s2, float)
        rig, row = self._at_frequencies(f)
        low, high = np.full(len(rig.omega), np.inf), np.zeros(len(rig.omega))
        reading = A / rig.omega[row] ** (2 - self._derivative)
        np.minimum.at(low, row, LIMITS.predict_smallest * reading)
        np.maximum.at(high, row, 1.1 * reading)
        return self._prediction(rig.branch(low, high), np.arange(len(f)), row, f, reading, held=A)

    def forced(self, frequency_Hz: Array, force_N: Array) -> RigPrediction:
        """Every steady acceleration that given force amplitudes can hold, branch by branch; `std` is its own."""
        f, F = np.asarray(frequency_Hz, float), np.asarray(force_N, float)
        branch, row, steps, reading = self._solutions(f, F)
        return self._prediction(branch, steps, row[steps], f[steps], reading, force=F[steps])

    def _at_frequencies(self, f: Array) -> tuple[HeldRig, Array]:
        """The rig at the distinct frequencies, and which of them each row has."""
        distinct, row = np.unique(f, return_inverse=True)
        omega = 2 * np.pi * distinct
        rig = HeldRig(
            self._rig, self._base, [law.spline for law in self._laws], [law.rest for law in self._laws], self._at,
            omega, own_harmonics=self._own_harmonics,
        )  # fmt: skip
        return rig, row

    def _solutions(self, f: Array, target: Array) -> tuple[HeldBranch, Array, Array, Array]:
        """All readings at which the force has its target: the branch they are on, rows in it, steps, readings."""
        rig, row = self._at_frequencies(f)
        least, most = np.full(len(rig.omega), np.inf), np.zeros(len(rig.omega))
        np.minimum.at(least, row, target)
        np.maximum.at(most, row, target)
        linear, at_last, past = (np.abs(value) for value in rig.at_ends_of_law())
        # Where the law has its last values the rig is linear, so that no solution lies above this one.
        top = np.maximum(LIMITS.past_law * past, 1.2 * most * np.maximum(linear, at_last))
        if self._rig.modification.nonlinear:
            # Other forces may bring any resonance to the drive's frequency, but lose no less than the linear rig.
            top = np.maximum(top, 1.5 * most * rig.at_resonance())
        bottom = np.maximum(
            LIMITS.predict_least * top,
            np.minimum(LIMITS.predict_smallest * top, 0.3 * least * np.minimum(linear, at_last)),
        )
        branch = rig.branch(bottom, top)
        grid = bottom[:, None] * (top / bottom)[:, None] ** np.linspace(0.0, 1.0, GRID_POINTS)
        across = np.repeat(np.arange(len(rig.omega)), GRID_POINTS)
        values = self._force(branch, across, grid.ravel()).reshape(grid.shape)
        at, low, high = [], [], []
        below: list[tuple[int, float]] = []
        for i, r in enumerate(row):
            excess = np.log(values[r] / target[i])
            if excess[0] >= 0:
                below.append((i, grid[r, 0] * np.exp(-excess[0])))
            points, excess = self._with_extrema(branch, r, grid[r], excess, target[i])
            for j in np.flatnonzero(np.signbit(excess[:-1]) != np.signbit(excess[1:])):
                at.append(i)
                low.append(points[j])
                high.append(points[j + 1])
        steps, reading = np.array(at, int), np.zeros(0)
        if at:
            reading = self._root(branch, row[steps], target[steps], np.log(low), np.log(high))
        steps = np.concatenate([np.array([i for i, _ in below], int), steps])
        reading = np.concatenate([[x for _, x in below], reading])
        order = np.lexsort((reading, steps))
        return branch, row, steps[order], reading[order]

    def _with_extrema(
        self, branch: HeldBranch, r: int, grid: Array, excess: Array, target: float
    ) -> tuple[Array, Array]:
        """The grid with points added where the curve turns without crossing zero between grid points."""
        turn = np.flatnonzero(np.diff(excess)[:-1] * np.diff(excess)[1:] < 0) + 1
        turn = turn[
            (np.abs(excess[turn]) < np.abs(excess[turn - 1])) & (np.abs(excess[turn]) < np.abs(excess[turn + 1]))
        ]
        turn = turn[np.abs(excess[turn]) < LIMITS.predict_near]
        if not len(turn):
            return grid, excess
        y0, y1, y2 = excess[turn - 1], excess[turn], excess[turn + 1]
        shift = 0.5 * (y0 - y2) / (y0 - 2 * y1 + y2)
        reading = grid[turn] * (grid[1] / grid[0]) ** shift
        values = np.log(self._force(branch, np.full(len(reading), r), reading) / target)
        points, all_values = np.concatenate([grid, reading]), np.concatenate([excess, values])
        order = np.argsort(points)
        return points[order], all_values[order]

    def _root(self, branch: HeldBranch, rows: Array, target: Array, a: Array, b: Array) -> Array:
        """Roots of log(force / target) over log reading between a and b, by the Illinois variant of false position.

        Where this takes too long, as over a kink, the bracket is halved until nothing is left of it.
        """
        fa, fb = (np.log(self._force(branch, rows, np.exp(x)) / target) for x in (a, b))
        for turn in range(TURNS + HALVINGS):
            with np.errstate(invalid="ignore", divide="ignore"):
                c = np.where(fa == fb, a, b - fb * (b - a) / (fb - fa))
            if turn >= TURNS:
                c = np.where(np.abs(fb) < LIMITS.predict_root, b, 0.5 * (a + b))
            fc = np.log(self._force(branch, rows, np.exp(c)) / target)
            crossed = np.signbit(fc) != np.signbit(fb)
            a, fa = np.where(crossed, b, a), np.where(crossed, fb, 0.5 * fa)
            b, fb = c, fc
            if np.max(np.abs(fc)) < LIMITS.predict_root:
                break
        return np.asarray(np.exp(b))

    def _force(self, branch: HeldBranch, rows: Array, reading: Array) -> Array:
        return np.asarray(reading / np.abs(branch.states(rows, reading).response))

    def _slope(self, branch: HeldBranch, rows: Array, reading: Array) -> Array:
        """Slope of log force over log reading; negative between two folds."""
        step = 1e-4
        up, down = (self._force(branch, rows, reading * np.exp(side * step)) for side in (1, -1))
        return np.asarray(np.log(up / down) / (2 * step))

    def _prediction(
        self, branch: HeldBranch, steps: Array, rows: Array, f: Array, reading: Array, *, held: Array | None = None,
        force: Array | None = None,
    ) -> RigPrediction:  # fmt: skip
        """Solutions at readings (r,), of which either the acceleration is `held` or the force is given."""
        rig, found = branch.rig, branch.states(rows, reading)
        p, to_acceleration = rig.points, (1j * rig.omega[rows]) ** (2 - self._derivative)
        by_modulus = (found.by_stiffness[:, : 2 * p] * rig.weights[rows] * np.repeat([1.0, 1j], p)).real
        parts, beyond, motion = np.zeros(len(rows)), np.zeros(len(rows)), np.abs(found.motion)
        for joint, law in enumerate(self._laws):
            own = np.flatnonzero(self._rig.points.joint == joint)
            softening_std, loss_std, farthest = law.errors(motion[:, own], motion[:, p + own])
            # All points of a joint err together, for they have one law.
            parts += np.sum(by_modulus[:, own] * softening_std, axis=1) ** 2
            parts += np.sum(by_modulus[:, p + own] * loss_std, axis=1) ** 2
            beyond = np.maximum(beyond, farthest)
        for mode, error in self._damping_errors():
            parts = parts + (error * rig.by_damping(rows, found, mode).real) ** 2
        relative, slope = np.sqrt(parts + LIMITS.response_error**2), self._slope(branch, rows, reading)
        A = reading * np.abs(to_acceleration) if held is None else held
        if force is None:
            force = reading / np.abs(found.response)
            std = relative * force
        else:
            with np.errstate(divide="ignore"):
                std = np.minimum(relative / np.abs(slope), 1.0) * A
        phase, unsettled = np.angle(-found.response * to_acceleration), found.unsettled > SETTLED
        return RigPrediction(steps, f, force, A, std, phase, _branches(steps), slope > 0, beyond, unsettled)

    def _damping_errors(self) -> list[tuple[int, float]]:
        """Modes whose damping ratio is uncertain, with its relative standard deviation.

        That of mode 1 has its part in the law's loss: a sweep tells their sum.
        """
        damping = self._rig.evidence.rig.damping
        std = damping.modal_ratio_std or []
        modes = zip(damping.modal_ratio[: LIMITS.damped_modes], std, strict=False)
        return [(mode, error / ratio) for mode, (ratio, error) in enumerate(modes) if mode and error]


def _branches(steps: Array) -> Array:
    """Number of each solution within its step; equal steps stand together."""
    first = np.searchsorted(steps, steps)
    return np.arange(len(steps)) - first
