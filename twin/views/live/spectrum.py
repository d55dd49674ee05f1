"""What frequencies the latest second holds, where no sine is stepped."""

import time
from collections import deque
from collections.abc import Sequence

import numpy as np
import rerun as rr

from recordings.run import Channel, SampleBlock
from twin.views.rerun.chart import Axis, Chart
from twin.views.style import level_colour

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
        self.chart.line(name, x, y, level_colour(list(self._range).index(name)), width=1.5, legend=False)


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
