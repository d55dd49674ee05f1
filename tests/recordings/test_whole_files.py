"""A file that is being written appears whole under its name, or not at all."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from recording_builders import CHANNELS, INFO, block_at

from recordings import InputError, RunWriter, check_writable, read_run, whole_file
from recordings.whole import whole_files


def test_it_appears_at_the_end_and_keeps_its_suffix(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    with whole_file(path) as part:
        part.write_text("a")
        assert part.suffix == ".csv"
        assert not path.exists()
    assert path.read_text() == "a"
    assert list(tmp_path.iterdir()) == [path]


def test_a_failure_leaves_what_was_there_before(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError), whole_file(path) as part:
        assert part.write_text("new") // 0
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_the_system_refuses_is_told_of_the_file_that_was_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "none" / "table.csv"
    told = r"none/table\.csv: cannot be written: no such file or directory"
    with pytest.raises(InputError, match=told), whole_file(path) as part:
        part.write_text("a")


def test_a_place_that_cannot_be_written_is_told_before_the_work(tmp_path):
    check_writable(None, tmp_path / "fine.csv", overwrite=True)
    assert list(tmp_path.iterdir()) == []
    for path in (tmp_path, tmp_path / "missing" / "x.csv", Path("/proc/none")):
        with pytest.raises(InputError):
            check_writable(path, overwrite=True)


def test_what_is_there_is_refused_unless_it_may_be_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    check_writable(path, overwrite=False)
    path.symlink_to("nowhere")
    with pytest.raises(InputError, match="exists already"):
        check_writable(path, overwrite=False)


def test_nobody_else_can_plant_a_link_where_it_is_written(tmp_path: Path) -> None:
    names = set()
    for _ in range(2):
        with whole_file(tmp_path / "table.csv") as part:
            part.write_text("a")
            names.add(part.parent.name)
            assert part.parent.stat().st_mode & 0o777 == 0o700
    assert len(names) == 2


def test_what_a_killed_program_left_is_removed_by_the_next_and_what_a_living_one_makes_is_not(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    pid = os.fork()
    if pid == 0:
        with whole_file(path) as part:
            part.write_text("half")
            os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(pid, 0)
    (left,) = tmp_path.iterdir()
    precious = tmp_path / "precious"
    precious.mkdir()
    (tmp_path / ".table.csv.planted.part").symlink_to(precious)
    with whole_file(path) as part:
        assert not left.exists()
        check_writable(path, overwrite=True)
        assert part.parent.exists()
        part.write_text("whole")
    assert path.read_text() == "whole"
    assert precious.exists()


def test_an_overwritten_recording_stands_until_the_new_one_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(b"old")
    with RunWriter(path, info=INFO, channels=CHANNELS, overwrite=True) as writer:
        writer.write_block(block_at(0))
        assert path.read_bytes() == b"old"
    assert read_run(path).devices
    before = path.read_bytes()
    with RunWriter(path, info=INFO, channels=CHANNELS, overwrite=True) as writer:
        writer.abandon()
    assert path.read_bytes() == before
    with RunWriter(tmp_path / "new.mcap", info=INFO, channels=CHANNELS) as writer:
        writer.abandon()
    assert [each.name for each in tmp_path.iterdir()] == ["run.mcap"]


def write_both(table: Path, chart: Path, *, over: int) -> None:
    with whole_files(table, None, chart) as parts:
        for place in parts:
            if place is not None:
                place.write_text("new")
        assert not chart.exists()
        assert 1 / over


def test_files_of_one_command_take_their_names_together(tmp_path: Path) -> None:
    table, chart = tmp_path / "table.csv", tmp_path / "chart.png"
    table.write_text("old")
    with pytest.raises(ZeroDivisionError):
        write_both(table, chart, over=0)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("table.csv", "old")]
    write_both(table, chart, over=1)
    assert {path.read_text() for path in (table, chart)} == {"new"}
