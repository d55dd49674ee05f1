"""``--laws`` on the commands that read rigs."""

from __future__ import annotations

import json

import pytest

from twin.cli import main
from twin.joint.registry import loaded_files
from twin.rigs import load_rig, nominal_rig_file

LAW = """
from numba import njit
from twin.joint import NamedLaw, Parameter, law_of_functions

@njit
def force(p, memory, x):
    return p[0] * x, p[0]

HELD = NamedLaw(
    name="held", sentence="is held by {spring:g} N/m2", make=law_of_functions(force),
    parameters=(Parameter(name="spring", unit="N/m2", about="at rest"),),
)
"""


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.setattr("twin.joint.registry._loaded", {})
    rig, law = tmp_path / "rig.toml", tmp_path / "law.py"
    text = nominal_rig_file(load_rig("steel-lap-joint")).decode()
    own = '[joint.law.slip]\nname = "held"\nspring = 1e7\n'
    calibrated = '[joint.law]\nof = "steel-lap-joint"\n'
    assert calibrated in text
    rig.write_text(text.replace(calibrated, own))
    law.write_text(LAW)
    return rig, law


def run(*words):
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return ended.value.code


def test_a_law_is_known_where_it_is_named_and_told(files, capsys):
    rig, law = files
    assert run("rig", "show", rig) == 2
    assert "no law 'held'" in capsys.readouterr().err
    assert run("rig", "show", rig, "--laws", law, "--json") == 0
    assert json.loads(capsys.readouterr().out)["laws"] == {"joint": "over its slip it is held by 1e+07 N/m2"}
    assert loaded_files() == (law,)


@pytest.mark.parametrize("command", ["rehearse", "serve", "acquire", "identify", "predict", "diagnose", "campaign"])
def test_every_command_that_reads_a_rig_takes_it(command, files, capsys):
    _, law = files
    law.write_text("nothing")
    words = {"rehearse": ["p"], "acquire": ["p"], "identify": ["r"], "predict": ["m"], "diagnose": ["r"]}.get(
        command, []
    )
    assert run(command, *words, "--laws", law) == 2
    assert "law.py: line 1: NameError" in capsys.readouterr().err
