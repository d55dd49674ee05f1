"""A file that is being written appears whole under its name, or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from recordings import InputError, check_writable, whole_file


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
    check_writable(None, tmp_path / "fine.csv")
    assert list(tmp_path.iterdir()) == []
    for path in (tmp_path, tmp_path / "missing" / "x.csv", Path("/proc/none")):
        with pytest.raises(InputError):
            check_writable(path)
