"""A folder of results that appears whole or not at all."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from recordings.errors import InputError


@contextmanager
def staged_folder(out: Path) -> Iterator[Path]:
    """A temporary folder whose files move to `out` if the block ends well, and vanish if it does not.

    Files of `out` that have the same names are replaced, others stay.  `out` and its parents are made at the end.

    Raises
    ------
    InputError
        If `out` is a file, or cannot be written; at the start wherever that can be known.
    """
    try:
        if out.exists() and not out.is_dir():
            raise InputError(out, "", "is not a folder", "name another --out")
        # Beside the results on the same file system, so that moving them is renaming.
        ancestor = out.absolute()
        while not ancestor.is_dir():
            if ancestor.exists():
                raise InputError(out, "", f"cannot be written: {ancestor} is not a folder", "name another --out")
            ancestor = ancestor.parent
        part = Path(tempfile.mkdtemp(prefix=".diagnosis-", suffix=".part", dir=ancestor))
    except OSError as error:
        raise _refusal(out, error) from error
    try:
        yield part
        try:
            out.mkdir(parents=True, exist_ok=True)
            for file in sorted(part.iterdir()):
                file.replace(out / file.name)
        except OSError as error:
            raise _refusal(out, error) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _refusal(out: Path, error: OSError) -> InputError:
    return InputError(out, "", f"cannot be written: {(error.strerror or str(error)).lower()}", "name another --out")
