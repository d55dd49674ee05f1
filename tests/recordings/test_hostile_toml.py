"""TOML from strangers: whatever it is, one line within two seconds and 300 MB, and nothing beyond a bound."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from recordings import InputError
from recordings.toml_input import Question, parse_toml
from twin.procedures import dump_procedure, load_procedure
from twin.rigs import RIG_FILES, load_rig, parse_rig

GOOD = RIG_FILES["steel-lap-joint"].read_text()
LINES = GOOD.splitlines()
LONGEST_S, MOST_kB = 2.0, 300_000
START_S = 6.0
"""For a command to import what it needs, on a busy machine, before it reads anything."""


def memory_kB(name: str) -> int:
    """Of this process: ``VmRSS``, what it has, or ``VmHWM``, the most it had."""
    status = Path("/proc/self/status").read_text()
    return int(status.partition(f"{name}:")[2].split()[0])


@contextmanager
def cheap() -> Iterator[None]:
    """The block takes no more time and memory than a stranger's file may cost."""
    Path("/proc/self/clear_refs").write_text("5")  # the kernel's word for: forget the most it had
    before, began = memory_kB("VmRSS"), time.process_time()
    try:
        yield
    finally:
        assert time.process_time() - began < LONGEST_S
        assert memory_kB("VmHWM") - before < MOST_kB


def refused(text: str) -> str:
    with cheap(), pytest.raises(InputError) as told:
        parse_rig(text.encode(), source="strange.toml")
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


def hostile(generator: np.random.Generator, good: str = GOOD) -> str:
    """A good file with one thing in it that is hostile."""
    lines = good.splitlines()
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
        try:
            with cheap():
                parse_rig(text.encode(), source="strange.toml")
        except InputError as error:
            assert "\n" not in str(error)  # noqa: PT017
            assert len(str(error)) < 1000  # noqa: PT017


DOORS = {
    "rig": (GOOD, ["rig", "show", "strange.toml"]),
    "procedure": (
        dump_procedure(load_procedure("steel-sweeps")).decode(),
        ["rehearse", "strange.toml", "--rig", "steel-lap-joint", "--out", "new"],
    ),
    "instruments": (
        '[[device]]\nname = "daq"\naddress = "serial:none"\n',
        ["acquire", "--instruments", "strange.toml", "--out", "new.mcap"],
    ),
    "channels": (
        '[[device]]\nname = "daq"\naddress = "tcp:127.0.0.1:1"\n[device.channels.acc1]\nunit = "g"\n',
        ["acquire", "--instruments", "strange.toml", "--out", "new.mcap"],
    ),
}
"""Where TOML comes in: a good file, and the command that reads it."""
MEASURED = """
import sys, time
from pathlib import Path
from twin.cli import main
try:
    main(sys.argv[1:])
finally:
    print(Path("/proc/self/status").read_text().partition("VmHWM:")[2].split()[0], time.process_time())
"""
"""The command, and at its end the most memory it had, kB, and the processor's time, s."""


@pytest.mark.parametrize("count", [1, pytest.param(100, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("door", DOORS)
def test_a_command_refuses_it_at_once(door: str, count: int, tmp_path: Path) -> None:
    good, words = DOORS[door]
    generator = np.random.default_rng(29)
    tried = 0
    while tried < count:
        text = hostile(generator, good)
        try:
            parse_toml(text.encode(), Question, source="strange.toml")
            continue  # a command may have work with it for hours
        except InputError:
            tried += 1
        (tmp_path / "strange.toml").write_text(text)
        done = subprocess.run(
            [sys.executable, "-c", MEASURED, *words], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stderr.count("\n")) == (2, 1), (text[:200], done.stderr)
        assert "strange.toml" in done.stderr
        most_kB, used_s = done.stdout.split()
        assert int(most_kB) < MOST_kB
        assert float(used_s) < LONGEST_S + START_S


def test_shipped_rigs_are_within_the_bounds() -> None:
    for name in RIG_FILES:
        load_rig(name)
