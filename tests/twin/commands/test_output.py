"""What commands print: names from a stranger's file are shown as they are, and neither style nor steer a terminal."""

from __future__ import annotations

import io
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console

from twin.commands.common import output
from twin.commands.common.stages import Stages
from twin.commands.diagnose import _tell
from twin.diagnose.answer.exclusion import Exclusion
from twin.diagnose.answer.result import Estimate, NamedCause

NAME = "up[/x] [red]\x1b[2J"
SHOWN = "up[/x] [red]?[2J"


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    """What standard error shows of a wide terminal without colours."""
    file = io.StringIO()
    plain = Console(file=file, force_terminal=True, no_color=True, width=200, markup=False, highlight=False)
    for module in ("common.output", "diagnose"):
        monkeypatch.setattr(f"twin.commands.{module}.console", plain)
    return file


def test_a_name_with_brackets_is_a_name(screen: io.StringIO) -> None:
    output.say(("done", "bold"), f": {NAME}")
    output.next_step(f"open {NAME}")
    assert f": {SHOWN}\n" in screen.getvalue()
    assert f"next: open {SHOWN}" in screen.getvalue()


def test_a_diagnosis_of_such_channels_and_sweeps_is_told(screen: io.StringIO, tmp_path: Path) -> None:
    data = {
        "answer": f"The data name channel-gain (channel {NAME}).",
        "verdict": "explained", "causes": ["channel-gain"],
        "misfit": {"chi2_per_dof": 9.0, "after": 0.5, "threshold": 1.0},
        "gain": {"held_out": {"before": 0.1, "after": 0.01, "noise_floor": 0.01}, "sweeps": [NAME]},
        "notes": [f"{NAME} was left out"], "seconds": 3.0, "next_test": None, "assumed": [],
    }  # fmt: skip
    cause = NamedCause(
        cause="channel-gain", summary="", probability=0.99, confused_with=(), in_model=True,
        parameters={"channel": NAME, "gain": Estimate(1.1, 0.01)},
    )  # fmt: skip
    diagnosis = SimpleNamespace(causes=(cause,), excluded=())
    _tell(SimpleNamespace(diagnosis=diagnosis), data, tmp_path / "out[x]", ["result.json"])
    shown = screen.getvalue()
    assert shown.count(SHOWN) == 4
    assert "out[x]/result.json" in shown


def test_an_answer_of_nothing_wrong_tells_the_tightest_limits(screen: io.StringIO, tmp_path: Path) -> None:
    limits = {"base-motion": None, "added-mass": 2.13e-5, "end-mass": 3e-5, "drive-mass": 4e-5, "hidden": 5e-5}
    data = {
        "verdict": "none", "answer": "Nothing needs to be named.", "causes": [], "gain": None, "notes": [],
        "misfit": {"chi2_per_dof": 0.9, "after": 0.9, "threshold": 2.0}, "seconds": 3.0, "next_test": None,
        "assumed": [],
    }  # fmt: skip
    excluded = [Exclusion(cause, "mass_kg", limit, {}) for cause, limit in limits.items()]
    _tell(SimpleNamespace(diagnosis=SimpleNamespace(causes=(), excluded=excluded)), data, tmp_path, [])
    told = "added-mass, mass 21 mg; end-mass, mass 30 mg; drive-mass, mass 40 mg\n"
    assert f"at most this could hide (95 %): {told}" in screen.getvalue()


def test_a_bar_shows_such_a_name(screen: io.StringIO) -> None:
    with Stages() as stages:
        stages.begin("one", NAME)
    with output.working(NAME) as begin:
        begin(NAME)
    assert "up[/x] [red]" in screen.getvalue()
