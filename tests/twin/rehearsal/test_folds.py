"""Jumps that the predicted branches know of, told though the grid steps over them, and mended economically."""

import itertools
from pathlib import Path

import pytest
from resonator import Resonator

from recordings.run import Channel
from twin.procedures import ProcedureResult, SteppedSine, StepResult
from twin.procedures.tables import Grid, Measure, Settle
from twin.rehearsal import NominalRig, Rehearsal, branch_tables, judge, open_twin, rehearse, rehearse_until_clear
from twin.rigs import load_rig

STEEL = load_rig("steel-lap-joint")
COARSE = SteppedSine(grid=Grid(start=148.0, stop=158.0, step=5.0), amplitudes=[4.0])


@pytest.mark.slow
def test_a_jump_between_coarse_steps_is_told_as_a_jump_and_then_resolved(tmp_path):
    branches = branch_tables(STEEL, preload="120N", procedure=COARSE)
    down_Hz, up_Hz = sorted(branches[0]["folds_Hz"])

    def bench():
        return open_twin(STEEL, COARSE, preload="120N", seed=0, source="steel")

    def rehearsed(nominal):
        return rehearse(COARSE, bench(), tmp_path / "run.mcap", nominal=nominal)

    blind = NominalRig.of(STEEL, preload="120N")
    assert [c.kind for c in rehearsed(blind).cautions] == ["grid-too-coarse"]
    nominal = NominalRig.of(STEEL, preload="120N", branches=branches)
    first = rehearsed(nominal)
    (caution,) = first.cautions
    assert (caution.kind, caution.severity) == ("jump-ahead", "warning")
    assert f"up at {up_Hz:.7g} Hz, down at {down_Hz:.7g} Hz" in caution.reason
    better = rehearse_until_clear(first, lambda _: bench(), tmp_path / "improved.mcap", rounds=1)
    assert better.remaining == ()
    assert len(better.rehearsal.result.steps) < 150
    for sweep, fold_Hz in (("4N-up", up_Hz), ("4N-down", down_Hz)):
        steps = better.rehearsal.sweeps()[sweep]
        sizes = [abs(step.phasors["acc2"]) for step in steps]
        jump = max(range(len(steps) - 1), key=lambda i: abs(sizes[i + 1] - sizes[i]))
        low, high = sorted((steps[jump].frequency_Hz, steps[jump + 1].frequency_Hz))
        assert high - low < 0.15
        assert low - 0.1 <= fold_Hz <= high + 0.1


def test_a_wide_band_is_refined_near_its_resonance_only(tmp_path):
    asked = SteppedSine(grid=Grid(start=5.0, stop=200.0, step=5.0), amplitudes=[0.5], measure=Measure(seconds=1.0))
    nominal = NominalRig(damping_ratio=0.0023)
    first = rehearse(asked, Resonator(), tmp_path / "run.mcap", nominal=nominal)
    assert [c.kind for c in first.cautions] == ["grid-too-coarse"]
    better = rehearse_until_clear(first, lambda _: Resonator(), tmp_path / "improved.mcap")
    assert better.clear
    frequencies = better.rehearsal.procedure.frequencies
    assert len(frequencies) < 40 + 100
    assert {5.0 * i for i in range(1, 41)} <= set(frequencies)
    assert sum(20 < f < 35 for f in frequencies) > len(frequencies) - 40
    summary = next(better.rehearsal.summaries())
    assert summary.peak_frequency_Hz == pytest.approx(26.5, abs=0.03)
    assert summary.peak_response == pytest.approx(0.5 / (2 * 0.0023 * 5.0), rel=0.04)


@pytest.mark.slow
def test_an_adaptive_grid_that_passes_over_the_peak_is_refined_round_by_round(tmp_path):
    grid = Grid(kind="adaptive", start=24.0, stop=30.0, step=3.0, smallest=0.5, change=2.0)
    asked = SteppedSine(grid=grid, amplitudes=[0.5], measure=Measure(seconds=1.0))
    nominal = NominalRig(damping_ratio=0.0023)
    first = rehearse(asked, Resonator(), tmp_path / "run.mcap", nominal=nominal)
    rounds = []
    better = rehearse_until_clear(
        first, lambda _: Resonator(), tmp_path / "improved.mcap", rounds=9, on_round=rounds.append
    )
    assert len(rounds) > 1
    assert all(b.grid.step < a.grid.step for a, b in itertools.pairwise([asked, *rounds]))
    assert better.clear


def test_what_is_left_after_the_last_round_is_said(tmp_path):
    grid = Grid(kind="adaptive", start=20.0, stop=40.0, step=10.0, smallest=2.0, change=2.0)
    asked = SteppedSine(grid=grid, amplitudes=[0.5], measure=Measure(seconds=1.0))
    nominal = NominalRig(damping_ratio=0.0023)
    first = rehearse(asked, Resonator(), tmp_path / "run.mcap", nominal=nominal)
    better = rehearse_until_clear(first, lambda _: Resonator(), tmp_path / "improved.mcap", rounds=1)
    assert not better.clear
    assert better.remaining == ("grid-too-coarse",)


def test_a_held_response_peaks_where_it_takes_the_least_force(tmp_path):
    grid = Grid(start=26.2, stop=26.8, step=0.05)
    asked = SteppedSine(
        grid=grid, amplitudes=[10.0], control="response", target_channel="acc", direction="both",
        measure=Measure(seconds=1.0),
    )  # fmt: skip
    first = rehearse(asked, Resonator(), tmp_path / "run.mcap", nominal=NominalRig(damping_ratio=0.0023))
    assert [one.peak_frequency_Hz for one in first.rehearsal.summaries()] == pytest.approx([26.5, 26.5])


def step(sweep, index, error):
    return StepResult(
        sweep=sweep, index=index, frequency_Hz=26.0 + 0.1 * index, target_channel="force", target_amplitude=1.0,
        voltage_V=0.1, amplitude=1.0 + error, settle_s=0.1, measure_s=0.2,
    )  # fmt: skip


def test_too_much_and_too_little_force_are_told_apart_and_each_once():
    errors = {"1N-up": [0.084, -0.02], "1N-down": [-0.05, 0.01]}
    steps = [step(sweep, i, error) for sweep, pair in errors.items() for i, error in enumerate(pair)]
    result = ProcedureResult(
        state="done", reason="", steps=tuple(steps), duration_s=1.0, sample_rate_Hz=2048.0, last_step=None
    )
    asked = SteppedSine(frequencies=[26.0, 26.1], amplitudes=[1.0], direction="both", settle=Settle(seconds=0.1))
    channels = {"force": Channel(name="force", quantity="force", unit="N", range=50.0, device="daq")}
    low, high = judge(Rehearsal(procedure=asked, result=result, channels=channels))
    assert (low.kind, high.kind) == ("force-drop-out", "force-too-high")
    assert "5 % too low" in low.reason
    assert "8.4 % too high" in high.reason
    assert "likewise 1N-up (step 1 at 26.1 Hz)" in low.reason
    assert [(case.sweep, case.index) for case in low.cases] == [("1N-up", 1), ("1N-down", 0)]
    assert low.steps == high.steps == 2


def test_causes_come_before_their_consequences(tmp_path: Path):
    hasty = SteppedSine(
        frequencies=[26.0, 26.2, 26.4, 26.6], amplitudes=[0.5, 1.0], direction="both",
        settle=Settle(seconds=0.1), measure=Measure(seconds=0.2),
    )  # fmt: skip
    source = Resonator(acc_noise=0.05)
    cautions = rehearse(hasty, source, tmp_path / "run.mcap", nominal=NominalRig(damping_ratio=0.0023)).cautions
    kinds = [caution.kind for caution in cautions]
    assert kinds[0] == "dwell-too-short"
    assert len(kinds) == len(set(kinds))
    assert {case.sweep for case in cautions[0].cases} == {"0.5N-up", "0.5N-down", "1N-up", "1N-down"}


@pytest.mark.slow
def test_a_branch_that_ends_early_is_noted_and_drawn_as_far_as_it_goes(tmp_path):
    """A gap in the knowledge of folds: the procedure is right as it is."""
    sweep = SteppedSine(grid=Grid(start=26.0, stop=27.0, step=0.02), amplitudes=[0.5], direction="up")
    (whole,) = branch_tables(STEEL, preload="120N", procedure=sweep)
    assert whole["ends_early"] == ""
    cut = {**whole, "ends_early": "26.30000 Hz: no step along the branch is small enough (7 steps)"}
    cautions = {}
    for branch in (whole, cut):
        nominal = NominalRig(damping_ratio=0.0023, branches=[branch])
        found = rehearse(sweep, Resonator(), tmp_path / "run.mcap", nominal=nominal)
        cautions[branch["ends_early"]] = {caution.kind: caution for caution in found.cautions}
    told, silent = cautions[cut["ends_early"]], cautions[""]
    assert set(told) - set(silent) == {"branch-ends-early"}
    assert told["branch-ends-early"].severity == "note"
    assert cut["ends_early"] in told["branch-ends-early"].reason
