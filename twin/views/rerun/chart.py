"""A chart in a spatial view of rerun: frame, ticks, labels with units, legend, curves.

A plot of rerun has time on its horizontal axis; curves over frequency or amplitude are drawn in two dimensions instead,
with axes of our own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from recordings.errors import printable
from twin.arrays import Array
from twin.views.plot import Axis, Plot, PlotCurve
from twin.views.rerun.rrd import entity
from twin.views.style import INK, NOISE, on_dark, tick_text, ticks

WIDTH, HEIGHT = 1000.0, 640.0
"""Of the frame, unless a chart asks for another width."""
FRAME, GRID, TEXT = (130, 136, 145), (44, 48, 54), (225, 228, 232)
PAPER = (13, 16, 17)
"""Dark as the viewer: its labels come on dark chips, which a light ground would show."""
SAMPLES = {"": "", "line": "—", "dashed": "- -", "point": "●"}
DASH = 14.0
"""Length of a dash and of the gap after it, in the chart's units."""


@dataclass
class Chart:
    """One chart under one entity of a recording."""

    recording: rr.RecordingStream
    path: str
    """Entity under which everything of the chart lies."""
    title: str
    x: Axis
    y: Axis
    """Its axes; the vertical one may do without a label."""
    width: float = WIDTH
    """Of the frame, beside its height of 640: of a chart for a pane that is wide."""
    text: float = 1.0
    """Size of the text beside that of the frame: more than 1 in small panes, since text is as large in any."""
    growing: bool = False
    """Drawn anew, under the same entity, as data come: what is drawn holds from the recording's present time on."""
    legend_rows: int | None = None
    """Room for the legend, in rows; as it turns out if left out."""
    _legend: list[tuple[str, str]] = field(default_factory=list)

    @property
    def _rows(self) -> int:
        if self.legend_rows is not None:
            return self.legend_rows
        return -(-len(self._legend) // 5)

    def __post_init__(self) -> None:
        self._draw_frame()

    def view(self) -> rrb.Spatial2DView:
        """The view that shows it, framed."""
        bounds = rrb.VisualBounds2D(
            x_range=[-150 * self.text, self.width + 40],
            y_range=[-HEIGHT - (104 + 46 * self._rows) * self.text, 116 * self.text],
        )
        return rrb.Spatial2DView(
            origin=entity(self.path), name=printable(self.title), background=list(PAPER), visual_bounds=bounds
        )

    def draw(self, curve: PlotCurve) -> None:
        """A curve, broken where it is NaN, or markers; its `name` is the entity's, whether the legend has it or not."""
        colours = [on_dark(curve.colour)]
        if curve.kind == "point":
            at = self._place(curve.x, curve.y)
            drawn = list(at[np.isfinite(at).all(axis=1)])
            shape: Any = rr.Points2D(drawn, colors=colours, radii=rr.Radius.ui_points(curve.size), draw_order=40)
        else:
            drawn = self._strips(curve.x, curve.y)
            if curve.kind == "dashed":
                drawn = [dash for strip in drawn for dash in _dashes(strip)]
            shape = rr.LineStrips2D(drawn, colors=colours, radii=rr.Radius.ui_points(curve.size / 2))
        if drawn:
            self._log(curve.name, shape)
            if curve.legend:
                self.tell(curve.name, curve.colour, curve.kind)

    def label(self, name: str, x: float, y: float, text: str, colour: str) -> None:
        """Text that begins about at a place; labels are centred, so the longer the farther to the right."""
        at = self._place(np.array([x]), np.array([y]))[0]
        self._log(name, _text([[at[0] + max(90, 9 * len(text)) * self.text, at[1]]], [text], on_dark(colour)))

    def move(
        self, name: str, curves: Sequence[tuple[Array, Array]], colours: Sequence[tuple[int, int, int]], *, width: float
    ) -> None:
        """Curves that are there at the recording's present time; each has its colour, as it is shown."""
        strips = [strip for x, y in curves for strip in self._strips(x, y)]
        moving = rr.LineStrips2D(strips, colors=list(colours), radii=rr.Radius.ui_points(width / 2))
        self.recording.log(self._entity(name), moving)

    def tell(self, text: str, colour: str, kind: str = "") -> None:
        """An entry of the legend, once; `kind` is ``line``, ``dashed``, ``point`` or nothing."""
        entry = (f"{SAMPLES[kind]} {text}".strip(), colour)
        if entry not in self._legend:
            self._legend.append(entry)

    def close(self) -> rrb.Spatial2DView:
        """Draw the legend above the frame, and give the view of it all.

        Names are in their curves' colours, since labels keep their size at any zoom.
        """
        columns = -(-len(self._legend) // max(self._rows, 1))
        for i, (text, colour) in enumerate(self._legend):
            at = [
                (i % columns + 0.5) * self.width / columns,
                -HEIGHT - (84 + 46 * (self._rows - 1 - i // columns)) * self.text,
            ]
            self._log(f"legend/{i}", _text([at], [text], on_dark(colour)))
        return self.view()

    def _log(self, name: str, what: Any) -> None:
        self.recording.log(self._entity(name), what, static=not self.growing)

    def _entity(self, name: str) -> list[object]:
        return [part for part in f"{self.path}/{name}".split("/") if part]

    def _place(self, x: Array, y: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            across = self.x.share(x) * self.width
            up = self.y.share(y) * HEIGHT
        up = np.where((up < -0.01 * HEIGHT) | (up > 1.01 * HEIGHT), np.nan, up)
        return np.stack([across, -up], axis=-1)

    def _strips(self, x: Array, y: Array) -> list[Array]:
        at = self._place(np.asarray(x, float), np.asarray(y, float))
        sound = np.asarray(np.isfinite(at).all(axis=1))
        cuts = np.flatnonzero(np.diff(sound.astype(int))) + 1
        parts = np.split(np.arange(len(at)), cuts)
        return [at[part] for part in parts if len(part) > 1 and sound[part[0]]]

    def _draw_frame(self) -> None:
        xs = ticks(*self.x.ends, log=self.x.log)
        ys = [] if self.y.bare else ticks(*self.y.ends, log=self.y.log, most=6)
        at_x = self._place(np.array(xs), np.full(len(xs), self.y.ends[0]))[:, 0]
        at_y = self._place(np.full(len(ys), self.x.ends[0]), np.array(ys))[:, 1]
        grid: Any = [[[x, 0], [x, -HEIGHT]] for x in at_x] + [[[0, y], [self.width, y]] for y in at_y]
        frame: Any = [[[0, 0], [self.width, 0], [self.width, -HEIGHT], [0, -HEIGHT], [0, 0]]]
        if grid:
            self._log("axes/grid", rr.LineStrips2D(grid, colors=[GRID], radii=rr.Radius.ui_points(0.5), draw_order=-2))
        self._log("axes/frame", rr.LineStrips2D(frame, colors=[FRAME], radii=rr.Radius.ui_points(0.75), draw_order=-1))
        if xs:
            self._log("axes/x", _text([[x, 4] for x in at_x], [tick_text(value) for value in xs]))
        if ys:
            self._log(
                "axes/y",
                _text([[-38 * self.text, y - 12 * self.text] for y in at_y], [tick_text(value) for value in ys]),
            )
        self._log("axes/x_label", _text([[self.width / 2, 48 * self.text]], [self.x.label]))
        if self.y.label:
            self._log(
                "axes/y_label",
                _text([[max(90, 9 * len(self.y.label) - 150) * self.text, -HEIGHT - 44 * self.text]], [self.y.label]),
            )


def draw_chart(recording: rr.RecordingStream, path: str, plot: Plot, **options: Any) -> rrb.Spatial2DView:
    """A plot as a chart, with thin lines at one standard deviation; `options` are the :class:`Chart`'s."""
    chart = Chart(recording, path, plot.title, plot.x, plot.y, **options)
    for curve in plot.curves:
        chart.draw(curve)
        if curve.std is not None:
            for what, end in (("upper", curve.y + curve.std), ("lower", curve.y - curve.std)):
                chart.draw(PlotCurve(f"{curve.name}/{what}", curve.x, end, curve.colour, size=0.8))
            chart.tell("thin: one standard deviation", INK, "line")
    for i, place in enumerate(end for ends in plot.unmeasured for end in ends if end not in plot.x.ends):
        chart.draw(PlotCurve(f"reach/{i}", np.full(2, place), np.array(plot.y.ends), NOISE, "dashed", 1.0))
        chart.tell("how far data reach", NOISE, "dashed")
    for entry in plot.told:
        chart.tell(*entry)
    return chart.close()


def _text(at: list[list[float]], texts: list[str], colour: tuple[int, int, int] = TEXT) -> Any:
    """Labels hung on points too small to see."""
    labels, radii = [printable(text) for text in texts], rr.Radius.ui_points(0.01)
    return rr.Points2D(at, labels=labels, show_labels=True, colors=[colour], radii=radii, draw_order=50)


def _dashes(strip: Array) -> list[Array]:
    """Pieces of a polyline, one `DASH` long, one `DASH` apart."""
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(strip, axis=0).T))])
    starts = np.arange(0.0, length[-1], 2 * DASH)
    out = []
    for start in starts:
        inside = length[(length > start) & (length < start + DASH)]
        at = np.concatenate([[start], inside, [min(start + DASH, length[-1])]])
        out.append(np.stack([np.interp(at, length, strip[:, 0]), np.interp(at, length, strip[:, 1])], axis=1))
    return out
