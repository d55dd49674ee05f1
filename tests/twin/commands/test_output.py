"""What commands print: names from a stranger's file are shown as they are, and neither style nor steer a terminal."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from twin.commands import output
from twin.commands.diagnose import _tell
from twin.commands.stages import Stages

NAME = "up[/x] [red]\x1b[2J"
SHOWN = "up[/x] [red]?[2J"


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    """What standard error shows of a wide terminal without colours."""
    file = io.StringIO()
    plain = Console(file=file, force_terminal=True, no_color=True, width=200, markup=False, highlight=False)
    for module in ("output", "diagnose"):
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
        "misfit": {"chi2_per_dof": 9.0, "after": 0.5, "threshold": 1.0},
        "causes": [
            {
                "cause": "channel-gain", "probability": 0.99, "in_model": True, "confused_with": [],
                "parameters": {"channel": NAME, "gain": {"value": 1.1, "std": 0.01}},
            }
        ],
        "gain": {"held_out": {"before": 0.1, "after": 0.01, "noise_floor": 0.01}, "sweeps": [NAME]},
        "notes": [f"{NAME} was left out"], "seconds": 3.0, "next_test": None,
    }  # fmt: skip
    _tell(data, tmp_path / "out[x]", ["result.json"])
    shown = screen.getvalue()
    assert shown.count(SHOWN) == 4
    assert "out[x]/result.json" in shown


def test_a_bar_shows_such_a_name(screen: io.StringIO) -> None:
    with Stages() as stages:
        stages.begin("one", NAME)
    with output.working(NAME) as begin:
        begin(NAME)
    assert "up[/x] [red]" in screen.getvalue()
