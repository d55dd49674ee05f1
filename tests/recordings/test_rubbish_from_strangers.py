"""Fuzzing of everything that parses a file: a run, a report or one clear error, in bounded time and memory.

The ordinary run tries a thousand inputs and more a parser; the one marked nightly tries a million of each, of which
every tenth damaged run is recovered and checked as well as read.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType
from recording_builders import START_NS, ForeignWriter, block_at, write_run

from recordings import InputError, Limits, Run, read_run
from recordings.check import CheckReport, check_run
from recordings.convert import FORMATS, convert
from recordings.recover import recover
from recordings.tables import read_table

SMALL = Limits(
    values=1 << 20, messages=20_000, record_bytes=1 << 22, text_bytes=1 << 20, attachment_bytes=1 << 20, records=256,
    gap_fill=1 << 12,
)  # fmt: skip
SECONDS = 5.0
"""Of the processor, which the machine may lend to others meanwhile."""
MEMORY_BYTES = 1 << 30
Kinds = ["mcap", "foreign", "uff", "ascii_uff", "csv", "mat", "table"]


@pytest.fixture(scope="module")
def seeds(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A small sound file of each kind."""
    folder = tmp_path_factory.mktemp("seeds")
    run = write_run(folder / "run.mcap", blocks=2)
    found = {"mcap": run.read_bytes()}
    writer = ForeignWriter(folder / "foreign.mcap", compression=CompressionType.NONE, chunk_size=3000)
    for number in range(3):
        writer.block(block_at(number * 64, 64))
    writer.message("/procedure", "Step", START_NS, sweep="a", state=1)
    writer.message("/events", "Event", START_NS, kind="limit")
    found["foreign"] = writer.finish().read_bytes()
    for suffix in ("uff", "csv", "mat"):
        convert(run, folder / f"run.{suffix}")
        found[suffix] = (folder / f"run.{suffix}").read_bytes()
    ascii_uff = Path(__file__).parents[1] / "data" / "recordings" / "uff" / "Sample_UFF58_ascii.uff"
    table = Path(__file__).parents[1] / "data" / "recordings" / "brake_reuss_response_control.csv"
    found["table"] = b"\n".join([*table.read_bytes().splitlines()[:20], b""])
    found["ascii_uff"] = b"\n".join([*ascii_uff.read_bytes().splitlines()[:40], b"    -1\n"])
    return found


damage = st.lists(
    st.one_of(
        st.tuples(st.just("flip"), st.floats(0, 1), st.integers(1, 255)),
        st.tuples(st.just("put"), st.floats(0, 1), st.binary(min_size=1, max_size=16)),
        st.tuples(
            st.just("fill"), st.floats(0, 1), st.sampled_from([b"\x00" * 64, b"\xff" * 8, b"\x7f" + b"\xff" * 7])
        ),
        st.tuples(st.just("cut"), st.floats(0, 1), st.none()),
        st.tuples(st.just("drop"), st.floats(0, 1), st.integers(1, 200)),
        st.tuples(st.just("double"), st.floats(0, 1), st.integers(1, 200)),
    ),
    min_size=1,
    max_size=4,
)


def damaged(data: bytes, changes: list[tuple[str, float, Any]]) -> bytes:
    for kind, where, what in changes:
        at = int(where * max(len(data) - 1, 0))
        if kind == "flip" and data:
            data = data[:at] + bytes([data[at] ^ what]) + data[at + 1 :]
        elif kind in ("put", "fill"):
            data = data[:at] + what + data[at + len(what) :]
        elif kind == "cut":
            data = data[:at]
        elif kind == "drop":
            data = data[:at] + data[at + what :]
        elif kind == "double":
            data = data[: at + what] + data[at:]
    return data


def parse(kind: str, path: Path, *, recovering: bool = True) -> None:
    """Run every parser of a kind of file; anything but a result or an InputError fails the test."""
    if kind in ("mcap", "foreign"):
        strict = told(lambda: read_run(path, limits=SMALL))
        if not recovering:
            return
        report = told(lambda: check_run(path, limits=SMALL))
        if isinstance(report, CheckReport):
            assert report.sound == isinstance(strict, Run), (strict, report.problems)
            out = path.with_name("out.mcap")
            out.unlink(missing_ok=True)
            recovered = recover(path, out, limits=SMALL)
            if recovered.sound:
                assert isinstance(read_run(out), Run)
    elif kind == "table":
        told(lambda: read_table(path))
    else:
        suffix = ".uff" if kind == "ascii_uff" else f".{kind}"
        read = next(each.read for each in FORMATS if each.suffix == suffix)
        assert read is not None
        told(lambda: read(path))


def told(action: Callable[[], object]) -> object:
    try:
        return action()
    except InputError as raised:
        error = raised
    assert "\n" not in str(error)
    assert len(str(error)) < 600
    return error


@pytest.mark.parametrize("kind", Kinds)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(changes=damage)
def test_damaged_file(kind: str, changes: list[Any], seeds: dict[str, bytes], tmp_path: Path) -> None:
    path = tmp_path / "fuzzed"
    path.write_bytes(damaged(seeds[kind], changes))
    started = time.process_time()
    parse(kind, path)
    assert time.process_time() - started < SECONDS


@pytest.mark.parametrize("kind", ["mcap", "uff", "csv", "mat"])
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=400), headed=st.booleans())
def test_random_bytes(kind: str, data: bytes, headed: bool, seeds: dict[str, bytes], tmp_path: Path) -> None:
    path = tmp_path / "fuzzed"
    path.write_bytes((seeds[kind][:150] if headed else b"") + data)
    parse(kind, path)


def test_file_made_of_beginnings_of_records_takes_bounded_time(tmp_path: Path) -> None:
    """Every byte claims to begin a record: the search after damage must give up instead of trying forever."""
    path = tmp_path / "hostile.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + b"\x00" + b"\x0c\x40\x00\x00\x00\x00\x00\x00\x00" * 300_000)
    started = time.process_time()
    assert not check_run(path, limits=SMALL).sound
    assert time.process_time() - started < 30


MEASURED = """
import random, resource, sys, time
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from test_rubbish_from_strangers import SECONDS, damaged, parse
folder, kind, count = Path(sys.argv[1]), sys.argv[3], int(sys.argv[4])
random.seed(3)
seed = (folder / "seed").read_bytes()
parse(kind, folder / "seed")
base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
for number in range(count):
    changes = [
        random.choice([
            ("flip", random.random(), random.randrange(1, 256)), ("put", random.random(), random.randbytes(8)),
            ("fill", random.random(), b"\\xff" * 6), ("cut", random.random(), None),
            ("drop", random.random(), random.randrange(1, 64)), ("double", random.random(), random.randrange(1, 200)),
        ])
        for _ in range(random.randrange(1, 3))
    ]
    data = damaged(seed, changes) if number % 10 else seed[:150 * (number % 20 > 0)] + random.randbytes(200)
    (folder / "fuzzed").write_bytes(data)
    began = time.process_time()
    try:
        parse(kind, folder / "fuzzed", recovering=count < 10_000 or number % 10 == 0)
    except BaseException:
        print("input", number, changes, file=sys.stderr)
        raise
    assert time.process_time() - began < SECONDS, (number, changes)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - base) * 1024)
"""


@pytest.mark.parametrize(
    "count",
    [200, pytest.param(1000, marks=pytest.mark.slow), pytest.param(1_000_000, marks=pytest.mark.nightly)],
)
@pytest.mark.parametrize("kind", Kinds)
def test_by_the_thousand_in_bounded_time_and_memory(
    kind: str, count: int, seeds: dict[str, bytes], tmp_path: Path
) -> None:
    """In a process of its own, whose peak memory is its own, and whose address space ends at 8 GiB."""
    (tmp_path / "seed").write_bytes(seeds[kind])
    arguments = [sys.executable, "-c", MEASURED, str(tmp_path), str(Path(__file__).parent), kind, str(count)]
    result = subprocess.run(
        arguments, capture_output=True, text=True, timeout=300 + 0.1 * count,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30)),
    )  # fmt: skip
    assert result.returncode == 0, result.stderr[-2000:]
    assert int(result.stdout) < MEMORY_BYTES
