"""Valid recordings whose meaning was changed by chance end in time, in an answer or in one line."""

from __future__ import annotations

import time
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from changed_meaning import mutated

import twin
from recordings import InputError, Run, read_run
from twin.lab.rig import LabRig

NAMES = ("random", "sweeps", "heldout")
LIMIT_s = 3.0
SLACK_s = 12.0
"""On an idle core: a stage that has begun is ended, and what is held out is still judged."""
LOOK_s = 10.0


@pytest.fixture(scope="module")
def clean(campaign: Path) -> dict[str, Run]:
    return {name: read_run(campaign / f"{name}.mcap") for name in NAMES}


@pytest.fixture(scope="module")
def rig() -> LabRig:
    return twin.load_rig("steel-lap-joint")


@pytest.fixture(scope="module")
def compiled(clean: dict[str, Run], rig: LabRig) -> None:
    """Have what a diagnosis compiles once in the cache: that is not its own time."""
    rig.diagnose(
        [clean["random"], clean["sweeps"]],
        held_out=[clean["heldout"]],
        options=twin.DiagnosisOptions(time_limit_s=LIMIT_s),
    )


def looked(clean: dict[str, Run], rig: LabRig, seed: int) -> tuple[dict[str, Run], list[str], bool]:
    """The runs of a seed, what was changed, and whether a first look lets them pass."""
    runs, told = mutated(clean, np.random.default_rng(seed))
    started = time.process_time()
    try:
        found = rig.check([runs["random"], runs["sweeps"]], held_out=[runs["heldout"]])
    except InputError as error:
        one_line(error, seed, told)
        return runs, told, False
    except Exception as error:
        raise AssertionError(f"seed {seed}: {told}") from error
    assert time.process_time() - started < LOOK_s, f"seed {seed}: {told}"
    assert all("\n" not in line for line in found.told)
    return runs, told, not found.stopped


def one_line(error: InputError, seed: int, told: list[str]) -> None:
    """A refusal names the run; what only a numerical library refused is a fault of the checks."""
    assert "\n" not in str(error), f"seed {seed}: {told}"
    assert "no answer" not in str(error), f"seed {seed}: {told}: {error}"


def fitted(clean: dict[str, Run], rig: LabRig, seed: int) -> bool:
    """Whether runs of a seed passed a first look and were then identified and diagnosed, or refused in one line."""
    runs, told, passed = looked(clean, rig, seed)
    if not passed:
        return False
    learnt = [runs["random"], runs["sweeps"]]
    started = time.process_time()
    try:
        found = rig.diagnose(learnt, held_out=[runs["heldout"]], options=twin.DiagnosisOptions(time_limit_s=LIMIT_s))
        assert found.sentence
        assert found.verdict in ("none", "explained", "ambiguous", "unknown")
    except InputError as error:
        one_line(error, seed, told)
    assert time.process_time() - started < LIMIT_s + SLACK_s, f"seed {seed}"
    return True


@pytest.mark.parametrize("seed", range(40))
def test_changed_runs_are_looked_at(clean: dict[str, Run], rig: LabRig, seed: int) -> None:
    looked(clean, rig, seed)


@pytest.mark.slow
@pytest.mark.usefixtures("compiled")
def test_changed_runs_that_pass_are_diagnosed_within_their_time(clean: dict[str, Run], rig: LabRig) -> None:
    """The first three of them; most are stopped at the first look."""
    passed = (fitted(clean, rig, seed) for seed in range(1000, 1100))
    assert sum(islice(filter(None, passed), 3)) == 3


@pytest.mark.nightly
@pytest.mark.usefixtures("compiled")
def test_thousands_of_changed_runs(clean: dict[str, Run], rig: LabRig, pytestconfig: pytest.Config) -> None:
    """As many as ``--mutations`` says."""
    for seed in range(10_000, 10_000 + pytestconfig.getoption("mutations")):
        fitted(clean, rig, seed)
