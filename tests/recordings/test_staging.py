"""A folder of results: all of the old one, or all of the new one, and nobody else's files harmed."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from recordings import InputError
from recordings.beside import settled, temporary_folder
from recordings.staging import staged_folder
from recordings.whole import whole_file

RESULTS = ("result.json", "*.toml")


def write(out: Path, *names: str, overwrite: bool = False, recovers: bool = False) -> None:
    with staged_folder(out, results=RESULTS, overwrite=overwrite, recovers=recovers) as folder:
        for name in names:
            (folder / name).write_text("new")


def names(folder: Path) -> list[str]:
    return sorted(each.name for each in folder.iterdir())


def test_it_is_made_with_its_parents(tmp_path: Path) -> None:
    write(tmp_path / "a" / "b", "result.json")
    assert names(tmp_path / "a" / "b") == ["result.json"]
    assert names(tmp_path) == ["a"]


def test_results_that_are_there_are_not_touched_without_overwrite(tmp_path: Path) -> None:
    write(tmp_path / "a", "result.json")
    with pytest.raises(InputError, match=r"not empty: it holds result\.json"):
        write(tmp_path / "a", "result.json")


@pytest.mark.parametrize("others", [(), ("thesis.txt",)])
def test_overwritten_results_are_gone_and_other_files_stay(tmp_path: Path, others: tuple[str, ...]) -> None:
    out = tmp_path / "a"
    write(out, "result.json", "next.toml")
    for name in others:
        (out / name).write_text("mine")
    write(out, "result.json", overwrite=True)
    assert names(out) == sorted(["result.json", *others])
    assert names(tmp_path) == ["a"]


def test_an_error_leaves_everything_as_it_was(tmp_path: Path) -> None:
    out = tmp_path / "a"
    write(out, "result.json")
    with pytest.raises(ZeroDivisionError), staged_folder(out, results=RESULTS, overwrite=True) as folder:
        assert (folder / "next.toml").write_text("new") // 0
    assert names(out) == ["result.json"]
    assert names(tmp_path) == ["a"]


@pytest.mark.parametrize("recovers", [False, True])
def test_a_killed_program_leaves_the_old_one_and_the_next_removes_its_rest(recovers: bool, tmp_path: Path) -> None:
    out = tmp_path / "a"
    write(out, "result.json")
    pid = os.fork()
    if pid == 0:
        with staged_folder(out, results=RESULTS, overwrite=True) as folder:
            (folder / "result.json").write_text("half")
            os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(pid, 0)
    assert (out / "result.json").read_text() == "new"
    assert len(names(tmp_path)) == 2
    if recovers:
        (out / "result.json").unlink()
    write(out, "next.toml", overwrite=True, recovers=recovers)
    assert names(out) == ["next.toml"]
    assert names(tmp_path) == ["a"]


def test_what_is_made_knows_where_it_will_be(tmp_path: Path) -> None:
    with staged_folder(tmp_path / "a" / "b") as folder, whole_file(folder / "model.toml") as part:
        part.touch()
        assert settled(part) == tmp_path.resolve() / "a" / "b" / "model.toml" != part
    assert settled(part) == part.resolve()
    with temporary_folder("stays") as folder:
        assert settled(folder) == folder.resolve()
