"""Interrupts and signals while a run is opened, written and closed: no half record, no file of nobody."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import FrameType

import pytest
from recording_builders import CHANNELS, INFO, block_at

from recordings import RunWriter, read_run
from recordings.check import check_run


class _InterruptedAt:
    """Raises KeyboardInterrupt at the n-th line that the writer's own modules run, as a signal might."""

    def __init__(self, number: int) -> None:
        self.left = number

    def __call__(self, frame: FrameType, event: str, argument: object) -> object:
        if threading.current_thread() is not threading.main_thread() or self.left <= 0:
            return None
        if Path(frame.f_code.co_filename).name not in ("opening.py", "writer.py", "uninterrupted.py"):
            return None
        if event == "line":
            self.left -= 1
            if self.left == 0:
                raise KeyboardInterrupt
        return self


@pytest.mark.parametrize("old", [None, b"precious"], ids=["new", "overwritten"])
def test_interrupt_at_any_line_of_the_opening_leaves_nothing_or_a_sound_file(tmp_path: Path, old: bytes | None) -> None:
    path = tmp_path / "run.mcap"
    left = {"nothing": 0, "old": 0}
    opened = False
    number = 0
    before, handler = sys.gettrace(), signal.getsignal(signal.SIGINT)
    while not opened:
        number += 1
        assert number < 5000
        if old is not None:
            path.write_bytes(old)
        sys.settrace(_InterruptedAt(number))
        try:
            writer = RunWriter(path, info=INFO, channels=CHANNELS, overwrite=old is not None)
            opened = True
        except KeyboardInterrupt:
            pass
        finally:
            sys.settrace(before)
        names = [each.name for each in tmp_path.iterdir()]
        if opened:
            break
        if names == ["run.mcap"] and path.read_bytes() == old:
            left["old"] += 1
        else:  # what was replaced is replaced, but no torn file is left
            assert names == []
            left["nothing"] += 1
        assert signal.getsignal(signal.SIGINT) is handler
    assert number > 100
    assert left["nothing" if old is None else "old"] > 0.9 * number
    writer.close()
    assert check_run(path).sound
    for thread in threading.enumerate():
        if thread.name == "run-writer-flush":
            thread.join(60)
            assert not thread.is_alive()


INTERRUPTED_BETWEEN = """
import sys
sys.path.insert(0, sys.argv[2])
from recording_builders import CHANNELS, INFO
from recordings import RunWriter
writer = RunWriter(sys.argv[1], info=INFO, channels=CHANNELS)
raise KeyboardInterrupt
"""


def test_interrupt_before_the_with_statement_leaves_a_sound_file(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    arguments = [sys.executable, "-c", INTERRUPTED_BETWEEN, str(path), str(Path(__file__).parent)]
    result = subprocess.run(arguments, capture_output=True, text=True, timeout=300)
    assert "KeyboardInterrupt" in result.stderr
    assert [each.name for each in tmp_path.iterdir()] == ["run.mcap"]
    assert check_run(path).sound


class _SignalAt:
    """Sends a signal at the n-th line of MCAP code that the main thread runs."""

    def __init__(self, number: int, which: signal.Signals) -> None:
        self.left, self._which = number, which

    def __call__(self, frame: FrameType, event: str, argument: object) -> object:
        if self.left <= 0 or "/mcap/" not in frame.f_code.co_filename:
            return None
        if event == "line":
            self.left -= 1
            if self.left == 0:
                signal.raise_signal(self._which)
        return self


@pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "sigterm"])
def test_signal_in_the_midst_of_a_record_comes_after_it(tmp_path: Path, which: signal.Signals) -> None:
    """At every line of writing a record that closes a chunk; without care half of one stays in the file."""
    kept, finished, number = [], False, 0
    before, usual = sys.gettrace(), signal.signal(which, signal.default_int_handler)
    try:
        while not finished:
            number += 1
            path = tmp_path / f"{number}.mcap"
            with contextlib.suppress(KeyboardInterrupt), RunWriter(
                path, info=INFO, channels=CHANNELS, compression="none"
            ) as writer:  # fmt: skip
                for block in range(31):
                    writer.write_block(block_at(block * 256))
                sys.settrace(_SignalAt(number, which))
                try:
                    writer.write_block(block_at(31 * 256))
                    finished = True
                finally:
                    sys.settrace(before)
            assert check_run(path).sound
            kept.append(len(read_run(path).devices["daq"]) // 256)
    finally:
        signal.signal(which, usual)
    assert set(kept) == {32}
    assert number > 40


def test_handlers_are_as_before_when_writers_have_closed_in_any_order(tmp_path: Path) -> None:
    before = signal.getsignal(signal.SIGINT)
    options = {"info": INFO, "channels": CHANNELS}
    for order in (1, -1):
        writers = [RunWriter(tmp_path / f"{order}{number}.mcap", **options) for number in range(2)]
        for writer in writers[::order]:
            writer.close()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


TERMINATED = """
import signal, sys
sys.path.insert(0, sys.argv[2])
from recording_builders import CHANNELS, INFO
from recordings import RunWriter
writer = RunWriter(sys.argv[1], info=INFO, channels=CHANNELS)
signal.raise_signal(signal.SIGTERM)
print("still here")
"""


def test_sigterm_that_nobody_handles_still_ends_the_program(tmp_path: Path) -> None:
    arguments = [sys.executable, "-c", TERMINATED, str(tmp_path / "run.mcap"), str(Path(__file__).parent)]
    result = subprocess.run(arguments, capture_output=True, text=True, timeout=300)
    assert (result.returncode, result.stdout) == (-signal.SIGTERM, "")
