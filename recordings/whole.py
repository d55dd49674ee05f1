"""Files that appear whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from recordings.errors import InputError

__all__ = ["check_writable", "made_folder", "whole_file"]


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A hidden name beside `path` to write to, with its suffix; renamed if the block ends well, else removed.

    Raises
    ------
    InputError
        In place of an operating system's error in the block: `path` cannot be written, and why.
    """
    part = _part(path)
    try:
        yield part
        part.replace(path)
    except OSError as error:
        raise _refused(path, error) from error
    finally:
        part.unlink(missing_ok=True)


def check_writable(*paths: Path | None) -> None:
    """Refuse, before a long computation, what :func:`whole_file` could not write after it.

    Raises
    ------
    InputError
        If a path is a folder, or cannot be written.
    """
    for path in paths:
        if path is None:
            continue
        if path.is_dir():
            raise InputError(path, "", "is a folder", "name a file")
        if not path.absolute().parent.is_dir():
            raise InputError(path, "", "its folder does not exist")
        part = _part(path)
        try:
            part.touch()
        except OSError as error:
            raise _refused(path, error) from error
        part.unlink()


def made_folder(path: str | Path) -> Path:
    """A folder, made with its parents if it is not there.

    Raises
    ------
    InputError
        If it cannot be made.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(folder, "", (error.strerror or str(error)).lower()) from error
    return folder


def _refused(path: Path, error: OSError) -> InputError:
    return InputError(path, "", f"cannot be written: {(error.strerror or str(error)).lower()}")


def _part(path: Path) -> Path:
    return path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
