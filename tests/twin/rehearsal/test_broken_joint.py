"""A joint driven beyond what its law has an answer for: a rehearsal ends in a line that says so."""

import sys

import pytest

from recordings import InputError
from twin.procedures import load_procedure
from twin.rehearsal import NominalRig, open_twin, rehearse
from twin.rigs import load_rig


def test_a_joint_that_falls_apart_is_told(tmp_path, monkeypatch):
    def fails(*arguments, **options):
        raise ArithmeticError("no solution in 1 of 9 steps")

    rig, procedure = load_rig("steel-lap-joint"), load_procedure("steel-random")
    monkeypatch.setattr(sys.modules["twin.rehearsal.rehearse"], "run_procedure", fails)
    source = open_twin(rig, procedure, preload="120N", seed=1, source=rig.name)
    with pytest.raises(InputError, match="falls apart: no solution in 1 of 9 steps"):
        rehearse(procedure, source, tmp_path / "run.mcap", nominal=NominalRig.of(rig, preload="120N"))
