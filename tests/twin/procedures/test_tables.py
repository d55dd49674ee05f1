"""Procedure files: the forms in use are read, mistakes are named by file and field."""

import pytest

from recordings.errors import InputError
from twin.procedures import (
    PROCEDURE_FILES,
    Random,
    SteppedSine,
    dump_procedure,
    load_procedure,
    parse_procedure,
)
from twin.procedures.grid import fixed_frequencies

FOREIGN_SWEEPS = b"""
procedure = "stepped-sine"
target_channel = "force"
frequencies = [25.3, 25.35, 25.4]
amplitudes = [1.5, 3.0, 6.0]
"""
FOREIGN_RANDOM = b"""
procedure = "random"
band = [5.0, 1000.0]
rms = 0.5
duration = 60.0
"""


def test_forms_written_by_other_programs_are_read():
    sweeps = parse_procedure(FOREIGN_SWEEPS, source="foreign.toml")
    assert isinstance(sweeps, SteppedSine)
    assert sweeps.amplitudes == [1.5, 3.0, 6.0]
    random = parse_procedure(FOREIGN_RANDOM, source="foreign.toml")
    assert isinstance(random, Random)
    assert random.band == (5.0, 1000.0)


@pytest.mark.parametrize("name", PROCEDURE_FILES)
def test_shipped_procedures_survive_writing_and_reading(name):
    procedure = load_procedure(name)
    assert parse_procedure(dump_procedure(procedure), source="again") == procedure


def test_shipped_sweeps_are_the_papers():
    sweeps = load_procedure("steel-sweeps")
    frequencies = fixed_frequencies(sweeps)
    assert (frequencies[0], frequencies[1], frequencies[-1], len(frequencies)) == (25.3, 25.35, 27.3, 41)
    assert sweeps.amplitudes == [1.5, 3.0, 6.0]


@pytest.mark.parametrize(
    ("text", "place", "reason"),
    [
        ("", "procedure", "required"),
        ('procedure = "waltz"', "procedure", "no procedure 'waltz'"),
        ('procedure = "stepped-sine"\namplitudes = [1]', "", "either 'frequencies' or a 'grid'"),
        ('procedure = "stepped-sine"\nfrequencies = [20, 10]\namplitudes = [1]', "", "must increase"),
        ('procedure = "stepped-sine"\nfrequencies = [20]\namplitudes = [-1]', "amplitudes.0", "greater than"),
        ('procedure = "stepped-sine"\nfrequencies = [20]\namplitudes = [1]\ndwell = 3', "dwell", "no such field"),
        ('procedure = "stepped-sine"\nfrequencies = [900]\namplitudes = [1]', "", "sample_rate 2048 Hz is too low"),
        (
            'procedure = "stepped-sine"\namplitudes = [1]\ngrid = { start = 1, stop = 2 }',
            "grid",
            "a linear grid needs 'step'",
        ),
        (
            'procedure = "stepped-sine"\namplitudes = [1]\ngrid = { start = 1, stop = 2, step = 1e-9 }',
            "grid",
            "more than 20000 steps",
        ),
        (
            'procedure = "stepped-sine"\nfrequencies = [20]\namplitudes = [1]\nsettle = { seconds = 1, maximum = 2 }',
            "settle",
            "excludes maximum",
        ),
        (
            'procedure = "stepped-sine"\nfrequencies = [20]\namplitudes = [1]\ncontrol = "phase-resonance"',
            "",
            "'phase' belongs to control",
        ),
        ('procedure = "random"\nband = [10, 5]\nrms = 1\nduration = 1', "", "band must increase"),
        ('procedure = "random"\nband = [1, nan]\nrms = 1\nduration = 1', "band.1", ""),
    ],
)
def test_mistakes_are_named_by_file_and_field(text, place, reason):
    with pytest.raises(InputError) as caught:
        parse_procedure(text.encode(), source="mine.toml")
    assert caught.value.source == "mine.toml"
    assert caught.value.place == place
    assert reason in caught.value.reason
    assert "\n" not in str(caught.value)


def test_an_unknown_name_lists_the_shipped_ones():
    with pytest.raises(InputError, match="steel-sweeps"):
        load_procedure("steel-swepes")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_procedure(tmp_path / "gone.toml")
