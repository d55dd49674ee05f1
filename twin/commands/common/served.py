"""The virtual instruments in a process of their own, for as long as a client needs them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

READY_s = 180.0
"""Longest wait for the instruments; on a fresh installation they compile their kernels first."""
CHILD = """
import sys
from twin.commands.common.stopping import end_with_parent
end_with_parent(int(sys.argv.pop(1)))
from twin.cli import main
main(sys.argv[1:])
"""
"""``twin`` that does not outlive who started it."""


class ServedRigError(Exception):
    """The virtual instruments did not do what they are there for."""


class ServedRig:
    """``twin serve`` as a child process: steel or other rig, a new pseudo-terminal and a CAN bus on a local socket.

    ServedRigError from :meth:`wait_ready` if the instruments do not come up; with what they said last.

    Parameters
    ----------
    rig
        Rig file, as it really is.
    folder
        Where the bus, the log and the client's file of addresses go.
    """

    def __init__(self, rig: Path, *, folder: Path, seed: int) -> None:
        self.instruments = folder / "instruments.toml"
        self._log = folder / "serve.log"
        self.command = [
            "serve", "--rig", str(rig), "--serial", "auto", "--can", f"unixbus:{folder / 'bus'}",
            "--speed", "fast", "--seed", str(seed), "--instruments-out", str(self.instruments),
        ]  # fmt: skip
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> ServedRig:
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-c", CHILD, str(os.getpid()), *self.command],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=log,
                start_new_session=True,  # Ctrl-C in the terminal is for the client, which then stops this one
            )  # fmt: skip
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process is not None
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def wait_ready(self) -> None:
        """Wait until the instruments listen."""
        assert self._process is not None
        give_up = time.monotonic() + READY_s
        while not self.instruments.exists():
            if self._process.poll() is not None or time.monotonic() > give_up:
                lines = self._log.read_text(errors="replace").strip().splitlines()
                raise ServedRigError(f"the virtual instruments did not start: {lines[-1] if lines else 'no word'}")
            time.sleep(0.05)
