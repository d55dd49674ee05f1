"""The figure that all pictures are drawn on, and what they have in common: axes, legends, bands."""

import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, FuncFormatter, LogLocator, MaxNLocator

from recordings.errors import printable
from twin.arrays import Array

WIDTH_IN = 9.0


class Drawing(Figure):
    """A figure that a notebook shows by itself: :mod:`matplotlib.pyplot` need not be imported, nor a backend chosen.

    Names in it are text as it stands, whoever wrote them: no formula between dollars, no character without a picture.
    """

    def draw(self, renderer: Any) -> None:
        """Draw it; of all texts only the numbers at ticks are matplotlib's own, powers of ten among them."""
        ticks = {
            label
            for axes in self.axes
            for axis in (axes.xaxis, axes.yaxis)
            if not isinstance(axis.get_major_formatter(), FixedFormatter | FuncFormatter)
            for label in axis.get_ticklabels(which="both")
        }
        for text in self.findobj(Text):
            if text not in ticks:
                text.set_parse_math(False)
                text.set_text(printable(text.get_text()))
        super().draw(renderer)

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=100, facecolor="white")
        return buffer.getvalue()


def panels(rows: int, columns: int, *, height_in: float, **options: Any) -> tuple[Figure, Array]:
    """A figure as wide as a report, and its axes (rows, columns); `options` as for matplotlib's ``subplots``."""
    figure = Drawing(figsize=(WIDTH_IN, height_in), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


def dressed(axes: Axes, **labels: Any) -> None:
    """Give axes their labels, as matplotlib's ``set`` takes them, and then the look that all figures share."""
    axes.set(**labels)
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=9)
    axes.title.set_fontsize(10)
    axes.minorticks_off()
    if axes.get_xscale() == "linear":
        axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))


def draw_band(axes: Axes, x: Array, value: Array, std: Array, *, colour: str, **style: Any) -> None:
    """A curve with one standard deviation to either side."""
    axes.fill_between(x, value - std, value + std, color=colour, alpha=0.22, linewidth=0)
    axes.plot(x, value, color=colour, **style)


def log_ticks(axis: Axis) -> None:
    """Round numbers along a logarithmic axis, which powers of ten alone may leave bare."""
    low, high = axis.get_view_interval()
    if high > 3000 * low:
        axis.set_major_locator(LogLocator(numticks=6))
    else:
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)) if high > 20 * low else MaxNLocator(4))
        axis.set_major_formatter("{x:g}")


def heat_map(
    axes: Axes, shares: Array, texts: Array, *, rows: Sequence[str], columns: Sequence[str], rotation: int = 0
) -> None:
    """Shares of one (r, c) as colours, each cell with its text; what is NaN stays white."""
    if shares.size:
        axes.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for (i, j), text in np.ndenumerate(texts):
        if text:
            colour = "white" if shares[i, j] > 0.5 else "black"
            axes.text(j, i, str(text), ha="center", va="center", fontsize=8, color=colour)
    axes.set_xticks(range(len(columns)), columns, rotation=rotation, fontsize=8)
    axes.set_yticks(range(len(rows)), rows, fontsize=8)
    axes.tick_params(length=0)


def legend(figure: Figure, entries: Sequence[Any] = (), *, columns: int = 7) -> None:
    """One legend for all axes, above them: what is labelled in them, each label once, and further entries."""
    labelled = [handle for axes in figure.axes for handle in axes.get_legend_handles_labels()[0]]
    once: dict[str, Any] = {}
    for handle in [*labelled, *entries]:
        once.setdefault(str(handle.get_label()), handle)
    figure.legend(
        handles=list(once.values()), loc="outside upper center", ncols=min(columns, len(once)), frameon=False,
        fontsize=9,
    )  # fmt: skip


def entry(label: str, colour: str, **style: Any) -> Line2D:
    """An entry of a legend that is no curve's own."""
    return Line2D([], [], color=colour, label=label, **style)
