"""Which files hold frequency responses, and how each is read."""

from collections.abc import Callable
from pathlib import Path

from recordings.errors import InputError
from recordings.responses.found import Responses
from recordings.responses.tables import has_responses, read_archive, read_csv
from recordings.responses.universal import read_universal

READERS: dict[str, Callable[[Path], Responses]] = {
    **dict.fromkeys((".uff", ".unv"), read_universal),
    ".npz": read_archive,
    ".csv": read_csv,
}


def are_responses(path: Path) -> bool:
    """Whether a file is one of frequency responses, by its suffix and, of a CSV, by its columns."""
    suffix = path.suffix.lower()
    return suffix in READERS and (suffix != ".csv" or has_responses(path))


def read_responses(path: str | Path) -> Responses:
    """Read a file of frequency responses.

    Raises
    ------
    InputError
        With the place, if it cannot be read, is damaged, or holds none and no modes either.
    """
    path = Path(path)
    found = READERS[path.suffix.lower()](path)
    if not found.responses and not found.modes:
        raise InputError(path, "", "holds no frequency response (data set 58, function type 4)", "export these")
    return found
