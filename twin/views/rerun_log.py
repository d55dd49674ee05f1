"""Steps and events as lines of text on the time line."""

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TextLogColumn, TimelineColumn

EVENTS = "/events"


def log_line(recording: rr.RecordingStream, seconds: float, text: str, level: rr.TextLogLevel) -> None:
    """One line, at the recording's present time, which it also tells: the viewer's own column is too narrow for it."""
    recording.log(EVENTS, rr.TextLog(f"{seconds:.1f} s  {text}", level=level))


def log_view(timeline: str) -> rrb.TextLogView:
    """The pane of all lines."""
    columns = rrb.TextLogColumns(
        timeline_columns=[TimelineColumn(timeline, visible=False)],
        text_log_columns=[TextLogColumn("LogLevel"), TextLogColumn("Body")],
    )
    return rrb.TextLogView(origin=EVENTS, name="Steps and events", columns=columns)
