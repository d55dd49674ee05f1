"""What a numerical library raises becomes one line with run, channel and stage; what is told already stays as it is."""

import numpy as np
import pytest

from recordings import InputError
from recordings.whereabouts import Stages, told_in_one_line, working_on


def test_an_error_names_run_channel_and_stage():
    said = []
    stages = Stages(said.append)
    stages("fitting")
    with pytest.raises(InputError) as told, told_in_one_line("rig.toml", stages), working_on("run.mcap", "acc1"):
        np.linalg.solve(np.zeros((2, 2)), np.ones(2))
    line = str(told.value)
    assert line.startswith("run.mcap: channel acc1: no answer while fitting (LinAlgError: Singular matrix); ")
    assert isinstance(told.value.__cause__, np.linalg.LinAlgError)
    assert said == ["fitting"]


def test_the_innermost_place_counts_and_the_source_where_there_is_none():
    with (
        pytest.raises(InputError, match=r"^inner.mcap: no answer \(ValueError\)"),
        told_in_one_line("rig.toml", Stages(print)),
        working_on("outer.mcap"),
        working_on("inner.mcap"),
    ):
        raise ValueError
    with (
        pytest.raises(InputError, match=r"^rig.toml: no answer \(KeyError: 'x'\)"),
        told_in_one_line("rig.toml", Stages(print)),
    ):
        raise KeyError("x")


@pytest.mark.parametrize("error", [InputError("a", "b", "c"), OSError("full"), MemoryError(), KeyboardInterrupt()])
def test_what_is_told_elsewhere_passes(error):
    with pytest.raises(type(error)) as passed, told_in_one_line("rig.toml", Stages(print)), working_on("run.mcap"):
        raise error
    assert passed.value is error
