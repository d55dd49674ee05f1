"""The same mistakes where something is hidden in the rig beside them, and in recordings of another program."""

from __future__ import annotations

from pathlib import Path

import pytest
from first_day import MISTAKES, NAMES, Runs
from short_campaign import record_campaign

from recordings import read_run
from tests.second_bench.campaign import BROADBAND, Case, record
from twin.checks import first_look
from twin.rigs import Effect, Rig, load_rig

pytestmark = pytest.mark.slow

BENEATH_A_MASS = {"another preload"}
"""What a hidden mass of 4 g hides: it moves the resonances by more than the two preloads are apart."""


Campaign = tuple[Runs, Rig]


@pytest.fixture(scope="module")
def hidden(tmp_path_factory: pytest.TempPathFactory, true_rig: Rig) -> Campaign:
    mass = Effect(cause="added-mass", parameters={"mass_kg": 0.004, "position_m": 0.35})
    folder = record_campaign(tmp_path_factory.mktemp("hidden"), true_rig, effects=[mass])
    return {name: read_run(folder / f"{name}.mcap") for name in NAMES}, load_rig("steel-lap-joint")


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    folder: Path = record(Case("none", 7), tmp_path_factory.mktemp("foreign"))
    runs = {name: read_run(folder / (BROADBAND if name == "random" else f"{name}.mcap")) for name in NAMES}
    return runs, load_rig(folder / "rig.toml")


@pytest.mark.parametrize("campaign", ["hidden", "foreign"])
def test_without_a_mistake_nothing_is_found(campaign: str, request: pytest.FixtureRequest) -> None:
    runs, rig = request.getfixturevalue(campaign)
    assert first_look([runs["random"], runs["sweeps"]], rig, held_out=[runs["heldout"]]).told == ()


@pytest.mark.parametrize("name", [name for name in MISTAKES if name not in BENEATH_A_MASS])
@pytest.mark.parametrize("campaign", ["hidden", "foreign"])
def test_a_mistake_is_named(campaign: str, name: str, request: pytest.FixtureRequest) -> None:
    sound, rig = request.getfixturevalue(campaign)
    runs = MISTAKES[name].put_into(sound)
    MISTAKES[name].assert_named(first_look([runs["random"], runs["sweeps"]], rig, held_out=[runs["heldout"]]))
