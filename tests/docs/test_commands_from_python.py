"""Every command's job is a call, and the page of commands says which."""

from __future__ import annotations

import re
from pathlib import Path
from pkgutil import resolve_name

import pytest

from twin.cli import SUMMARIES, group

PAGE = (Path(__file__).parents[2] / "docs" / "commands.md").read_text(encoding="utf-8")
CALLS = {
    command: re.findall(r"`([a-z][\w.]+)`", calls)
    for command, calls in re.findall(r"^\| `([a-z ]+)` \| (`.*) \|$", PAGE, re.MULTILINE)
}


def commands() -> set[str]:
    """All that can be typed behind ``twin``."""
    rig = group.get_command(group.make_context("twin", ["--help"], resilient_parsing=True), "rig")
    return (set(SUMMARIES) - {"rig"}) | {f"rig {name}" for name in rig.commands}


def test_every_command_has_its_call():
    assert set(CALLS) == commands()


@pytest.mark.parametrize("command", CALLS)
def test_the_calls_are_there(command):
    assert CALLS[command]
    for name in CALLS[command]:
        assert resolve_name(name) is not None
