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

sys.path.insert(0, str(Path(__file__).parents[1] / "bench"))
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


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(
    ("name", "term", "position_m"),
    [
        ("quintic-spring", "quintic spring", RIG.length),
        ("quadratic-spring", "one-sided spring", RIG.length),
        ("backlash-pendulum", None, 0.35),
        ("fractional-damper", None, RIG.length),
    ],
)
def test_unlisted_physics_is_unknown_and_its_place_is_found(tmp_path, name, term, position_m, seed):
    found = diagnose_unlisted(name, seed, tmp_path)
    assert found.verdict == "unknown"
    assert not [cause for cause in found.causes if cause.in_model]
    force = found.missing_force
    assert force is not None
    assert force.after < force.before
    assert force.position_m.value == pytest.approx(position_m, abs=NEAR_m)
    if term is not None:
        assert [fitted.term.name for fitted in force.terms] == [term]
