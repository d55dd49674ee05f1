"""A private place beside a file or folder, where the new one is made before it takes the name of the old one."""

import contextlib
import fcntl
import glob
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

SUFFIX = ".part"
NAME_LENGTH = 64
"""Of the name it is for; the whole must not pass the 255 bytes that file systems allow."""

_passing: set[Path] = set()
"""Folders of this process in which something is made that will take a name beside them."""


class Beside:
    """A folder that nobody else can guess, read or plant a link in, on the same file system as `path`.

    It is locked while its maker lives.  What a killed program has left of the same name is removed by the next one.

    Parameters
    ----------
    path
        What is to be made.
    stays
        Whether it is used where it is made, and never takes the name.
    """

    def __init__(self, path: Path, *, stays: bool = False) -> None:
        self._path = path
        self._stays = stays
        self._lock = -1
        self._folder: Path | None = None

    def make(self) -> Path:
        """Make it; the place in it has the name of `path`, and nothing is there yet.

        Raises
        ------
        OSError
            If the folder of `path` cannot be written.
        """
        self.sweep()
        prefix = f".{self._path.name[:NAME_LENGTH]}."
        while self._lock < 0:
            self._folder = Path(tempfile.mkdtemp(prefix=prefix, suffix=SUFFIX, dir=self._path.parent))
            with contextlib.suppress(FileNotFoundError, BlockingIOError):  # another took it for a dead one's
                self._lock = _lock(self._folder)
        assert self._folder is not None
        if not self._stays:
            _passing.add(self._folder.resolve())
        return self._folder / self._path.name

    def sweep(self) -> None:
        """Remove what killed programs have left beside `path`."""
        for left in self._path.parent.glob(f".{glob.escape(self._path.name[:NAME_LENGTH])}.*{SUFFIX}"):
            with contextlib.suppress(OSError):
                os.close(_lock(left))  # nobody holds it: its maker has died
                shutil.rmtree(left)

    def remove(self) -> None:
        """Remove it with what is still in it; doing it twice does no harm."""
        if self._folder is not None:
            _passing.discard(self._folder.resolve())
            shutil.rmtree(self._folder, ignore_errors=True)
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1


def settled(path: Path) -> Path:
    """Where a file or folder will be once it, or a folder about it, has taken its name: itself if nothing is due."""
    path = path.resolve()
    for folder in [*path.parents]:
        if folder in _passing:
            path = folder.parent / path.relative_to(folder)
    return path


@contextmanager
def temporary_folder(name: str) -> Iterator[Path]:
    """A private folder among the system's temporary ones; what a killed program has left of the name is removed."""
    beside = Beside(Path(tempfile.gettempdir()) / name, stays=True)
    try:
        folder = beside.make()
        folder.mkdir()
        yield folder
    finally:
        beside.remove()


def _lock(folder: Path) -> int:
    """A descriptor that holds the lock of a folder; raises OSError if another does, or it is a link."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor
