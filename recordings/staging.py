"""A folder of results that appears whole or not at all."""

import ctypes
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from recordings.beside import Beside
from recordings.errors import InputError, reason_of

AT_FDCWD, RENAME_EXCHANGE = -100, 2
"""Of Linux's renameat2: paths as they are, and both names stay, with what they name exchanged."""


@contextmanager
def staged_folder(
    out: Path, *, results: Sequence[str] = (), overwrite: bool = False, recovers: bool = False
) -> Iterator[Path]:
    """A place for a folder of results that takes the name `out` if the block ends well, and vanishes if it does not.

    Parameters
    ----------
    out
        The folder; it and its parents are made at the end.  What else is in it stays.
    results
        Patterns of the names that results have.
    overwrite
        Whether results that are there may be replaced, all of them at once.
    recovers
        Whether what a killed program leaves is worth having, such as a recording; then it is made in its own place
        where there is nothing to be replaced.

    Raises
    ------
    InputError
        If `out` is a file, holds results already, or cannot be written; at the start wherever that can be known.
    """
    if out.exists() and not out.is_dir():
        raise InputError(out, "", "is not a folder", "name another --out")
    old = _there(out, results)
    if old and not overwrite:
        raise InputError(out, "", f"is not empty: it holds {old[0].name}", "give another --out, or --overwrite")
    if recovers and not old:
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _refusal(out, error) from error
        Beside(out.absolute()).sweep()
        yield out
        return
    top = out.absolute()
    while not top.parent.is_dir():
        top = top.parent
        if top.exists():
            raise InputError(out, "", f"cannot be written: {top} is not a folder", "name another --out")
    beside = Beside(top)
    try:
        try:
            part = beside.make()
            folder = part / out.absolute().relative_to(top)
            folder.mkdir(parents=True)
        except OSError as error:
            raise _refusal(out, error) from error
        yield folder
        if not any(folder.iterdir()):
            return
        try:
            if not out.exists():
                part.rename(top)
            elif len(old) == len(list(out.iterdir())) and not Path.cwd().is_relative_to(out.absolute()):
                _exchange(part, out)
            else:  # somebody's own files, or somebody, are in it
                for file in _there(out, results):
                    if not (folder / file.name).exists():
                        shutil.rmtree(file) if file.is_dir() else file.unlink()
                for file in sorted(folder.iterdir()):
                    if file.is_dir() and (out / file.name).exists():
                        shutil.rmtree(out / file.name)
                    file.replace(out / file.name)
        except OSError as error:
            raise _refusal(out, error) from error
    finally:
        beside.remove()


def _there(out: Path, results: Sequence[str]) -> list[Path]:
    return sorted({file for pattern in results for file in out.glob(pattern)}) if out.is_dir() else []


def _exchange(one: Path, other: Path) -> None:
    """Exchange what two names stand for, at once."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.renameat2(AT_FDCWD, os.fsencode(one), AT_FDCWD, os.fsencode(other), RENAME_EXCHANGE):
        error = ctypes.get_errno()
        raise OSError(error, os.strerror(error))


def _refusal(out: Path, error: OSError) -> InputError:
    return InputError(out, "", f"cannot be written: {reason_of(error)}", "name another --out")
