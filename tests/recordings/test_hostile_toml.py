"""TOML from strangers: whatever it is, one line within two seconds and 300 MB, and nothing beyond a bound."""

from __future__ import annotations

import resource
import time
from pathlib import Path

import numpy as np
import pytest

from recordings import InputError
from twin.procedures import dump_procedure, load_procedure
from twin.rigs import RIG_FILES, load_rig, parse_rig

GOOD = RIG_FILES["steel-lap-joint"].read_text()
LINES = GOOD.splitlines()
LONGEST_S, MOST_kB = 2.0, 300_000


def refused(text: str) -> str:
    began = time.process_time()
    with pytest.raises(InputError) as told:
        parse_rig(text.encode(), source="strange.toml")
    assert time.process_time() - began < LONGEST_S
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < MOST_kB + 400_000  # with all the libraries in it
    line = str(told.value)
    assert line.startswith("strange.toml: ")
    assert "\n" not in line
    assert len(line) < 1000
    return line


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a" + ".a" * 30_000 + " = 1", "a key of more than 32 dots"),
        ("[a" + " . 'b'" * 30_000 + "]", "a key of more than 32 dots"),
        ("a = " + "9" * 5_000, "a number of over 64 digits"),
        ("a = 0x" + "f" * 5_000, "a number of over 64 digits"),
        ("a = " + "[" * 200_000, "nested deeper than 32"),
        ("a = " + "{a=" * 200_000, "nested deeper than 32"),
        ("a = [" + "1," * 300_000 + "]", "more than 100000 keys"),
        ("\n".join(f"a{n} = 1" for n in range(110_000)), "larger than 1048576"),
        ("[[a]]\n" * 150_000, "more than 100000 keys"),
        ('a = "' + "." * 200_000 + '"\n' + GOOD, "a"),
    ],
)  # fmt: skip
def test_what_would_take_minutes_or_gigabytes_is_refused_at_once(text: str, reason: str) -> None:
    assert reason in refused(text)


@pytest.mark.parametrize("value", ["1e308", "1e300", "-1e300", "nan", "inf", "9" * 60, "'x'", "[]"])
def test_every_number_of_a_rig_has_bounds(value: str) -> None:
    lines = [
        n
        for n, line in enumerate(LINES)
        if line[:1].isalpha() and "=" in line and line.split("=")[1].strip()[:1].isdigit()
    ]
    assert len(lines) > 20
    for n in lines:
        key = LINES[n].split("=")[0].strip()
        if key == "format":
            continue
        text = "\n".join([*LINES[:n], f"{key} = {value}", *LINES[n + 1 :]])
        assert key in refused(text) or value in refused(text), (key, value)


@pytest.mark.parametrize("value", ["1e300", "1e-300", "nan", "-1.0"])
def test_every_amplitude_of_a_procedure_has_bounds(value: str, tmp_path: Path) -> None:
    text = dump_procedure(load_procedure("steel-sweeps")).decode()
    path = tmp_path / "strange.toml"
    head, _, rest = text.partition("amplitudes = [")
    path.write_text(f"{head}amplitudes = [{value}]{rest[rest.index(']') + 1 :]}")
    with pytest.raises(InputError, match="amplitudes"):
        load_procedure(str(path))


def hostile(generator: np.random.Generator) -> str:
    """A good rig with one thing in it that is hostile."""
    lines = list(LINES)
    n = int(generator.integers(len(lines)))
    key = lines[n].split("=")[0].strip() or "a"
    size = int(10 ** generator.uniform(0, 5))
    value = generator.choice([
        "9" * size, "-" + "9" * size, "1e" + "9" * min(size, 50), "0." + "0" * size + "1", "[" * size, "{a=" * size,
        '"' + "\\u0000" * size, "'" + "x" * size + "'", "1979-05-27T07:32:00Z", "nan", "-inf", "0b" + "1" * size,
    ])  # fmt: skip
    lines[n] = str(generator.choice([f"{key} = {value}", f"{key}{'.a' * size} = 1", f"[{key}{'.a' * size}]", value]))
    return "\n".join(lines)


@pytest.mark.parametrize("count", [200, pytest.param(100_000, marks=pytest.mark.nightly)])
def test_any_hostile_file_is_one_line_or_a_rig(count: int) -> None:
    generator = np.random.default_rng(29)
    for _ in range(count):
        text = hostile(generator)
        began = time.process_time()
        try:
            parse_rig(text.encode(), source="strange.toml")
        except InputError as error:
            assert "\n" not in str(error)  # noqa: PT017
            assert len(str(error)) < 1000  # noqa: PT017
        assert time.process_time() - began < LONGEST_S


def test_shipped_rigs_are_within_the_bounds() -> None:
    for name in RIG_FILES:
        load_rig(name)
