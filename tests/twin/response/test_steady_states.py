"""Which steady state is found where there are several or none: the start's own branch, a jump told, a reason."""

from __future__ import annotations

import numpy as np
import pytest
from harmonic_balance_numpy import BALANCES

from twin.bench import BenchSetup, no_law, open_bench
from twin.bench.linear import LinearRig, to_poles
from twin.bench.marching import Elements
from twin.joint import Cubic
from twin.response import Failure, HarmonicBalance
from twin.response.outcome import FAR, WORDS
from twin.response.system import SineDrive
from twin.rigs import Effect, load_rig

RIG = load_rig("steel-lap-joint")
UPWARDS = np.linspace(26.2, 29.0, 29)
FORCE_N, TIP = 3.0, 2


class Oscillator:
    """x'' + d x' + x + c x^3 = F sin(w t), as harmonic balance asks of a rig."""

    locals, auxiliaries = 1, 0

    def __init__(self, damping, cubic):
        self.damping, self.law = damping, Cubic(cubic)

    def poles(self, time_s, internal_rate_Hz):
        A = np.array([[0.0, 1.0], [-1.0, -self.damping]])
        C = np.array([[1.0, 0.0], [1.0, 0.0]])
        return to_poles(LinearRig(A, np.array([[0.0, 0.0], [1.0, -1.0]]), C, np.zeros((2, 2))))

    def elements(self):
        first, none = np.array([0]), np.array([-1])
        return Elements(np.array([self.law.kind]), first, none, np.ones(1), self.law.parameters[None], np.zeros((1, 1)))


@pytest.fixture(scope="module", params=BALANCES)
def hard(request):
    """The steel rig with a hardening spring, three steady states between its folds."""
    effect = Effect(cause="cubic-stiffness", parameters={"position_m": 0.42, "stiffness_N_per_m3": 2e7})
    built = open_bench(RIG, joint_law=no_law(), effects=[effect], setup=BenchSetup(drive="force")).built
    return BALANCES[request.param](built, harmonics=3, samples=64)


@pytest.fixture(scope="module")
def branch(hard):
    return hard.branch(UPWARDS[0], UPWARDS[-1], FORCE_N)


@pytest.fixture(scope="module")
def folds_Hz(branch):
    """Where the branch from below turns back, and where it turns forwards again."""
    frequency = np.array([point.frequency_Hz for point in branch])
    turns = 1 + np.flatnonzero(np.diff(np.sign(np.diff(frequency))))
    return frequency[turns]


def tip(solutions):
    return np.array([abs(solution.channels[TIP, 1]) for solution in solutions])


def states_at(branch, frequency_Hz):
    """Amplitudes of all states at a frequency, between the points of the branch."""
    f, size = np.array([point.frequency_Hz for point in branch]), tip(branch)
    rows = np.flatnonzero(np.diff(np.sign(f - frequency_Hz)))
    share = (frequency_Hz - f[rows]) / (f[rows + 1] - f[rows])
    return list(size[rows] + share * (size[rows + 1] - size[rows]))


@pytest.mark.parametrize("way", [1, -1], ids=["up", "down"])
def test_a_sweep_jumps_at_the_fold_onto_the_only_state_there_and_says_so(hard, branch, folds_Hz, way):
    sweep = hard.sweep(UPWARDS[::way], FORCE_N)
    assert sweep.failures == ()
    assert [solution.frequency_Hz for solution in sweep] == pytest.approx(list(UPWARDS[::way]), rel=1e-12)
    (landed,) = [i for i, solution in enumerate(sweep) if solution.jumped]
    fold_Hz = folds_Hz[0] if way > 0 else folds_Hz[1]
    before_Hz, after_Hz = sweep[landed - 1].frequency_Hz, sweep[landed].frequency_Hz
    assert way * before_Hz < way * fold_Hz < way * after_Hz
    (only,) = states_at(branch, after_Hz)
    assert tip(sweep[landed : landed + 1])[0] == pytest.approx(only, rel=0.01)
    # Up to there the sweep has been on the branch that it came along, upper or lower.
    both = states_at(branch, before_Hz)
    assert tip(sweep[landed - 1 : landed])[0] == pytest.approx(max(both) if way > 0 else min(both), rel=0.02)


def test_a_neighbour_keeps_its_branch_and_rest_leads_to_the_lower_one(hard, branch, folds_Hz):
    between = 0.5 * (folds_Hz[0] + folds_Hz[1])
    high = max(states_at(branch, between))
    up = hard.sweep(np.linspace(26.2, between - 0.01, 9), FORCE_N)
    assert tip([hard.solve(between, FORCE_N, start=up[-1])])[0] == pytest.approx(high, rel=0.02)
    low = hard.solve(between, FORCE_N)
    assert tip([low])[0] == pytest.approx(min(states_at(branch, between)), rel=0.02)
    assert not low.jumped
    # A neighbour at another amplitude, too.
    weaker = hard.solve(between, 0.97 * FORCE_N, start=up[-1])
    assert weaker.amplitude == pytest.approx(0.97 * FORCE_N, rel=1e-12)
    assert tip([weaker])[0] > 0.9 * high


def test_newton_alone_does_not_leave_for_another_branch(hard, folds_Hz):
    """Beyond the fold there is nothing in reach: it says so, and does not wander until something turns up."""
    last = hard.sweep(np.linspace(26.2, folds_Hz[0] - 0.01, 9), FORCE_N)[-1]
    beyond = 2 * np.pi * (folds_Hz[0] + 0.05)
    x, F = last.unknowns.copy(), np.empty((hard._locals, hard._n))
    outcome, iterations, left = hard._kernel.newton(hard._system, x, SineDrive(beyond, FORCE_N), 1e-9, 30, 0.5, F)
    assert outcome == FAR
    assert iterations < 10
    assert left > 1e-6


def test_raising_the_drive_reaches_what_newton_does_not_from_the_linear_response(hard, branch):
    """Along the curve of the response over the force, which turns twice on the way."""
    at_Hz = 26.6
    w = 2 * np.pi * at_Hz
    assert isinstance(hard._newton(hard._linear(w, FORCE_N), w, FORCE_N, 1e-9, 0.5), Failure)
    found = hard.solve(at_Hz, FORCE_N)
    assert found.jumped
    (only,) = states_at(branch, at_Hz)
    assert tip([found])[0] == pytest.approx(only, rel=0.01)
    raised = [hard.solve(at_Hz, part * FORCE_N) for part in np.linspace(0.05, 1.0, 20)]
    size, jumped = tip(raised), [solution.jumped for solution in raised]
    assert np.all(np.diff(size) > 0)
    (first,) = np.flatnonzero(np.diff(jumped))
    assert np.argmax(np.diff(size)) == first


def test_friction_that_lets_go_on_the_way_from_rest_is_passed():
    """Stuck, it is sixty times as stiff as the tip: no step of Newton's contracts over the kink where it lets go."""
    rubbing = Effect(cause="ground-friction", parameters={"position_m": 0.4, "force_N": 0.01})
    plain = open_bench(RIG, setup=BenchSetup(drive="force", noise=False, converter=False)).built
    built = open_bench(RIG, effects=[rubbing], setup=BenchSetup(drive="force", noise=False, converter=False)).built
    one, without = (HarmonicBalance(each, harmonics=7) for each in (built, plain))
    levels = np.array([0.05, 0.2, 0.75, 3.0, 12.0])
    size, free = (tip([each.solve(28.0, level) for level in levels]) / levels for each in (one, without))
    assert np.all(np.diff(np.abs(size / free - 1)) < 0)
    assert size[0] < 0.3 * free[0]
    assert size[-1] == pytest.approx(free[-1], rel=0.01)


def test_what_rounding_leaves_counts_as_nothing(hard):
    exact, asked = hard.solve(27.5, FORCE_N), hard.solve(27.5, FORCE_N, tolerance=1e-30)
    np.testing.assert_allclose(asked.channels, exact.channels, atol=1e-9 * np.abs(exact.channels).max())


def test_an_undamped_resonance_has_no_steady_state_and_the_sweep_goes_on():
    free = HarmonicBalance(Oscillator(0.0, 0.0), harmonics=3, samples=64)
    omega = np.array([0.8, 0.9, 1.0, 1.1, 1.2])
    sweep = free.sweep(omega / (2 * np.pi), 1.0)
    (failure,) = sweep.failures
    assert failure.frequency_Hz == pytest.approx(1 / (2 * np.pi))
    assert any(words in failure.reason for words in WORDS.values())
    assert tip_of_oscillator(sweep) == pytest.approx(1 / np.abs(1 - np.delete(omega, 2) ** 2), rel=1e-9)
    with pytest.raises(ArithmeticError, match=r"no steady state at 0\.15915 Hz: the equations are singular"):
        free.solve(1 / (2 * np.pi), 1.0)
    assert free.branch(1 / (2 * np.pi), 0.2, 1.0).failure is not None


def tip_of_oscillator(solutions):
    return np.array([abs(solution.channels[0, 1]) for solution in solutions])


def test_a_wide_hysteresis_is_swept_both_ways():
    """A light oscillator that bends by more than its own frequency."""
    hard = HarmonicBalance(Oscillator(0.05, 1.0), harmonics=5, samples=128)
    omega = np.linspace(0.5, 3.0, 51)
    up, down = (hard.sweep(way / (2 * np.pi), 0.3) for way in (omega, omega[::-1]))
    for sweep in (up, down):
        assert sweep.failures == ()
        assert len([one for one in sweep if one.jumped]) >= 1
    upper, lower = tip_of_oscillator(up), tip_of_oscillator(down)[::-1]
    apart = upper > 1.5 * lower
    assert apart.sum() > 10
    np.testing.assert_allclose(upper[~apart], lower[~apart], rtol=1e-7)
