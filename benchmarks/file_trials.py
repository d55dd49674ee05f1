"""A recording whose program is killed, whose disk is full or whose folder is read-only: what is left, and is it right.

The program that acquires is a process of its own here, in real time, with four channels at 25.6 kHz.
"""

from __future__ import annotations

import os
import resource
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from benchmarks.fault_trials import Outcome, judge, served_tone
from drivers.virtual.tone import Tone
from recordings import read_run
from recordings.check import check_run
from recordings.recover import recover

RATE_Hz = 25600.0
DISK_BYTES = 600_000
"""How long a file may get; a limit of the process stands for the disk."""
PATIENCE_s = 60.0


def try_kill(folder: Path, *, seed: int, program: Sequence[str]) -> Outcome:
    """``kill -9`` after a second or two; `lost` are the samples made by then that the recovered file does not hold.

    `program` is what acquires; it takes ``--instruments``, ``--out``, ``--seconds`` and ``--quiet``.
    """
    out = folder / "run.mcap"
    with _acquiring(program, folder, out) as (process, tone):
        _wait_for(out, process)
        time.sleep(1.5 + 0.1 * (seed % 10))
        made = tone.index
        process.kill()
        process.wait(PATIENCE_s)
    noticed = not check_run(out).sound
    return _what_is_left(out, tone, made=made, noticed=noticed)


def try_full_disk(folder: Path, *, seed: int, program: Sequence[str]) -> Outcome:
    """The file cannot grow beyond a limit: the program must say so in one line and end with status 2."""
    out = folder / "run.mcap"
    with _acquiring(program, folder, out) as (process, tone):
        _wait_for(out, process)
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (DISK_BYTES + seed, DISK_BYTES + seed))
        _, told = process.communicate(timeout=PATIENCE_s)
        made = tone.index
    noticed = process.returncode == 2 and "cannot be written" in told and told.strip().count("\n") == 0
    return _what_is_left(out, tone, made=made, noticed=noticed)


def try_read_only(folder: Path, *, seed: int, program: Sequence[str]) -> Outcome:
    """Nothing may be written there: one line, status 2, and nothing left behind."""
    closed = folder / "closed"
    closed.mkdir()
    closed.chmod(0o555)
    with _acquiring(program, folder, closed / "run.mcap", bound_by_rights=True) as (process, _):
        _, told = process.communicate(timeout=PATIENCE_s)
    noticed = process.returncode == 2 and "cannot be written" in told and told.strip().count("\n") == 0
    left = len(list(closed.iterdir()))
    return Outcome(happened=1, noticed=noticed, stored=0, lost=0, silently_wrong=left)


@contextmanager
def _acquiring(
    program: Sequence[str], folder: Path, out: Path, *, bound_by_rights: bool = False
) -> Iterator[tuple[subprocess.Popen[str], Tone]]:
    """The program at work on a tone."""
    arguments = ["--instruments", str(folder / "instruments.toml"), "--out", str(out)]
    arguments += ["--seconds", str(PATIENCE_s), "--quiet"]
    # Root may write everywhere, unless that is taken away; setpriv is on every Linux.
    as_root = bound_by_rights and os.geteuid() == 0
    prefix = ["setpriv", "--bounding-set=-dac_override,-dac_read_search"] if as_root else []
    with served_tone(folder, speed=1.0, sample_rate_Hz=RATE_Hz) as (_, tone, _), subprocess.Popen(
        [*prefix, *program, *arguments],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        try:
            yield process, tone
        finally:
            process.kill()


def _wait_for(path: Path, process: subprocess.Popen[str]) -> None:
    give_up = time.monotonic() + PATIENCE_s
    while not path.exists():
        if process.poll() is not None or time.monotonic() > give_up:
            raise RuntimeError(f"acquire made no recording: {process.stderr.read() if process.stderr else ''}")
        time.sleep(0.02)


def _what_is_left(out: Path, tone: Tone, *, made: int, noticed: bool) -> Outcome:
    recovered = out.with_name("recovered.mcap")
    recover(out, recovered)
    run = read_run(recovered)
    wrong, stored = judge(run, tone)
    events = {event.kind for event in run.events}
    return Outcome(
        happened=1, noticed=noticed and "recovered" in events, stored=stored,
        lost=max(0, made * len(tone.channels) - stored), silently_wrong=wrong,
    )  # fmt: skip
