"""What is missing is told with what to install, and what the environment brings is found without PATH."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from needed import missing_of, package, program


def test_a_program_of_the_environment_is_found_though_it_is_not_on_path(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    assert program("rerun") == str(Path(sys.executable).with_name("rerun"))


def test_what_is_missing_is_counted_and_told_with_its_package(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    reasons = ["Skipped: needs /dev/full"]
    for find, name in ((program, "socat"), (program, "socat"), (package, "no_such_package")):
        with pytest.raises(pytest.skip.Exception) as skipped:
            find(name)
        reasons.append(f"Skipped: {skipped.value}")
    assert missing_of(reasons) == [
        "no_such_package (pip install '.[test]'): 1 test(s) skipped",
        "socat (apt install socat): 2 test(s) skipped",
    ]
