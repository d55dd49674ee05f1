"""An .rrd file written under a temporary name, whole or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from recordings.whole import whole_file

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


def send_layout(recording: rr.RecordingStream, layout: Any, **time: Any) -> None:
    """Arrange a recording's views so, the viewer's own panels out of the way; `time` is for that of time."""
    recording.send_blueprint(
        rrb.Blueprint(
            layout,
            rrb.BlueprintPanel(state="collapsed"),
            rrb.SelectionPanel(state="collapsed"),
            rrb.TimePanel(state="collapsed", **time),
            auto_views=False,
        )
    )
