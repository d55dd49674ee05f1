"""What no cause file knows is hidden: the answer is ``unknown``, and the picture of the force points where it acts."""

from __future__ import annotations

import sys
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from recordings import read_run
from twin.bench import draw_case
from twin.campaign import record_hidden
from twin.demo import BROADBAND, HELD_OUT, SWEEPS
from twin.diagnose import diagnose
from twin.rigs import load_rig

sys.path.insert(0, str(Path(__file__).parents[2] / "bench"))
from unlisted import acting

RIG = load_rig("steel-lap-joint")
NEAR_m = 0.06
"""A seventh of the structure."""


def diagnose_unlisted(name: str, seed: int, folder: Path, strength: float = 1.0):
    """The diagnosis of a rig with `name` in it, whose base parameters are unknown as everywhere."""
    rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
    case = draw_case(rng, rig=RIG, causes=["none"])
    with acting(name, strength=strength) as effect:
        record_hidden(replace(case, effects=(effect,)), RIG, folder, rng=rng)
    runs = [read_run(folder / run) for run in (BROADBAND, SWEEPS)]
    return diagnose(runs, RIG, held_out=[read_run(folder / HELD_OUT)])


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(
    ("name", "term"),
    [
        ("quintic-spring", "quintic spring"),
        ("quadratic-spring", "one-sided spring"),
        ("fractional-damper", None),
    ],
)
def test_a_force_that_no_cause_knows_is_found_at_its_place(tmp_path, name, term, seed):
    found = diagnose_unlisted(name, seed, tmp_path)
    assert found.verdict == "unknown"
    assert not [cause for cause in found.causes if cause.in_model]
    force = found.missing_force
    assert force is not None
    assert force.position_m.value == pytest.approx(RIG.length, abs=NEAR_m)
    if term is not None:
        assert force.explains
        assert [fitted.term.name for fitted in force.terms] == [term]


@pytest.mark.nightly
def test_what_is_no_force_to_ground_is_not_passed_off_as_one(tmp_path):
    """A mass that rattles on a hanger of its own has a motion that no force of the beam's alone stands for."""
    found = diagnose_unlisted("backlash-pendulum", 1, tmp_path)
    assert found.verdict == "unknown"
    assert found.missing_force is None or not found.missing_force.explains
