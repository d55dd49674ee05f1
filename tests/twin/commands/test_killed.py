"""``kill -9`` at any moment: the old result is there, or the new one, or a recording that recovers; never a mixture.

The next run leaves no process and no file of the killed ones.  What takes a random moment of every command two hundred
times is marked nightly.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import tomllib
import uuid
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import pytest
from served_apart import served_apart
from two_steps import TWO_STEPS

from recordings import RunWriter
from recordings.check import check_run
from recordings.recover import recover
from twin.bench import open_bench
from twin.procedures import DirectAcquisition, Random, run_procedure
from twin.rigs import load_rig

SWEEPS = Path(__file__).parents[2] / "data" / "brake-reuss" / "response_control.csv"
OLD = b"what was there before\n"
PATIENCE_S = 600.0
ENDED_S = 30.0
"""For a process to notice that its parent has been killed, on a busy machine."""
STARTED_S = 1.0
"""Before that, Python itself may be interrupted while it starts."""
INTERRUPTED_S = 5.0
"""Two seconds are promised; on a busy machine they may be five."""
LATE = 0.7
"""Share of a run after which most is written; every second moment lies there."""


@dataclass(frozen=True)
class Killed:
    """A command that writes; where it takes `again`, an old result is replaced."""

    words: str
    out: str
    """What it writes: a folder, or files by name."""
    again: str = "--overwrite"
    recovers: bool = False
    """Whether a recording is worth having before it is whole."""


COMMANDS = {
    "rehearse": Killed("rehearse sweep.toml --rig steel-lap-joint --rounds 1 --out out", "out", recovers=True),
    "acquire": Killed("acquire --instruments instruments.toml --seconds 400 --out out.mcap", "out.mcap", recovers=True),
    "predict": Killed("predict steel-lap-joint --drive drive.csv --out out.csv", "out.csv"),
    "identify": Killed(f"identify {SWEEPS} --rig brake-reuss --out out.toml", "out.toml out.html"),
    "diagnose": Killed(f"diagnose {SWEEPS} --rig brake-reuss --out out", "out"),
    "modes": Killed("modes run.mcap --out out.csv --picture out.png", "out.csv out.png"),
    "convert": Killed("convert run.mcap out.mat", "out.mat"),
    "recover": Killed("check run.mcap --recover out.mcap", "out.mcap", again=""),
    "view": Killed("view run.mcap --save out.rrd", "out.rrd"),
    "rig": Killed("rig show steel-lap-joint --picture out.png --save out.rrd", "out.png out.rrd"),
    "campaign": Killed("campaign --out out --seeds 1 --cause none --workers 1", "out", again="", recovers=True),
    "demo": Killed("demo --seed 7 --cause added-mass --out out", "out", recovers=True),
}
QUICK, LONG = ("predict", "convert", "view"), ("campaign", "demo")
"""Commands of seconds, and of a minute and more."""


def moments() -> Iterator[object]:
    for name in COMMANDS:
        few = pytest.mark.nightly if name in LONG else () if name in QUICK else pytest.mark.slow
        yield pytest.param(name, 2, marks=few, id=f"{name}-2")
        yield pytest.param(name, 200, marks=pytest.mark.nightly, id=f"{name}-200")


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """What the commands read, and a server for those that measure."""
    folder = tmp_path_factory.mktemp("inputs")
    (folder / "sweep.toml").write_text(TWO_STEPS)
    (folder / "drive.csv").write_text("frequency_Hz,force_N\n26.3,2\n26.5,2\n")
    rig = load_rig("steel-lap-joint")
    acquisition = DirectAcquisition(open_bench(rig, seed=0))
    info = {"source": "simulated", "rig": rig.name, "preload_N": "120"}
    with RunWriter(folder / "run.mcap", info=info, channels=list(acquisition.channels)) as writer:
        noise = Random(band=(5.0, 1000.0), duration=20.0, rms=0.5)
        assert run_procedure(noise, acquisition, writer).state == "done"
    with ExitStack() as stack:
        served = stack.enter_context(served_apart(folder))
        (folder / "instruments.toml").write_text(served.instruments_toml)
        yield folder


class Runs:
    """One command in a folder of its own, run again and again; its processes are known by a mark that they inherit."""

    def __init__(self, command: Killed, inputs: Path, folder: Path) -> None:
        self.command, self.folder, self.temporary = command, folder, folder / "tmp"
        self.temporary.mkdir()
        for path in inputs.iterdir():
            if path.is_file():
                shutil.copy(path, folder)
        self.others = {*folder.iterdir()}
        self.mark = f"KILLED={uuid.uuid4().hex}"
        name, _, value = self.mark.partition("=")
        self.environment = {**os.environ, "TMPDIR": str(self.temporary), name: value}

    def start(self) -> subprocess.Popen[bytes]:
        words = [*self.command.words.split(), *self.command.again.split(), "--quiet"]
        return subprocess.Popen(
            [Path(sys.executable).with_name("twin"), *words], cwd=self.folder, env=self.environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True,
        )  # fmt: skip

    def whole(self) -> tuple[float, dict[str, bytes]]:
        """How long a run takes that nobody kills, and what it leaves."""
        began = time.monotonic()
        with self.start() as program:
            _, told = program.communicate(timeout=PATIENCE_S)
        assert program.returncode in (0, 1), told.decode()
        return time.monotonic() - began, self.results()

    def results(self) -> dict[str, bytes]:
        """Results by name, hidden files left out."""
        found = {}
        for name in self.command.out.split():
            top = self.folder / name
            for path in sorted(top.rglob("*")) if top.is_dir() else [top]:
                hidden = any(part.startswith(".") for part in path.relative_to(self.folder).parts)
                if path.is_file() and not hidden:
                    found[str(path.relative_to(self.folder))] = path.read_bytes()
        return found

    def clear(self, old: Mapping[str, bytes]) -> None:
        """An old result, or none, in place of whatever is there; what a killed run has hidden stays."""
        for name in self.command.out.split():
            path = self.folder / name
            shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
        for name, content in old.items():
            (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
            (self.folder / name).write_bytes(content)

    def processes(self) -> list[int]:
        """Those that live and bear the mark."""
        found = []
        for path in Path("/proc").glob("[0-9]*"):
            try:
                if self.mark.encode() in (path / "environ").read_bytes().split(b"\0"):
                    found.append(int(path.name))
            except OSError:
                continue  # it has ended, or is somebody else's
        return found

    def kill_at(self, seconds: float) -> None:
        with self.start() as program:
            try:
                program.wait(seconds)
            except subprocess.TimeoutExpired:
                program.send_signal(signal.SIGKILL)
        give_up = time.monotonic() + ENDED_S
        while self.processes():
            assert time.monotonic() < give_up, f"killed at {seconds:.3f} s, there go on: {self.told()}"
            time.sleep(0.05)

    def interrupt_at(self, seconds: float) -> tuple[int, str, float]:
        """Ctrl-C, which all of a terminal's processes hear: the status, what was told, how long it took."""
        with self.start() as program:
            try:
                program.wait(seconds)
            except subprocess.TimeoutExpired:
                os.killpg(program.pid, signal.SIGINT)
            asked = time.monotonic()
            _, told = program.communicate(timeout=PATIENCE_S)
        return program.returncode, told.decode(), time.monotonic() - asked

    def told(self) -> list[bytes]:
        return [Path(f"/proc/{pid}/cmdline").read_bytes() for pid in self.processes()]


@pytest.mark.parametrize(("name", "count"), [*moments()])
def test_killed_at_any_moment(name: str, count: int, inputs: Path, tmp_path: Path) -> None:
    command = COMMANDS[name]
    runs = Runs(command, inputs, tmp_path)
    runs.whole()  # compiles what is not compiled yet
    runs.clear({})
    lasts_s, new = runs.whole()
    dice = random.Random(29)
    left: dict[str, int] = {}
    for number in range(count):
        old = dict.fromkeys(new, OLD) if command.again and number % 2 else {}
        runs.clear(old)
        begin = LATE if number % 4 > 1 else 0.0
        moment_s = dice.uniform(begin, 1.02) * lasts_s
        runs.kill_at(moment_s)
        found = runs.results()
        kind = judge(runs, found, old, new)
        left[kind] = left.get(kind, 0) + 1
        assert kind != "mixture", (moment_s, lasts_s, sorted(found), [k for k, v in found.items() if v == OLD])
    runs.clear({})
    runs.whole()
    there = {*tmp_path.iterdir()} - runs.others
    assert {path.name for path in there} == set(command.out.split())
    assert [*runs.temporary.iterdir()] == []
    print(f"{name}, killed {count} times within {lasts_s:.1f} s: {left}")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "count"), [("acquire", 6), ("rehearse", 4), ("diagnose", 4), ("campaign", 2)])
def test_ctrl_c_is_one_line_and_leaves_nothing_half(name: str, count: int, inputs: Path, tmp_path: Path) -> None:
    runs = Runs(COMMANDS[name], inputs, tmp_path)
    if name in LONG:
        lasts_s, names = 20.0, set[str]()
    else:
        runs.whole()
        runs.clear({})
        lasts_s, new = runs.whole()
        names = set(new)
    dice = random.Random(29)
    for _ in range(count):
        old = dict.fromkeys(names, OLD)
        runs.clear(old)
        moment_s = dice.uniform(STARTED_S, lasts_s)
        status, told, took_s = runs.interrupt_at(moment_s)
        found = runs.results()
        assert status in (0, 1, 130), (moment_s, told)
        assert len(told.strip().splitlines()) <= 1, (moment_s, told)  # stripped of the end of the terminal's ^C
        assert took_s < INTERRUPTED_S, moment_s
        assert found == old or OLD not in found.values(), (moment_s, sorted(found))
        assert all(sound(tmp_path, each) for each in found if found != old)
        assert runs.processes() == []
        assert name in LONG or not [*runs.temporary.iterdir()]  # a case's folder is the next campaign's to remove


@pytest.mark.slow
@pytest.mark.parametrize("words", ["faults --tries 2", "reproduce", "speed"])
def test_ctrl_c_ends_what_writes_nothing(words: str, inputs: Path, tmp_path: Path) -> None:
    """Also where a command calls another one, which takes an interrupt as its end in order."""
    runs = Runs(Killed(words, "", again=""), inputs, tmp_path)
    del runs.environment["TMPDIR"]  # a socket's path is short
    for moment_s in (5.0, 9.0):  # well after Python itself has started, on a busy machine too
        status, told, took_s = runs.interrupt_at(moment_s)
        assert (status, told.strip()) == (130, "twin: interrupted"), moment_s
        assert took_s < INTERRUPTED_S, moment_s
        assert runs.processes() == []


def judge(runs: Runs, found: dict[str, bytes], old: dict[str, bytes], new: dict[str, bytes]) -> str:
    """What a killed run has left."""
    if found == old:
        return "old" if old else "nothing"
    if OLD in found.values():
        return "mixture"
    if found.keys() == new.keys() and all(sound(runs.folder, name) for name in found):
        return "new"
    if not old and runs.command.recovers and all(recoverable(runs.folder, name) for name in found):
        return "recovers"
    return "mixture"


def sound(folder: Path, name: str) -> bool:
    """Whether a file is whole, as far as its kind tells."""
    path = folder / name
    data = path.read_bytes()
    match path.suffix:
        case ".mcap":
            return check_run(path).sound
        case ".json":
            return bool(json.loads(data))
        case ".toml":
            return bool(tomllib.loads(data.decode()))
        case ".html":
            return data.rstrip().endswith(b"</html>")
        case ".png":
            return data.endswith(b"IEND\xaeB`\x82")
        case _:
            return len(data) > 0


def recoverable(folder: Path, name: str) -> bool:
    """Whether a file is whole, or a recording that recovers."""
    path = folder / name
    if path.suffix == ".mcap" and not check_run(path).sound:
        whole = folder / f"whole-{uuid.uuid4().hex}.mcap"
        recover(path, whole)
        good = check_run(whole).sound
        whole.unlink()
        return good
    return sound(folder, name)
