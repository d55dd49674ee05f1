"""A recording's file: a new name is there once its beginning is whole, an old one is replaced when all is."""

import contextlib
import os
from pathlib import Path
from typing import BinaryIO

from recordings.beside import Beside


class Opening:
    """A new file in a hidden place beside its own, until :meth:`place` gives it its name.

    What it is to replace stays until :meth:`finish`.  A device or a pipe cannot be made anew, and is opened as it is.

    Parameters
    ----------
    path
        The name it is to have.
    overwrite
        Whether a file of that name may be replaced.

    Examples
    --------
    Making one does nothing yet, so that whatever interrupts the rest can be met::

        opening = Opening(path, overwrite=False)
        try:
            opening.start()
            opening.stream.write(b"...")
            opening.place()
        except BaseException:
            opening.abandon()
            raise
        opening.stream.close()
        opening.finish()
    """

    def __init__(self, path: Path, *, overwrite: bool) -> None:
        self._wanted, self._overwrite = path, overwrite
        self._path = path.resolve()  # a link to a file stays a link
        self._beside = Beside(self._path)
        self._part: Path | None = None
        self._stream: BinaryIO | None = None
        self._made: os.stat_result | None = None

    def start(self) -> None:
        """Make the file.

        Raises
        ------
        FileExistsError
            If there is a file of the name and it may not be replaced.
        OSError
            If the file cannot be made.
        """
        if not self._overwrite and (self._path.exists() or self._wanted.is_symlink()):
            raise FileExistsError(self._path)
        if self._path.exists() and not self._path.is_file():
            self._stream = self._path.open("wb")
        else:
            self._part = self._beside.make()
            self._stream = self._part.open("xb")
            self._made = os.fstat(self._stream.fileno())

    @property
    def stream(self) -> BinaryIO:
        """Where to write; open until it is closed or abandoned."""
        assert self._stream is not None
        return self._stream

    @property
    def replaces(self) -> bool:
        """Whether an old file of the name stands until the new one is whole."""
        return self._part is not None and self._overwrite and self._path.exists()

    def place(self) -> None:
        """Give the file its name, at once, unless it replaces another.

        Raises
        ------
        FileExistsError
            If somebody else has made a file of that name meanwhile and it may not be replaced.
        OSError
            If it cannot be done.
        """
        if self._part is None or self.replaces:
            return
        try:
            os.link(self._part, self._path)  # unlike a renaming it never replaces what is there
        except FileExistsError:
            raise
        except OSError as error:  # a file system without hard links
            if self._path.exists():
                raise FileExistsError(self._path) from error
            self._part.replace(self._path)
        self._part = None
        self._beside.remove()

    def finish(self) -> None:
        """The file is whole and closed: it takes the place of what it replaces.

        Raises
        ------
        OSError
            If it cannot be done.
        """
        if self._part is not None:
            self._part.replace(self._path)
            self._part = None
        self._beside.remove()

    def abandon(self) -> None:
        """Close the file and remove it, whichever name it has by now; what it was to replace stays."""
        if self._stream is not None:
            with contextlib.suppress(OSError):  # a full disk refuses the rest once more
                self._stream.close()
        self._beside.remove()
        with contextlib.suppress(FileNotFoundError):
            if self._made is not None and os.path.samestat(self._path.stat(), self._made):
                self._path.unlink()
