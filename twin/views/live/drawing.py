"""What a live view shows: signals, the running sweep over the predicted branches, harmonics, ranges, events."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from recordings.errors import printable
from recordings.run import SampleBlock, Step, StepState
from twin.procedures import StepResult
from twin.views.extremes import extremes
from twin.views.live.about import LiveAbout
from twin.views.live.channels import LiveSpectrum, RangeUse
from twin.views.live.sweeps import HarmonicsChart, SweepChart, stepped
from twin.views.receptance import farthest_response
from twin.views.rerun.rrd import TIME, entity, log_line, log_samples, log_series, log_view, send_layout
from twin.views.style import level_colour, unit_text
from twin.views.table import markdown_text


class LiveDrawing:
    """A run that is drawn into a recording as it goes."""

    def __init__(self, recording: rr.RecordingStream, about: LiveAbout) -> None:
        self._recording, self._about = recording, about
        self._origin_ns: int | None = None
        self._latest_ns = 0
        self._not_shown = 0
        self._where = "starting"
        self._last: StepResult | None = None
        self._samples = 0
        self._next_index: dict[str, int] = {}
        self._at(0)
        self._ranges = RangeUse(recording, about.channels)
        shown = farthest_response(about.channels)
        self._charts: tuple[SweepChart, HarmonicsChart] | None = None
        self._spectrum: LiveSpectrum | None = None
        if shown is not None and stepped(about.procedure):
            self._charts = SweepChart(recording, about, shown), HarmonicsChart(recording, about, shown)
        else:
            self._spectrum = LiveSpectrum(recording, about.channels)
        self._begin()

    def draw(self, items: Sequence[tuple[int, int, Any]]) -> None:
        """Draw what has come: how much was not shown until then, when it was, and itself."""
        blocks: dict[str, list[SampleBlock]] = {}
        for not_shown, time_ns, what in items:
            self._lose(not_shown)
            if isinstance(what, SampleBlock):
                blocks.setdefault(what.device, []).append(what)
                self._pass(what.time_ns)
                self._pass(what.end_ns)
                continue
            self._pass(time_ns)
            if isinstance(what, Step):
                self._step(what)
            elif isinstance(what, StepResult):
                self._result(time_ns, what)
            else:
                self._log(f"{what.source}: {what.kind} {what.detail}".strip(), rr.TextLogLevel.WARN)
        for device, its in blocks.items():
            for joined in _joined(its):
                self._signals(device, joined)
        if items:
            self._at(self._latest_ns)
            self._ranges.draw()
            self._tell()

    def _begin(self) -> None:
        """Lay out the panes, each with something in it from the start."""
        about, recording = self._about, self._recording
        signals: list[Any] = []
        window = rr.TimeRange(
            start=rr.TimeRangeBoundary.cursor_relative(seconds=-about.window_s),
            end=rr.TimeRangeBoundary.cursor_relative(seconds=0.0),
        )
        for i, channel in enumerate(about.channels):
            path, label = entity(f"/signals/{channel.name}"), printable(f"{channel.name}, {unit_text(channel.unit)}")
            log_series(recording, path, label, level_colour(i))
            signals.append(
                rrb.TimeSeriesView(
                    origin=path,
                    name=label,
                    plot_legend=rrb.PlotLegend(visible=False),
                    axis_x=rrb.TimeAxis(view_range=window),
                    time_ranges=rrb.VisibleTimeRange(TIME, range=window),
                )
            )
        self._log("recording begins", rr.TextLogLevel.INFO)
        self._ranges.draw()
        self._tell()
        if self._charts is not None:
            below: list[Any] = [each.chart.view() for each in self._charts]
        else:
            assert self._spectrum is not None
            below = [self._spectrum.chart.view()]
        layout = rrb.Horizontal(
            rrb.Vertical(
                rrb.TextDocumentView(origin="/now", name="Now"),
                self._ranges.chart.view(),
                log_view(TIME),
                row_shares=[2, 1.6, 1.6],
            ),
            rrb.Vertical(rrb.Vertical(*signals), rrb.Horizontal(*below), row_shares=[1, 1.15]),
            column_shares=[1, 3],
        )
        send_layout(recording, layout, timeline=TIME, play_state="following")

    def _signals(self, device: str, blocks: Sequence[SampleBlock]) -> None:
        """Samples of one device without a gap, in one go; after a gap the curve begins anew."""
        assert self._origin_ns is not None
        rate_Hz = blocks[0].sample_rate_Hz
        stretch = math.ceil(2 * rate_Hz * self._about.window_s / 20_000)
        starts = [block.time_ns - self._origin_ns for block in blocks]
        grids = [np.rint(np.arange(len(block)) * (1e9 / rate_Hz)).astype(np.int64) for block in blocks]
        times = np.concatenate([start + grid for start, grid in zip(starts, grids, strict=True)])
        for name in blocks[0].samples:
            values = np.concatenate([block.samples[name] for block in blocks])
            position, drawn = extremes(values, stretch)
            at = times[position]
            if self._next_index.get(device) != blocks[0].first_index:
                at, drawn = np.concatenate([at[:1], at]), np.concatenate([[np.nan], drawn])
            log_samples(self._recording, entity(f"/signals/{name}"), at, drawn)
        self._next_index[device] = blocks[-1].first_index + len(blocks[-1])
        for block in blocks:
            self._samples += len(block)
            self._ranges.take(block)
            if self._spectrum is not None:
                self._spectrum.take(block)
        if self._spectrum is not None:
            self._at(self._latest_ns)
            self._spectrum.draw()

    def _step(self, step: Step) -> None:
        at = f" at {step.frequency_Hz:.6g} Hz" if step.frequency_Hz else ""
        self._where = f"{step.sweep}, step {step.index + 1}{at}: {step.state.name.lower()}"
        if step.state is StepState.DONE:
            self._log(f"{step.sweep} done", rr.TextLogLevel.INFO)
        elif step.state is StepState.ABORTED:
            self._log(f"{step.sweep} broken off", rr.TextLogLevel.ERROR)
        elif step.index == 0 and step.state is StepState.SETTLING:
            self._log(f"{step.sweep} begins", rr.TextLogLevel.INFO)

    def _result(self, time_ns: int, result: StepResult) -> None:
        self._last = result
        self._at(time_ns)
        for chart in self._charts or ():
            chart.add(result)

    def _lose(self, not_shown: int) -> None:
        if not_shown > self._not_shown:
            if not self._not_shown:
                self._log("the viewer is slow: not all is shown, all is recorded", rr.TextLogLevel.WARN)
            self._not_shown = not_shown

    def _tell(self) -> None:
        lines = [f"# {markdown_text(self._about.title)}", "", f"**{markdown_text(self._where)}**", ""]
        lines += ["| | |", "|---|---|", f"| samples | {self._samples} |", f"| not shown | {self._not_shown} |"]
        if self._last is not None:
            lines += _result_rows(self._last)
        text = rr.TextDocument("\n".join(lines), media_type=rr.MediaType.MARKDOWN)
        self._recording.log("/now", text)

    def _log(self, text: str, level: rr.TextLogLevel) -> None:
        self._at(self._latest_ns)
        seconds = 0.0 if self._origin_ns is None else (self._latest_ns - self._origin_ns) * 1e-9
        log_line(self._recording, seconds, text, level)

    def _pass(self, time_ns: int) -> None:
        self._origin_ns = time_ns if self._origin_ns is None else self._origin_ns
        self._latest_ns = max(self._latest_ns, time_ns)

    def _at(self, time_ns: int) -> None:
        passed = max(0, time_ns - self._origin_ns) if self._origin_ns is not None else 0
        self._recording.set_time(TIME, duration=np.timedelta64(passed, "ns"))


def _joined(blocks: Sequence[SampleBlock]) -> list[list[SampleBlock]]:
    """The same blocks in runs without a gap."""
    runs: list[list[SampleBlock]] = []
    for block in blocks:
        if runs and runs[-1][-1].first_index + len(runs[-1][-1]) == block.first_index:
            runs[-1].append(block)
        else:
            runs.append([block])
    return runs


def _result_rows(result: StepResult) -> list[str]:
    """The latest measured step, as rows of a table."""
    told = {"latest step": f"{markdown_text(result.sweep)}, {result.index + 1}"}
    if result.frequency_Hz:
        told["frequency"] = f"{result.frequency_Hz:.6g} Hz"
    told[f"{markdown_text(result.target_channel)} held"] = f"{result.amplitude:.4g} of {result.target_amplitude:.4g}"
    told |= {"generator": f"{result.voltage_V:.3g} V", "settled in": f"{result.settle_s:.3g} s"}
    return [f"| {name} | {value} |" for name, value in told.items()]
