"""Kernels are compiled where neither installation nor home can be written, and never from a stranger's files."""

from __future__ import annotations

import os
import re
import stat
import sys
import tempfile
from pathlib import Path

import pytest

from twin import kernel_cache


@pytest.fixture
def nowhere(tmp_path, monkeypatch):
    """An environment and a home that take no files: both lie beneath a file.  Where temporary files go is left."""
    blocked, temporary = tmp_path / "file", tmp_path / "tmp"
    blocked.touch()
    temporary.mkdir()
    monkeypatch.setattr(sys, "prefix", str(blocked))
    monkeypatch.setenv("XDG_CACHE_HOME", str(blocked))
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    return temporary


def test_an_environment_keeps_its_own_cache_and_no_kernel_lies_beside_the_package(nowhere, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "venv"))
    kernel_cache.find_cache_place()
    place = Path(os.environ["NUMBA_CACHE_DIR"])
    assert place.is_relative_to(tmp_path / "venv")
    assert "site-packages" not in place.parts


def test_a_system_wide_python_keeps_kernels_in_the_users_cache(nowhere, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "prefix", sys.base_prefix)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    kernel_cache.find_cache_place()
    assert Path(os.environ["NUMBA_CACHE_DIR"]).is_relative_to(tmp_path / "cache")


def test_nothing_writable_leaves_a_private_folder_that_every_process_finds_again(nowhere, monkeypatch):
    kernel_cache.find_cache_place()
    first = Path(os.environ["NUMBA_CACHE_DIR"])
    assert first.parent == nowhere
    assert stat.S_IMODE(first.stat().st_mode) == 0o700
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    kernel_cache.find_cache_place()
    assert Path(os.environ["NUMBA_CACHE_DIR"]) == first


def test_a_folder_that_others_may_write_is_not_used(nowhere, monkeypatch):
    kernel_cache.find_cache_place()
    open_to_all = Path(os.environ["NUMBA_CACHE_DIR"])
    open_to_all.chmod(0o777)
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    kernel_cache.find_cache_place()
    assert Path(os.environ["NUMBA_CACHE_DIR"]) != open_to_all


def test_a_place_that_is_set_is_kept(nowhere, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/mine")
    kernel_cache.find_cache_place()
    assert os.environ["NUMBA_CACHE_DIR"] == "/mine"


@pytest.mark.parametrize("sources", kernel_cache.CALLED_ELSEWHERE)
def test_another_kernel_is_another_place_for_all_that_may_call_it(sources, tmp_path):
    states = {kernel_cache.state_of_sources(tmp_path)}
    kernel = tmp_path / sources.replace("*", "kernel")
    kernel.parent.mkdir(parents=True)
    for text in ("stiffness = 1.0", "stiffness = 2.0"):
        kernel.write_text(text)
        states.add(kernel_cache.state_of_sources(tmp_path))
    assert len(states) == 3


def test_other_kernels_are_called_in_their_own_file_alone():
    """numba notices their change only there."""
    package = Path(kernel_cache.__file__).parent
    counted = {path for sources in kernel_cache.CALLED_ELSEWHERE for path in package.glob(sources)}
    decorated = re.compile(r"^@.*(?:COMPILED|INNER|BORROWING|njit).*\ndef (\w+)", re.MULTILINE)
    sources = {path: path.read_text() for path in package.rglob("*.py")}
    kernels = {path: names for path, text in sources.items() if (names := decorated.findall(text))}
    others = [(path, name) for path in kernels.keys() - counted for name in kernels[path]]
    assert others
    for own, name in others:
        assert [path for path in kernels if re.search(rf"\b{name}\(", sources[path])] == [own]
