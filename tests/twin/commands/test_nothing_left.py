"""However a program ends: no process of its own goes on, and what lies about is removed by the next one."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from recordings.beside import temporary_folder

DEMO = """
import sys
from pathlib import Path
from twin.commands.common.served import ServedRig
from twin.rigs import load_rig, save_rig
folder = Path(sys.argv[1])
save_rig(load_rig("steel-lap-joint"), folder / "rig.toml")
with ServedRig(folder / "rig.toml", folder=folder, seed=1) as served:
    print(served._process.pid, flush=True)
    input()
"""


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2][0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("ready", [False, True], ids=["while it starts", "while it serves"])
def test_a_server_ends_with_the_program_that_started_it(ready: bool, tmp_path: Path) -> None:
    arguments = [sys.executable, "-c", DEMO, str(tmp_path)]
    with subprocess.Popen(arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        server = int(program.stdout.readline())
        give_up = time.monotonic() + 120
        while ready and not (tmp_path / "instruments.toml").exists():
            assert time.monotonic() < give_up
            time.sleep(0.05)
        program.kill()
    give_up = time.monotonic() + 30
    while alive(server):
        assert time.monotonic() < give_up
        time.sleep(0.05)


def test_temporary_folders_of_killed_programs_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    pid = os.fork()
    if pid == 0:
        with temporary_folder("twin-demo") as folder:
            (folder / "run.mcap").write_bytes(b"half")
            os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(pid, 0)
    (left,) = tmp_path.iterdir()
    with temporary_folder("twin-demo"):
        assert not left.exists()
    assert list(tmp_path.iterdir()) == []
