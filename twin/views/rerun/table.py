"""A table of sweeps or of natural frequencies in rerun."""

from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from recordings.quantities import quantity
from recordings.tables import FrequencyTable, SweepTable
from twin.arrays import Array
from twin.views.plot import Plot, PlotCurve
from twin.views.receptance import per_force
from twin.views.rerun.chart import draw_chart
from twin.views.rerun.rrd import recording_file, send_layout
from twin.views.style import MEASURED, level_colour, unit_text
from twin.views.table import Table, markdown_text, table_markdown

WIDE = 2400.0
"""Width of a chart that has a third of a screen's height and most of its width."""


def save_table(table: SweepTable | FrequencyTable, path: Path) -> None:
    """Write `table` as an .rrd that opens arranged; InputError if `path` cannot be written."""
    with recording_file(path) as recording:
        if isinstance(table, SweepTable):
            about, views = _about_sweeps(table), _sweeps(recording, table)
        else:
            about, views = _about_frequencies(table), [_frequencies(recording, table)]
        text = f"# {markdown_text(Path(table.path).name)}\n\n{table_markdown(about)}"
        recording.log("about", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
        layout = rrb.Horizontal(
            rrb.TextDocumentView(origin="/about", name="About this table"), rrb.Vertical(*views), column_shares=[1, 3.2]
        )
        send_layout(recording, layout)


def _sweeps(recording: rr.RecordingStream, table: SweepTable) -> list[rrb.Spatial2DView]:
    """Charts of receptance, response and force against frequency, every level a line."""
    unit = unit_text(quantity(table.quantity).unit)
    with np.errstate(divide="ignore", invalid="ignore"):
        receptance = per_force(table.response / table.force_N, table.quantity, table.frequency_Hz)
    return [
        _chart(recording, table, "receptance", "receptance, mm/N", np.where(table.force_N > 0, receptance, np.nan)),
        _chart(recording, table, "response", f"{table.quantity}, {unit}", table.response),
        _chart(recording, table, "force", "force, N", table.force_N),
    ]


def _chart(recording: rr.RecordingStream, table: SweepTable, name: str, label: str, values: Array) -> Any:
    levels, curves, told = table.sweeps(), [], []
    for i, (level, rows) in enumerate(levels.items()):
        rows = rows[np.isfinite(values[rows])]
        rising = rows[np.argsort(table.frequency_Hz[rows], kind="stable")]
        x, y, colour = table.frequency_Hz[rising], values[rising], level_colour(i)
        curves.append(PlotCurve(f"{level:g}", x, y, colour, size=1.5))
        curves.append(PlotCurve(f"{level:g}/steps", x, y, colour, "point", 3.0))
        told.append((f"level {level:g}", colour, ""))
    if len(levels) > 12:  # more find no room in the legend
        told = []
    plot = Plot.over(f"{name} of every sweep", "frequency, Hz", label, curves, told=told)
    return draw_chart(recording, f"/sweeps/{name}", plot, width=WIDE)


def _frequencies(recording: rr.RecordingStream, table: FrequencyTable) -> Any:
    """Frequency against the mode's number, every preload a colour."""
    states = list(dict.fromkeys(table.preload)) or [""]
    curves = []
    for i, state in enumerate(states):
        rows = np.flatnonzero([s == state for s in table.preload]) if table.preload else np.arange(len(table))
        colour, x = level_colour(i) if len(states) > 1 else MEASURED, table.mode[rows].astype(float)
        curves.append(PlotCurve(state or "measured", x, table.frequency_Hz[rows], colour, "point", 5.0, legend=True))
    return draw_chart(recording, "/frequencies", Plot.over("natural frequencies", "mode", "frequency, Hz", curves))


def _about_sweeps(table: SweepTable) -> Table:
    unit = unit_text(quantity(table.quantity).unit)
    rows = []
    for level, at in table.sweeps().items():
        f = table.frequency_Hz[at]
        force, response = table.force_N[at].max(), table.response[at].max()
        rows.append((f"{level:g}", str(len(at)), f"{f.min():g} to {f.max():g}", f"{force:.4g}", f"{response:.4g}"))
    head = ("level", "steps", "frequency, Hz", "largest force, N", f"largest response, {unit}")
    caption = f"{len(table)} steps of {len(rows)} sweeps."
    return Table(caption=caption, head=head, rows=rows)


def _about_frequencies(table: FrequencyTable) -> Table:
    rows = [
        (str(n), f"{f:g}", "" if np.isnan(std) else f"{std:.2g}", state)
        for n, f, std, state in zip(
            table.mode, table.frequency_Hz, table.std_Hz, table.preload or [""] * len(table), strict=True
        )
    ]
    head = ("mode", "frequency, Hz", "std, Hz", "preload")
    caption = f"{len(table)} natural frequencies."
    return Table(caption=caption, head=head, rows=rows)
