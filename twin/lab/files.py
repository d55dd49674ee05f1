"""Files: which are tables."""

from collections.abc import Sequence
from pathlib import Path

from recordings import InputError


def are_tables(paths: Sequence[Path]) -> bool:
    """Whether all of these files are tables.

    Raises
    ------
    InputError
        If one is not there, or is a folder; if tables and recordings are mixed.
    """
    for path in paths:
        if path.is_dir():
            raise InputError(path, "", "is a folder", "give the recordings (.mcap) or tables (.csv) in it")
        if not path.exists():
            raise InputError(path, "", "there is no such file")
    tables = [path.suffix.lower() == ".csv" for path in paths]
    if any(tables) and not all(tables):
        odd = paths[tables.index(not tables[0])]
        raise InputError(
            odd, "", f"stands beside {paths[0]}: tables and recordings cannot be diagnosed together", "give either"
        )
    return bool(tables) and all(tables)
