"""What a diagnosis keeps back for the gain where no run is held out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.set_aside import set_aside
from twin.identify import gather_data
from twin.identify.measured_data import MeasuredData
from twin.rigs import load_rig


@pytest.fixture(scope="module")
def swept(campaign: Path) -> MeasuredData:
    """Sweeps at 1.5, 3 and 6 N."""
    return gather_data([read_run(campaign / "sweeps.mcap")], load_rig("steel-lap-joint"))


def only(evidence: MeasuredData, *, most_N: float) -> MeasuredData:
    """Sweeps up to a force."""
    keep = np.array([state.target_amplitude <= most_N for state in evidence.steps.states])
    return replace(evidence, steps=evidence.steps.select(keep))


def test_of_three_sweeps_the_middle_one_is_kept_back(swept: MeasuredData) -> None:
    kept, unseen, told = set_aside(swept)
    assert unseen is not None
    assert {state.target_amplitude for state in unseen.steps.states} == {3.0}
    assert {state.target_amplitude for state in kept.steps.states} == {1.5, 6.0}
    assert told == (unseen.steps.states[0].sweep,)


def test_of_two_every_fourth_step_is(swept: MeasuredData) -> None:
    whole = only(swept, most_N=3.0)
    kept, unseen, told = set_aside(whole)
    assert unseen is not None
    both = {(s.sweep, s.index) for s in kept.steps.states}, {(s.sweep, s.index) for s in unseen.steps.states}
    assert not both[0] & both[1]
    assert both[0] | both[1] == {(s.sweep, s.index) for s in whole.steps.states}
    assert len(unseen.steps) == pytest.approx(len(whole.steps) / 4, abs=1)
    names = dict.fromkeys(state.sweep for state in whole.steps.states)
    assert told == tuple(f"every fourth step of {name}" for name in names)


def test_of_a_handful_of_steps_none_is(swept: MeasuredData) -> None:
    few = only(swept, most_N=1.5)
    kept, unseen, told = set_aside(few)
    assert kept is few
    assert (unseen, told) == (None, ())
