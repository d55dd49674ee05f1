"""A modal test in rerun: its stabilisation chart, Nyquist circles, and the shapes moving over the model's."""

from pathlib import Path
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from twin.identify.modes.measured_modes import MeasuredModes
from twin.structure import drawn_parts, drawn_places
from twin.views.modal_figures import measured_motion, nyquist_plots, stabilisation_plot
from twin.views.rerun.chart import draw_chart
from twin.views.rerun.motion import SLOW_MOTION, animate_parts
from twin.views.rerun.rrd import recording_file, send_layout


def save_modes_view(found: MeasuredModes, path: Path) -> None:
    """Write a modal test as an .rrd file, whole or not at all; InputError if `path` cannot be written."""
    with recording_file(path) as recording:
        nyquist = [draw_chart(recording, f"/nyquist/{n}", plot) for n, plot in enumerate(nyquist_plots(found), 1)]
        shapes = _shapes(recording, found)
        layout = rrb.Tabs(
            *([rrb.Grid(*shapes, name="Shapes")] if shapes else []),
            draw_chart(recording, "/stabilisation", stabilisation_plot(found)),
            rrb.Grid(*nyquist, name="Nyquist"),
        )
        send_layout(recording, layout, timeline=SLOW_MOTION)


def _shapes(recording: rr.RecordingStream, found: MeasuredModes) -> list[Any]:
    if found.beside is None:
        return []
    beside, views = found.beside, []
    parts = drawn_parts(beside.modelled.structure)
    places = drawn_places(beside.modelled.structure, beside.places, name="measured")
    for number, mode in sorted(beside.pairs.items()):
        moved = [part.rows @ beside.modelled.modes.Phi[:, mode] for part in parts]
        marked = [(places, measured_motion(found, number))]
        title = f"Measured {found.fit.modes[number].frequency_Hz:.5g} Hz, model {mode + 1}"
        views.append(
            animate_parts(recording, f"/shapes/{number + 1}", title, parts, moved, marked=marked)
        )  # fmt: skip
    return views
