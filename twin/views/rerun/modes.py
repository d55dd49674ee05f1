"""A modal test in rerun: its stabilisation chart, Nyquist circles, and the shapes moving over the model's."""

from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from twin.identify.modes.measured_modes import MeasuredModes
from twin.identify.modes.stabilisation import stable_poles
from twin.structure import drawn_parts, drawn_places
from twin.views.modal_figures import measured_motion, nyquist
from twin.views.rerun.chart import ChartCurve, draw_chart
from twin.views.rerun.motion import SLOW_MOTION, animate_parts
from twin.views.rerun.rrd import recording_file, send_layout
from twin.views.style import AFTER, BEFORE, MEASURED, NOISE


def save_modes_view(found: MeasuredModes, path: Path) -> None:
    """Write a modal test as an .rrd file, whole or not at all; InputError if `path` cannot be written."""
    with recording_file(path) as recording:
        tabs = [_stabilisation(recording, found), *_nyquist(recording, found)]
        shapes = _shapes(recording, found)
        layout = rrb.Tabs(*([rrb.Grid(*shapes, name="Shapes")] if shapes else []), *tabs)
        send_layout(recording, layout, timeline=SLOW_MOTION)


def _stabilisation(recording: rr.RecordingStream, found: MeasuredModes) -> rrb.Spatial2DView:
    chart, stable = found.fit.chart, set(stable_poles(found.fit.chart))
    curves = []
    for name, colour, size, poles in (
        ("unstable", NOISE, 2.0, [pole for pole in chart if pole not in stable]),
        ("stable in frequency and damping", AFTER, 3.5, [pole for pole in chart if pole in stable]),
    ):
        f, order = (np.array([getattr(pole, key) for pole in poles]) for key in ("frequency_Hz", "order"))
        curves.append(ChartCurve(name, f, order, colour, "point", size, legend=True))
    top = max((pole.order for pole in chart), default=1)
    curves += [
        ChartCurve(f"mode {number}", np.full(2, mode.frequency_Hz), np.array([0.0, top]), BEFORE, size=1.0)
        for number, mode in enumerate(found.fit.modes, 1)
    ]
    told = [("modes", BEFORE, "line")]
    return draw_chart(
        recording, "/stabilisation", "Stabilisation", "frequency, Hz", "order of the polynomials", curves, told=told
    )


def _nyquist(recording: rr.RecordingStream, found: MeasuredModes) -> list[Any]:
    views = []
    for number, mode in enumerate(found.fit.modes):
        about, shown, curve = nyquist(found, number)
        curves = [
            ChartCurve("fit", curve.real, curve.imag, AFTER, legend=True),
            ChartCurve("measured", about.real, about.imag, MEASURED, "point", 3.0, legend=True),
        ]
        title = f"Mode {number + 1}, {mode.frequency_Hz:.5g} Hz, {found.outputs[shown]}"
        views.append(
            draw_chart(recording, f"/nyquist/{number + 1}", title, "real part", "imaginary part", curves)
        )  # fmt: skip
    return [rrb.Grid(*views, name="Nyquist")] if views else []


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
