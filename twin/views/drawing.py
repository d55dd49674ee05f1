"""The figure that all pictures are drawn on."""

import io
from typing import Any

from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, FuncFormatter

from recordings.errors import printable


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
