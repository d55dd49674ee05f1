"""Virtual instruments in a process of their own, as on a bench: clients and server share no interpreter lock."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

SERVER = """
import json, signal, sys
sys.path[:0] = sys.argv[2:]
from drivers.virtual import Addresses, Protection, VirtualRig, parse_fault
from drivers.virtual.tone import Tone
stopping = []
signal.signal(signal.SIGTERM, lambda *_: stopping.append(1))
bus = "unixbus:" + sys.argv[1] + "/bus"
rig = {rig}
print(json.dumps([rig.ready, rig.instruments_toml]), flush=True)
rig.serve(lambda: bool(stopping))
"""
EVERY_LINE = """VirtualRig(
    Tone(("force", "acc1", "acc2"), sample_rate_Hz=5120.0),
    Addresses(serial="auto", tcp="127.0.0.1:0", can=bus, can_channels=("acc2",)),
    speed=None, protection=Protection(watchdog_s=1.0),
)"""
"""A tone on every kind of line, as fast as its clients take it."""


@dataclass(frozen=True)
class Apart:
    """Where the instruments are, those lines that they have, and the process they live in."""

    serial: str
    tcp: str
    can: str
    instruments_toml: str
    process: subprocess.Popen[str]

    @property
    def resident_bytes(self) -> int:
        """Memory of the server."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE")


@contextmanager
def served_apart(folder: Path, rig: str = EVERY_LINE) -> Iterator[Apart]:
    """A server of `rig`, an expression in which `bus` is the address of a bus in the folder."""
    arguments = [sys.executable, "-c", SERVER.format(rig=rig), str(folder), *sys.path]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            ready, instruments = json.loads(process.stdout.readline())
            where = {"serial": ""} | {key: value for entry in ready for key, value in entry.items()}
            yield Apart(where["serial"], where["tcp"], where["can"], instruments, process)
            assert process.poll() is None, "the server has died"
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
