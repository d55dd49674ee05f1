"""Predicted branches, and the stepped sine that must jump where they fold."""

from types import SimpleNamespace

import numpy as np
import pytest
from resonator import ListSink

from twin.bench import open_bench
from twin.procedures import DirectAcquisition, SteppedSine, run_procedure
from twin.procedures.tables import Measure
from twin.rehearsal import predicted_branches
from twin.rehearsal.folds import folds_within
from twin.response import Failure, HarmonicBalance, SolutionBranch
from twin.rigs import Effect, load_rig

STEEL = load_rig("steel-lap-joint")


def stable_sizes(branch, channel, frequency_Hz):
    """Amplitudes of the stable states at a frequency, between the points of the branch."""
    f, size, stable = np.array(branch.frequency_Hz), np.abs(branch.response[channel]), np.array(branch.stable)
    here = (f[:-1] - frequency_Hz) * (f[1:] - frequency_Hz) <= 0
    here &= stable[:-1] & stable[1:]
    share = (frequency_Hz - f[:-1][here]) / np.diff(f)[here]
    return size[:-1][here] + share * np.diff(size)[here]


def test_a_sweep_jumps_up_and_down_within_one_step_of_the_folds():
    hardening = Effect(cause="cubic-stiffness", parameters={"position_m": 0.42, "stiffness_N_per_m3": 3e7})
    rig = STEEL.model_copy(update={"effect": [hardening]})
    step_Hz = 0.025
    procedure = SteppedSine(
        grid={"start": 26.65, "stop": 26.85, "step": step_Hz}, amplitudes=[3.0], direction="both",
        measure=Measure(seconds=1.0),
    )  # fmt: skip
    wide = procedure.model_copy(update={"grid": procedure.grid.model_copy(update={"start": 26.0, "stop": 27.5})})
    (branch,) = predicted_branches(rig, preload=None, procedure=wide)
    down_from, up_from = branch.folds_Hz
    assert down_from > up_from + 2 * step_Hz  # the grid can tell them apart
    unstable = np.array(branch.frequency_Hz)[~np.array(branch.stable)]
    assert (unstable.min(), unstable.max()) == pytest.approx((up_from, down_from), abs=0.005)
    bench = open_bench(rig, seed=2, sample_rate_Hz=procedure.sample_rate)
    result = run_procedure(procedure, DirectAcquisition(bench), ListSink())
    for sweep, fold in (("3N-up", down_from), ("3N-down", up_from)):
        steps = [step for step in result.steps if step.sweep == sweep]
        sizes = np.array([abs(step.phasors["acc2"]) for step in steps])
        at = int(np.argmax(abs(np.diff(sizes))))
        low, high = sorted((steps[at].frequency_Hz, steps[at + 1].frequency_Hz))
        assert low - step_Hz <= fold <= high + step_Hz
        for step, size in zip(steps, sizes, strict=True):
            if abs(step.frequency_Hz - fold) > step_Hz:  # at the fold itself the curve is too steep to compare
                near = stable_sizes(branch, "acc2", step.frequency_Hz)
                assert min(abs(near - size)) < 0.02 * size


def test_a_rig_without_folds_has_one_response_a_frequency():
    procedure = SteppedSine(grid={"start": 26.0, "stop": 27.0, "step": 0.05}, amplitudes=[0.5, 1.5])
    branches = predicted_branches(STEEL, preload="120N", procedure=procedure)
    assert [branch.force_N for branch in branches] == [0.5, 1.5]
    for branch in branches:
        assert branch.folds_Hz == []
        assert all(branch.stable)
        assert np.all(np.diff(branch.frequency_Hz) > 0)
        assert np.abs(branch.response["force"]) == pytest.approx(branch.force_N, rel=1e-3)


@pytest.mark.slow
def test_about_two_resonances_each_force_has_a_branch_of_its_own_about_each():
    """Nothing is followed from one to the other; a sweep's folds are those of both."""
    procedure = SteppedSine(
        frequencies=[26.1, 26.3, 26.5, 152.0, 154.0, 156.0], amplitudes=[1.0, 2.0], measure=Measure(seconds=1.0)
    )
    found = predicted_branches(STEEL, preload=None, procedure=procedure)
    assert [branch.force_N for branch in found] == [1.0, 2.0, 1.0, 2.0]
    ends = [(branch.frequency_Hz[0], branch.frequency_Hz[-1]) for branch in found]
    assert ends[0][0] == ends[1][0] == 26.1
    assert ends[2][0] == ends[3][0] == 152.0
    assert all(26.4 < last <= 26.5 for _, last in ends[:2])
    assert all(155.0 < last <= 156.0 for _, last in ends[2:])
    tables = [{"force_N": branch.force_N, "frequency_Hz": branch.frequency_Hz} for branch in found]
    steps = [SimpleNamespace(frequency_Hz=f, target_amplitude=2.0) for f in procedure.frequencies]
    folds = folds_within(SimpleNamespace(branches=tables), steps)
    assert sorted(folds.up_Hz + folds.down_Hz) == sorted(
        f for branch in found if branch.force_N == 2.0 for f in branch.folds_Hz if 26.1 <= f <= 156.0
    )
    assert any(f > 150 for f in folds.up_Hz)


def test_open_loop_sweeps_have_no_branches_at_a_force():
    procedure = SteppedSine(frequencies=[26.0, 27.0], amplitudes=[1.0], control="voltage")
    assert predicted_branches(STEEL, preload=None, procedure=procedure) == []


def test_a_branch_without_a_first_point_says_why_and_has_no_curve(monkeypatch):
    failure = Failure(26.0, "the equations are singular or not finite", np.nan, 1)
    monkeypatch.setattr(HarmonicBalance, "branch", lambda *_: SolutionBranch((), failure))
    (branch,) = predicted_branches(
        STEEL, preload=None, procedure=SteppedSine(frequencies=[26.0, 27.0], amplitudes=[1.0])
    )
    assert branch.ends_early == "26.00000 Hz: the equations are singular or not finite (1 steps)"
    assert branch.frequency_Hz == branch.folds_Hz == branch.stable == []
    assert branch.response == {}
