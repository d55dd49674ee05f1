"""Files that appear whole or not at all."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from recordings.beside import Beside
from recordings.errors import InputError, reason_of


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A place for a file, in a hidden folder beside `path`; it takes that name if the block ends well.

    Raises
    ------
    InputError
        In place of an operating system's error in the block: `path` cannot be written, and why.
    """
    beside = Beside(path)
    try:
        part = beside.make()
        yield part
        part.replace(path)
    except OSError as error:
        raise _refused(path, error) from error
    finally:
        beside.remove()


@contextmanager
def whole_files(*paths: Path | None) -> Iterator[list[Path | None]]:
    """Places for several files, which take their names together if the block ends well; None for None.

    Raises
    ------
    InputError
        As from :func:`whole_file`.
    """
    with ExitStack() as stack:
        yield [None if path is None else stack.enter_context(whole_file(path)) for path in paths]


def check_writable(*paths: Path | None, overwrite: bool) -> None:
    """Refuse, before a long computation, what :func:`whole_file` could not write after it.

    Raises
    ------
    InputError
        If a path is a folder, cannot be written, or exists and is not to be overwritten.
    """
    for path in paths:
        if path is None:
            continue
        if path.is_dir():
            raise InputError(path, "", "is a folder", "name a file")
        if not path.absolute().parent.is_dir():
            raise InputError(path, "", "its folder does not exist")
        refuse_existing(path, overwrite=overwrite)
        beside = Beside(path)
        try:
            beside.make()
        except OSError as error:
            raise _refused(path, error) from error
        finally:
            beside.remove()


def refuse_existing(path: Path, *, overwrite: bool = False) -> None:
    """Refuse a name that is taken, unless it may be overwritten; raises InputError."""
    if not overwrite and (path.exists() or path.is_symlink()):
        raise InputError(path, "", "exists already", "give another name, or --overwrite")


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
        raise InputError(folder, "", reason_of(error)) from error
    return folder


def _refused(path: Path, error: OSError) -> InputError:
    return InputError(path, "", f"cannot be written: {reason_of(error)}")
