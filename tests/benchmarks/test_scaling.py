"""``twin speed --scaling``: both sides answer the same problem, whatever time they take, and the page says what was."""

from __future__ import annotations

import json
from functools import partial

import numpy as np
import pytest
from click.testing import CliRunner

from benchmarks import scaled_works
from benchmarks.balance_by_hand import BalanceByHand
from benchmarks.equivalent_linear import banded_model, softening_sweep, woodbury
from benchmarks.march_by_hand import march_jenkins, march_saturating
from benchmarks.measured import timed_in_turns
from benchmarks.memory import Memory, peaks_MB
from benchmarks.rig_of_places import RigOfPlaces, rig_of_sliders
from benchmarks.scaled_works import RATE_Hz, march
from benchmarks.scaling import Cost, Scaling, exponent
from benchmarks.scaling_page import write_page
from benchmarks.sparse_structure import long_rig, ready, structure_by_hand
from twin.bench.marching import coefficients
from twin.commands.speed import command
from twin.joint import Saturating

DRIVE = 3.0 * np.sin(2 * np.pi * 28.0 * np.arange(2000) / RATE_Hz)


def differ(ours, other):
    return np.max(np.abs(ours - other)) / np.max(np.abs(other))


def test_the_march_by_hand_is_the_same_scheme():
    one = RigOfPlaces(1, 11, Saturating(1e4, 2e-5))
    c = coefficients(one.poles(0.0, 0.0), 1.0 / RATE_Hz)
    assert differ(march(one, DRIVE)(), march_saturating(c, 1e4, 2e-5, DRIVE)) < 1e-10
    many = rig_of_sliders(12)
    c, (k, slip) = coefficients(many.poles(0.0, 0.0), 1.0 / RATE_Hz), many.law.parameters[1:3]
    assert differ(march(many, DRIVE)(), march_jenkins(c, k, slip, DRIVE)) < 1e-8


def test_woodbury_by_hand_is_the_full_model():
    """But for its mesh's modes above those that are kept."""
    sweep = softening_sweep(20)
    E = sweep.base.complex_E[0] + sweep.dE
    full = banded_model(sweep.model)(sweep.omega, E, np.full(20, sweep.base.complex_G[0]))
    assert differ(woodbury(sweep), full) < 1e-4
    assert differ(sweep.receptance(), woodbury(sweep)) < 1e-10


def test_the_sparse_structure_by_hand_is_that_of_the_rig():
    rig, layout = long_rig(240)
    np.testing.assert_allclose(ready(rig, layout), structure_by_hand(rig, layout), rtol=1e-6)


def test_a_steady_state_by_hand_is_what_the_march_settles_to():
    rig = rig_of_sliders(3)
    seconds, frequency_Hz = 12.0, 31.0
    count = round(seconds * RATE_Hz)
    phase = 2 * np.pi * frequency_Hz * np.arange(count) / RATE_Hz
    settled = march(rig, 3.0 * np.sin(phase))()[-round(RATE_Hz / frequency_Hz * 31) :]
    found = BalanceByHand(rig, 7, 256).sweep(np.array([frequency_Hz]), 3.0)[0]
    amplitude = 2 * np.mean(settled * np.exp(-1j * phase[-len(settled) :]))
    assert abs(found) == pytest.approx(abs(amplitude), rel=2e-3)


def test_the_exponent_is_that_of_the_power():
    costs = [Cost(n, 3e-6 * n**1.5, 1e-6 * n**2, 0.0) for n in (3, 10, 100)]
    assert exponent(costs, lambda cost: cost.ours_s) == pytest.approx(1.5)
    assert exponent(costs, lambda cost: cost.other_s) == pytest.approx(2.0)


def test_every_work_is_tried_as_often():
    counts = [0, 0]

    def count(which):
        counts[which] += 1

    timed_in_turns(partial(count, 0), partial(count, 0), tries=2, least_s=0.0)
    both = counts[0]
    timed_in_turns(partial(count, 1), tries=2, least_s=0.0)
    assert both == 2 * counts[1] == 2 * (2 + 2)


def test_an_hour_lies_on_the_line_through_both_lengths():
    assert Memory("x", 100.0, 100.0).hour_MB == 100.0
    assert Memory("x", 100.0, 101.0).table()["hour_MB"] == pytest.approx(100.0 + 3540 / 540)


@pytest.fixture
def quick(monkeypatch):
    """One small work in place of all."""
    costs = [Cost(10, 2e-6, 4e-6, 1e-9), Cost(100, 2e-5, 8e-5, 1e-9)]
    work = Scaling(
        sized="places", per="step", against="a peer", limit="twice", costs=costs,
        held=lambda costs: all(cost.other_s >= 2 * cost.ours_s for cost in costs),
    )  # fmt: skip
    monkeypatch.setattr(scaled_works, "WORKS", {"quick": lambda: work})
    return work


def test_the_command_gives_costs_ratios_and_exponents(quick):
    result = CliRunner().invoke(command, ["--scaling", "--only", "quick", "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)["works"]["quick"]
    assert found["held"] is True
    assert found["exponent"] == pytest.approx(1.0)
    assert [cost["ratio"] for cost in found["costs"]] == pytest.approx([2.0, 4.0])


def test_the_page_has_every_work_and_a_picture(quick, tmp_path):
    memory = [Memory("checked", 80.0, 150.0).table()]
    write_page(tmp_path / "speed.md", {"quick": quick.table()}, memory)
    page = (tmp_path / "speed.md").read_text(encoding="utf-8")
    assert "| 100 | 20 | 80 | 4 | 1e-09 |" in page
    assert "not held" in page
    assert (tmp_path / "pictures" / "scaling.png").stat().st_size > 1000


@pytest.mark.parametrize("arguments", [["--page", "x.md"], ["--scaling", "--only", "nothing"]])
def test_what_makes_no_sense_is_bad_usage(arguments):
    assert CliRunner().invoke(command, arguments).exit_code == 2


@pytest.mark.slow
def test_every_stage_whose_memory_is_told_runs(tmp_path):
    assert min(peaks_MB(tmp_path / "short", 10).values()) > 20
