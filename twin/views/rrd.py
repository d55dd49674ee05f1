"""An .rrd file written under a temporary name, whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rerun as rr

from recordings.whole import whole_file

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
    recording = rr.RecordingStream(APPLICATION, send_properties=False)
    with whole_file(path) as part:
        try:
            # Asked beforehand: the library's own message says neither which file nor why.
            with part.open("wb"):
                pass
            recording.save(part)
            yield recording
            # In this order, or the file has no footer.
            recording.flush()
        finally:
            recording.disconnect()
