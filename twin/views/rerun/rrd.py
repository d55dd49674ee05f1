"""What all recordings for rerun share: a file that is whole or not there, the layout, lines of text."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TextLogColumn, TimelineColumn

from recordings.errors import printable
from recordings.whole import whole_file
from twin.arrays import Array
from twin.views.style import on_dark

APPLICATION = "twin"
"""What the viewer calls all of this project's recordings."""
EVENTS, TIME = "/events", "time"


@contextmanager
def recording_file(path: Path) -> Iterator[rr.RecordingStream]:
    """A recording that becomes `path` when the block ends without an error; InputError if `path` cannot be written."""
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


def entity(path: str) -> str:
    """The entity of a path whose parts are names as strangers have them."""
    return "/" + "/".join(rr.escape_entity_path_part(part) for part in path.split("/") if part)


def log_series(recording: rr.RecordingStream, path: str, label: str, colour: str) -> None:
    """Say how a signal is drawn: by its extremes, not by averages."""
    style = rr.SeriesLines(colors=[on_dark(colour)], names=label, widths=1, aggregation_policy="MinMax")
    recording.log(path, style, static=True)


def log_samples(recording: rr.RecordingStream, path: str, time_ns: Array, values: Array) -> None:
    """Samples of a signal at times since the recording's beginning."""
    times = rr.TimeColumn(TIME, duration=time_ns.astype("timedelta64[ns]"))
    recording.send_columns(path, [times], rr.Scalars.columns(scalars=values))


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


def log_line(recording: rr.RecordingStream, seconds: float, text: str, level: rr.TextLogLevel) -> None:
    """One line, at the recording's present time, which it also tells: the viewer's own column is too narrow for it."""
    recording.log(EVENTS, rr.TextLog(f"{seconds:.1f} s  {printable(text)}", level=level))


def log_view(timeline: str) -> rrb.TextLogView:
    """The pane of all lines."""
    columns = rrb.TextLogColumns(
        timeline_columns=[TimelineColumn(timeline, visible=False)],
        text_log_columns=[TextLogColumn("LogLevel"), TextLogColumn("Body")],
    )
    return rrb.TextLogView(origin=EVENTS, name="Steps and events", columns=columns)
