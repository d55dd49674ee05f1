"""An .rrd file written under a temporary name, whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rerun as rr

from recordings.errors import InputError

__all__ = ["APPLICATION", "recording_file"]

APPLICATION = "twin"
"""What the viewer calls all of this project's recordings."""


@contextmanager
def recording_file(path: Path) -> Iterator[rr.RecordingStream]:
    """A recording that becomes `path` when the block ends without an error.

    Raises
    ------
    InputError
        If `path` cannot be written.
    """
    partial = path.with_name(f".{path.name}.part")
    recording = rr.RecordingStream(APPLICATION, send_properties=False)
    try:
        # Asked beforehand: the library's own message says neither which file nor why.
        with partial.open("wb"):
            pass
        recording.save(partial)
        yield recording
        # In this order, or the file has no footer.
        recording.flush()
        recording.disconnect()
        partial.replace(path)
    except OSError as error:
        raise InputError(path, "", f"cannot be written: {(error.strerror or str(error)).lower()}") from error
    finally:
        recording.disconnect()
        partial.unlink(missing_ok=True)
