"""How much of each channel's range is used: now, and at most so far."""

from collections.abc import Sequence

import numpy as np
import rerun as rr

from recordings.run import Channel, SampleBlock
from twin.views.rerun.chart import Axis, Chart
from twin.views.style import INK

LOWEST, HIGHEST = 0.01, 100.0
"""Ends of the axis, %."""
GOOD, HIGH, OVER = "#009e73", "#e69f00", "#d55e00"


class RangeUse:
    """A bar for each channel that has a range."""

    def __init__(self, recording: rr.RecordingStream, channels: Sequence[Channel]) -> None:
        self._range = {channel.name: channel.range for channel in channels if channel.range}
        self._now = dict.fromkeys(self._range, 0.0)
        self._most = dict.fromkeys(self._range, 0.0)
        self.chart = Chart(
            recording,
            "/ranges",
            "Use of the channels' ranges: now, at most so far",
            Axis("largest sample, % of the converter's range", (LOWEST, HIGHEST), log=True),
            Axis("", (0.0, float(max(len(self._range), 1))), bare=True),
            growing=True,
            text=1.5,
            legend_rows=0,
        )

    def take(self, block: SampleBlock) -> None:
        """Note the largest sample of each channel."""
        for name, values in block.samples.items():
            limit = self._range.get(name)
            if limit and len(values):
                largest = float(np.abs(values).max())
                if largest == largest:  # a block that was lost whole is NaN and tells nothing
                    self._now[name] = max(self._now[name], 100 * largest / limit)
                    self._most[name] = max(self._most[name], self._now[name])

    def draw(self) -> None:
        """Draw what was noted since the last drawing."""
        for i, name in enumerate(self._range):
            now, most = self._now[name], self._most[name]
            height = len(self._range) - i - 0.62
            for what, percent, width in (("now", now, 14.0), ("most", most, 3.0)):
                right = min(max(percent, LOWEST), HIGHEST)
                bar = np.array([LOWEST, right]), np.full(2, height)
                self.chart.line(f"{name}/{what}", *bar, _colour(percent), width=width, legend=False)
            self.chart.label(f"{name}/text", LOWEST, height + 0.5, f"{name}: {now:.3g} %, {most:.3g} %", INK)
            self._now[name] = 0.7 * now  # the eye follows a bar's fall no faster


def _colour(percent: float) -> str:
    return GOOD if percent < 50.0 else HIGH if percent < 95.0 else OVER
