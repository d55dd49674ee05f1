"""Multi-harmonic balance of the rig in its local coordinates, with continuation over frequency and amplitude.

The unknowns are a handful per harmonic, however fine the elements (see :mod:`twin.response.system`); Newton's matrix is
exact.  Newton is trusted only where it contracts (:mod:`twin.response.continuation`); elsewhere a steady state is
reached along its branch: from rest by raising the drive, from a neighbour by moving the frequency.  So which of several
steady states is found follows from where they lie, and not from rounding.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from twin.arrays import Array
from twin.bench.build import Built
from twin.bench.limits import LIMITS as BENCH
from twin.response import continuation
from twin.response.continuation import Course
from twin.response.kernel import drive_slope
from twin.response.limits import LIMITS
from twin.response.outcome import ENDED, FOUND, LONG, WORDS
from twin.response.solutions import Failure, PeriodicSolution, SolutionBranch, SolutionSweep
from twin.response.stability import floquet_multipliers
from twin.response.system import SineDrive, system_of, transfer

MOST_ITERATIONS = 30


class _State(NamedTuple):
    """Unknowns and local forces at a frequency (rad/s) and an amplitude of the drive."""

    x: Array
    w: float
    amplitude: float
    F: Array
    iterations: int
    jumped: bool = False


class _Way(NamedTuple):
    """Points along a branch: unknowns, parameter, forces and Newton steps; and how it ended."""

    outcome: int
    X: Array
    P: Array
    F: Array
    iterations: Array


class HarmonicBalance:
    """Steady states of a reduced rig under a sine of given amplitude.

    Parameters
    ----------
    built
        From :attr:`twin.bench.Bench.built`.
    samples
        A period, as forces are taken between frequency and time.
    internal_rate_Hz
        Of the bench whose modes it shall have.
    """

    _kernel: Any = continuation

    def __init__(
        self, built: Built, *, harmonics: int = 7, samples: int = 256, internal_rate_Hz: float = LIMITS.model_rate_Hz
    ) -> None:
        self._poles = built.poles(0.0, internal_rate_Hz)
        self._elements = built.elements()
        self._locals = built.locals
        self._channels = slice(built.locals + built.auxiliaries, None)
        self._H, self._n = harmonics, 2 * harmonics + 1
        self._system = continuation.with_kernels(system_of(built, self._poles, harmonics=harmonics, samples=samples))

    def solve(
        self,
        frequency_Hz: float,
        amplitude: float,
        *,
        start: PeriodicSolution | None = None,
        tolerance: float = LIMITS.balance_tolerance,
    ) -> PeriodicSolution:
        """The steady state at one frequency: on the branch of a neighbour, or where rest leads as the drive is raised.

        Parameters
        ----------
        amplitude
            Peak of the generator's sine: V, or N where the bench has no shaker.
        start
            A steady state of this object, near in frequency and amplitude.

        Raises
        ------
        ArithmeticError
            If there is none to be found; with the reason.
        """
        w = 2 * np.pi * frequency_Hz
        if start is None:
            found = self._from_rest(w, amplitude, tolerance)
        else:
            found = self._onward(self._state(start), w, amplitude, tolerance)
        if isinstance(found, Failure):
            raise ArithmeticError(f"harmonic balance finds no steady state at {found}")
        return self._told([found])[0]

    def sweep(self, frequencies_Hz: Sequence[float], amplitude: float) -> SolutionSweep:
        """Steady states of a stepped sweep, each on the branch of the one before.

        Where that branch turns back before the next frequency, the sweep jumps to where the branch comes by that
        frequency in the end, or to the state that rest leads to if it never does; the solution says so.  Frequencies
        without a steady state are told, and the sweep goes on from rest.
        """
        found: list[_State] = []
        failures: list[Failure] = []
        before: _State | None = None
        for frequency in frequencies_Hz:
            w = 2 * np.pi * frequency
            reached = (
                self._from_rest(w, amplitude, LIMITS.balance_tolerance) if before is None else self._stepped(before, w)
            )
            if isinstance(reached, Failure):
                failures.append(reached)
                before = None
            else:
                found.append(reached)
                before = reached
        return SolutionSweep(tuple(self._told(found)), tuple(failures))

    def branch(
        self, start_Hz: float, stop_Hz: float, amplitude: float, *, step: float = 0.05, most: int = 2000
    ) -> SolutionBranch:
        """The branch from one frequency to another, through folds, by pseudo-arclength continuation.

        Parameters
        ----------
        start_Hz, stop_Hz
            Ends; the branch may turn between them.
        step
            Greatest arclength of a step, in relative units of the unknowns and of the span of frequency.
        most
            Points after which it gives up.
        """
        begin, end = 2 * np.pi * start_Hz, 2 * np.pi * stop_Hz
        first = self._from_rest(begin, amplitude, LIMITS.balance_tolerance)
        if isinstance(first, Failure):
            return SolutionBranch((), first)
        course = Course(begin, end, float(amplitude), False, abs(end - begin), float(step), landing=False)
        way = self._follow(first.x, course, most)
        states = [first]
        for x, w, F, iterations in zip(way.X, way.P, way.F, way.iterations, strict=True):
            states.append(_State(x, float(w), amplitude, F, int(iterations)))
        failure = None
        if way.outcome != ENDED:
            last_Hz = states[-1].w / (2 * np.pi)
            reason = f"the branch has more than {most} points" if way.outcome == LONG else WORDS[way.outcome]
            failure = Failure(last_Hz, reason, np.nan, len(states))
        return SolutionBranch(tuple(self._told(states)), failure)

    def multipliers(self, solution: PeriodicSolution, *, rate_Hz: float = BENCH.internal_rate_Hz) -> Array:
        """Floquet multipliers of a steady state on the bench, largest first.

        Parameters
        ----------
        rate_Hz
            Steps a second of the integration, at least.
        """
        rows, H = slice(0, self._channels.start), self._H
        w = np.array([2 * np.pi * solution.frequency_Hz])
        outputs = np.einsum("koi,ik->ok", transfer(self._poles, rows, w, H)[0], solution.inputs)
        return floquet_multipliers(
            self._poles, self._elements, locals_=self._locals, frequency_Hz=solution.frequency_Hz, rate_Hz=rate_Hz,
            outputs=outputs, inputs=solution.inputs,
        )  # fmt: skip

    def stable(self, solution: PeriodicSolution) -> bool:
        """Whether the bench stays on a steady state: no multiplier exceeds one.

        A slider that never slips keeps its force for ever, which is a multiplier of one and no instability.
        """
        return bool(abs(self.multipliers(solution)[0]) < 1.0 + LIMITS.neutral_multiplier)

    def _linear(self, w: float, amplitude: float) -> Array:
        """Unknowns without local forces."""
        slope = np.empty(self._locals * self._n)
        drive_slope(self._system, w, slope)
        return -amplitude * slope

    def _newton(
        self, start: Array, w: float, amplitude: float, tolerance: float, contraction: float
    ) -> _State | Failure:
        """The steady state in reach of a start."""
        x, F = start.copy(), np.empty((self._locals, self._n))
        drive = SineDrive(w, amplitude)
        outcome, iterations, left = self._kernel.newton(
            self._system, x, drive, tolerance, MOST_ITERATIONS, contraction, F
        )
        if outcome == FOUND:
            return _State(x, w, amplitude, F, iterations)
        return Failure(w / (2 * np.pi), WORDS[outcome], left, iterations)

    def _from_rest(self, w: float, amplitude: float, tolerance: float) -> _State | Failure:
        """The steady state that rest leads to as the drive is raised, through folds if need be."""
        linear, part = self._linear(w, amplitude), 1.0
        found = self._newton(linear, w, amplitude, tolerance, LIMITS.from_rest)
        while isinstance(found, Failure) and part > LIMITS.least_drive:
            part /= 2.0
            found = self._newton(part * linear, w, part * amplitude, LIMITS.balance_tolerance, LIMITS.from_rest)
        return found if isinstance(found, Failure) or part == 1.0 else self._raised(found, amplitude, tolerance)

    def _raised(self, state: _State, amplitude: float, tolerance: float) -> _State | Failure:
        """The state on the same branch at another amplitude of the drive."""
        span = max(amplitude, state.amplitude)
        return self._along(
            state, Course(state.amplitude, amplitude, state.w, True, span, LIMITS.branch_step, True, tolerance)
        )

    def _onward(self, state: _State, w: float, amplitude: float, tolerance: float) -> _State | Failure:
        """The state at another frequency, and maybe another amplitude, on the branch of a neighbour."""
        found = self._newton(state.x, w, amplitude, tolerance, continuation.CONTRACTION)
        if not isinstance(found, Failure):
            return found
        if amplitude != state.amplitude:
            raised = self._raised(state, amplitude, LIMITS.balance_tolerance)
            if isinstance(raised, Failure):
                return raised
            state = raised
        if w == state.w:
            return state
        span = max(abs(w - state.w), LIMITS.balance_narrow * w)
        return self._along(state, Course(state.w, w, state.amplitude, False, span, LIMITS.branch_step, True, tolerance))

    def _stepped(self, before: _State, w: float) -> _State | Failure:
        """What a sweep comes to at its next frequency: on its branch, or where rest leads to if that never comes by."""
        reached = self._onward(before, w, before.amplitude, LIMITS.balance_tolerance)
        if not isinstance(reached, Failure):
            return reached
        landed = self._from_rest(w, before.amplitude, LIMITS.balance_tolerance)
        return reached if isinstance(landed, Failure) else landed._replace(jumped=True)

    def _along(self, state: _State, course: Course) -> _State | Failure:
        """Follow the branch until it first comes by the end; `jumped` if it turned back before."""
        way = self._follow(state.x, course, LIMITS.most_points)
        w, amplitude = (course.held, course.end) if course.by_drive else (course.end, course.held)
        if way.outcome != FOUND:
            return Failure(w / (2 * np.pi), f"on the way along the branch, {WORDS[way.outcome]}", np.nan, len(way.P))
        ways = np.sign(np.diff(np.append(course.begin, way.P)))
        turned = bool(np.any(ways * ways[0] < 0))
        return _State(way.X[-1], w, amplitude, way.F[-1], int(way.iterations.sum()), jumped=turned)

    def _follow(self, start: Array, course: Course, most: int) -> _Way:
        """Points along a branch after its first."""
        X, P, F = np.empty((most, len(start))), np.empty(most), np.empty((most, self._locals, self._n))
        iterations = np.empty(most, np.int64)
        outcome, count = self._kernel.follow(self._system, start, course, X, P, F, iterations)
        return _Way(outcome, X[:count], P[:count], F[:count], iterations[:count])

    @staticmethod
    def _state(solution: PeriodicSolution) -> _State:
        w = 2 * np.pi * solution.frequency_Hz
        return _State(solution.unknowns, w, solution.amplitude, np.empty(0), 0)

    def _told(self, states: Sequence[_State]) -> list[PeriodicSolution]:
        """All that goes with the unknowns."""
        if not states:
            return []
        F, W = np.array([state.F for state in states]), np.array([state.w for state in states])
        u = np.zeros((len(W), 1 + self._locals, self._H + 1), complex)
        u[:, 0, 1] = [-1j * state.amplitude for state in states]
        u[:, 1:, 0] = F[:, :, 0]
        u[:, 1:, 1:] = F[:, :, 1::2] - 1j * F[:, :, 2::2]
        G = transfer(self._poles, self._channels, W, self._H)
        channels = np.matmul(G, u.transpose(0, 2, 1)[..., None])[..., 0].transpose(0, 2, 1)
        return [
            PeriodicSolution(float(state.w) / (2 * np.pi), state.x, inputs, values, state.iterations, state.jumped)
            for state, inputs, values in zip(states, u, channels, strict=True)
        ]
