"""All channels at once: how far each one's range is used, and its frequencies where no sine is stepped."""

import time
from collections import deque
from collections.abc import Sequence

import numpy as np
import rerun as rr

from recordings.run import Channel, SampleBlock
from twin.views.plot import Axis, PlotCurve
from twin.views.rerun.chart import Chart
from twin.views.style import INK, level_colour

LEAST_percent, MOST_percent = 0.01, 100.0
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
            Axis("largest sample, % of the converter's range", (LEAST_percent, MOST_percent), log=True),
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
                right = min(max(percent, LEAST_percent), MOST_percent)
                bar = np.array([LEAST_percent, right]), np.full(2, height)
                self.chart.draw(PlotCurve(f"{name}/{what}", *bar, _colour(percent), size=width))
            self.chart.label(f"{name}/text", LEAST_percent, height + 0.5, f"{name}: {now:.3g} %, {most:.3g} %", INK)
            self._now[name] = 0.7 * now  # the eye follows a bar's fall no faster


def _colour(percent: float) -> str:
    return GOOD if percent < 50.0 else HIGH if percent < 95.0 else OVER


SPAN_S = 1.0
EVERY_S = 0.5
"""Between two drawings, on the wall's clock."""
LOWEST, HIGHEST = 1e-7, 1.0
"""Ends of the vertical axis, as shares of a channel's range."""
LOWEST_Hz, MOST_LINES = 5.0, 600


class LiveSpectrum:
    """Amplitude spectra of all channels that have a range, each as a share of it."""

    def __init__(self, recording: rr.RecordingStream, channels: Sequence[Channel]) -> None:
        self._recording = recording
        self._range = {channel.name: channel.range for channel in channels if channel.range}
        self._blocks: dict[str, deque[SampleBlock]] = {}
        self._drawn_s = -EVERY_S
        self._highest_Hz = 1000.0
        self._draw_frame()

    def take(self, block: SampleBlock) -> None:
        """Keep the samples of the latest second."""
        kept = self._blocks.setdefault(block.device, deque())
        kept.append(block)
        while kept and (block.time_ns - kept[0].time_ns) * 1e-9 > SPAN_S:
            kept.popleft()

    def draw(self) -> None:
        """Draw the spectra, if it is time."""
        if time.monotonic() - self._drawn_s < EVERY_S or not self._blocks:
            return
        self._drawn_s = time.monotonic()
        fastest = max(blocks[-1].sample_rate_Hz for blocks in self._blocks.values())
        if fastest / 2 != self._highest_Hz:
            self._highest_Hz = fastest / 2
            self._draw_frame()
        for blocks in self._blocks.values():
            for name in blocks[-1].samples:
                if name in self._range:
                    self._curve(name, blocks)
        self.chart.close()

    def _draw_frame(self) -> None:
        self.chart = Chart(
            self._recording,
            "/spectrum",
            "Spectrum of the latest second",
            Axis("frequency, Hz", (LOWEST_Hz, self._highest_Hz), log=True),
            Axis("amplitude / range of the channel", (LOWEST, HIGHEST), log=True),
            width=2300.0,
            growing=True,
            legend_rows=1,
        )
        for i, name in enumerate(self._range):
            self.chart.tell(name, level_colour(i), "line")
        self.chart.close()

    def _curve(self, name: str, blocks: Sequence[SampleBlock]) -> None:
        values = np.nan_to_num(np.concatenate([block.samples[name] for block in blocks if name in block.samples]))
        window = np.hanning(len(values))
        lines = 2 * np.abs(np.fft.rfft((values - values.mean()) * window)) / max(window.sum(), 1e-12)
        frequency = np.fft.rfftfreq(len(values), 1 / blocks[-1].sample_rate_Hz)
        x, y = _highest_of_each(frequency, lines / self._range[name])
        self.chart.draw(PlotCurve(name, x, y, level_colour(list(self._range).index(name)), size=1.5))


def _highest_of_each(frequency: np.ndarray, lines: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The highest line of each of many narrow bands, so that no peak is lost where lines lie denser than dots."""
    inside = frequency >= LOWEST_Hz
    frequency, lines = frequency[inside], lines[inside]
    if not len(frequency):
        return frequency, lines
    edges = np.geomspace(LOWEST_Hz, frequency[-1] * 1.001, MOST_LINES)
    starts = np.unique(np.searchsorted(frequency, edges[:-1]))
    starts = starts[starts < len(frequency)]
    return frequency[starts], np.maximum.reduceat(lines, starts)
