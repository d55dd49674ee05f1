"""A run in rerun: time signals, sweeps at every level, harmonics step by step, and what happened."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from recordings.errors import printable
from recordings.run import Run, StepState
from twin.arrays import Array
from twin.identify.spectra.spectrum import broadband_records, h1, is_impact_test
from twin.views.curves import SteppedSweep, each_resonance, parted, stepped_sweeps
from twin.views.extremes import extremes
from twin.views.plot import Plot, PlotCurve
from twin.views.plots import stepped_plots
from twin.views.receptance import farthest_response, per_force, reading_label, response_label
from twin.views.rerun.chart import draw_chart
from twin.views.rerun.rrd import TIME, entity, log_line, log_samples, log_series, log_view, recording_file, send_layout
from twin.views.run_text import run_markdown
from twin.views.style import INK, level_colour, unit_text

BLOCK = 65536
MOST_SAMPLES = 2_000_000
"""Samples of a channel that are shown one by one; of more than that, the least and greatest of each short stretch."""
MOST_EVENTS = 10_000
WIDE = 1350.0
"""Width of two charts side by side below the signals."""


def save_run(run: Run, path: Path, *, rehearsal: Mapping[str, Any] | None = None) -> None:
    """Write `run` as an .rrd that opens arranged; InputError if `path` cannot be written.

    Parameters
    ----------
    rehearsal
        The table of a rehearsal (``result.json``): its warnings and predicted branches are shown too.
    """
    with recording_file(path) as recording:
        signals = _signals(recording, run)
        reduced = stepped_sweeps(run)
        charts, backbones = _by_resonance(recording, run, reduced, rehearsal or {})
        charts = charts or _broadband_charts(recording, run)
        harmonics = _harmonics(recording, run, reduced)
        told = _log_events(recording, run)
        about = rr.TextDocument(run_markdown(run, reduced, rehearsal), media_type=rr.MediaType.MARKDOWN)
        recording.log("about", about, static=True)
        left: list[Any] = [rrb.TextDocumentView(origin="/about", name="About this run")]
        if told:
            left += [log_view(TIME)]
        right: list[Any] = [rrb.Vertical(*signals)] if signals else []
        right += [_in_columns(charts)] if charts else []
        bottom: list[Any] = ([harmonics] if harmonics else []) + ([_in_columns(backbones)] if backbones else [])
        right += [rrb.Horizontal(*bottom, column_shares=[1.6, 1.0][: len(bottom)])] if bottom else []
        shares = ([1.9] if signals else []) + ([2.1] if charts else []) + ([1.6] if bottom else [])
        layout = rrb.Horizontal(
            rrb.Vertical(*left, row_shares=[2, 1][: len(left)]),
            rrb.Vertical(*right, row_shares=shares),
            column_shares=[1, 3.2],
        )
        send_layout(recording, layout, timeline=TIME, play_state="paused")


def _origin_ns(run: Run) -> int:
    starts = [int(device.block_time_ns[0]) for device in run.devices.values() if len(device.block_time_ns)]
    return min([*starts, *(step.time_ns for step in run.steps)], default=0)


def _whole_run(run: Run) -> rrb.TimeAxis:
    """From the run's first sample to its last, instead of wherever the viewer's cursor is."""
    ends = [device.end_ns for device in run.devices.values() if len(device.block_time_ns)]
    return rrb.TimeAxis(
        view_range=rr.TimeRange(
            start=rr.TimeRangeBoundary.absolute(nanos=0),
            end=rr.TimeRangeBoundary.absolute(nanos=max(ends, default=_origin_ns(run)) - _origin_ns(run)),
        )
    )


def _signals(recording: rr.RecordingStream, run: Run) -> list[rrb.TimeSeriesView]:
    """Samples of every channel, blockwise; one plot for each, on one time axis."""
    origin = _origin_ns(run)
    views = []
    for i, (name, channel) in enumerate(run.channels.items()):
        try:
            device = run.device_of(name)
        except KeyError:
            continue
        position, values = _envelope(np.asarray(device.values[name]))
        path = entity(f"/signals/{name}")
        label = printable(f"{name}, {unit_text(channel.unit)}")
        largest = float(np.nanmax(np.abs(values), initial=0.0))
        log_series(recording, path, label, level_colour(i))
        time_ns = device.times_ns()[position] - origin
        for start in range(0, len(values), BLOCK):
            log_samples(recording, path, time_ns[start : start + BLOCK], values[start : start + BLOCK])
        views.append(
            rrb.TimeSeriesView(
                origin=path,
                name=f"{label}; largest {largest:.4g}",
                plot_legend=rrb.PlotLegend(visible=False),
                axis_x=_whole_run(run),
                axis_y=rrb.ScalarAxis(range=(-1.1 * largest, 1.1 * largest)) if largest else None,
            )
        )
    return views


def _envelope(values: Array) -> tuple[Array, Array]:
    """Positions and values to show: all, or of each stretch the least and the greatest, in order of time."""
    return extremes(values, 2 * -(-len(values) // MOST_SAMPLES) if len(values) > MOST_SAMPLES else 1)


def _in_columns(views: Sequence[Any]) -> Any:
    """One beside the other; what has a name of its own, each behind a tab."""
    tabs = all(isinstance(view, rrb.Horizontal) for view in views)
    return rrb.Tabs(*views) if tabs and len(views) > 1 else rrb.Horizontal(*views)


def _by_resonance(
    recording: rr.RecordingStream, run: Run, reduced: Sequence[SteppedSweep], rehearsal: Mapping[str, Any]
) -> tuple[list[Any], list[Any]]:
    """Charts of the sweeps, and their backbones; about several resonances, each has its own."""
    if not reduced or max(len(sweep.frequency_Hz) for sweep in reduced) < 2:
        return [], []
    charts: list[Any] = []
    backbones = []
    for below, where, about in each_resonance([part for sweep in reduced for part in parted(sweep)]):
        views = [
            draw_chart(recording, f"/sweeps{below}/{channel}", plot, width=WIDE, text=1.2)
            for channel, plot in stepped_plots(run, about, rehearsal.get("branches") or []).items()
        ]
        charts += [rrb.Horizontal(*views, name=where)] if where else views
        backbone = _backbone(recording, run, about, f"/backbone{below}")
        backbones += [backbone] if backbone else []
    return charts, backbones


def _backbone(
    recording: rr.RecordingStream, run: Run, reduced: Sequence[SteppedSweep], path: str
) -> rrb.Spatial2DView | None:
    """Frequency and displacement of each sweep's largest step, by level, at the response channel farthest out.

    Nothing where fewer than two sweeps show a top.
    """
    shown = [sweep for sweep in reduced if len(sweep.frequency_Hz) > 2 and sweep.harmonics]
    if len(shown) < 2:
        return None
    farthest = farthest_response(run.channels[name] for name in shown[0].harmonics)
    assert farthest is not None
    channel = farthest.name
    tops = []
    for sweep in shown:
        fundamental, quantity = sweep.harmonics[channel][:, 0], run.channels[channel].quantity
        displacement = per_force(fundamental, quantity, sweep.frequency_Hz)
        top = int(np.nanargmax(displacement))
        tops.append((float(sweep.frequency_Hz[top]), float(displacement[top])))
    x, y = np.array(sorted(tops, key=lambda top: top[1])).T
    levels = list(dict.fromkeys(sweep.level for sweep in shown))
    curves, told = [PlotCurve("line", x, y, INK, "dashed", 1.0)], []
    for sweep, (frequency, size) in zip(shown, tops, strict=True):
        colour = level_colour(levels.index(sweep.level))
        curves.append(PlotCurve(sweep.name, np.array([frequency]), np.array([size]), colour, "point", 5.0))
        told.append((sweep.level, colour, "point"))
    plot = Plot.over(
        f"Backbone, {channel}", "frequency of the largest step, Hz", reading_label(channel, farthest.quantity), curves,
        told=told, margin=0.15,
    )  # fmt: skip
    return draw_chart(recording, path, plot, width=1250.0, text=1.8)


def _broadband_charts(recording: rr.RecordingStream, run: Run) -> list[rrb.Spatial2DView]:
    """H1 of a broadband run, one chart for each response channel."""
    force = next((name for name, channel in run.channels.items() if channel.quantity == "force"), None)
    records = broadband_records(run) if force and not is_impact_test(run) else []
    if not records or force is None:
        return []
    views = []
    estimates = [(record.sweep, h1(record, force=force)) for record in records]
    for channel in estimates[0][1].H:
        curves = []
        for i, (name, estimate) in enumerate(estimates):
            seen = (estimate.coherence[channel] > 0.5) & (estimate.frequency_Hz > 0)
            last = np.flatnonzero(seen)[-1] + 1 if seen.any() else 1
            size = np.where(seen, np.abs(estimate.H[channel]), np.nan)[:last]
            curves.append(PlotCurve(name, estimate.frequency_Hz[:last], size, level_colour(i), size=1.5, legend=True))
        label = response_label(channel, run.channels[channel].unit, force)
        across = "frequency, Hz (where the coherence is above 0.5)"
        plot = Plot.over(f"H1, {channel}", across, label, curves, log="y")
        views.append(draw_chart(recording, f"/broadband/{channel}", plot, width=WIDE, text=1.2))
    return views


def _harmonics(recording: rr.RecordingStream, run: Run, reduced: Sequence[SteppedSweep]) -> rrb.TimeSeriesView | None:
    """Harmonics of the farthest response relative to its fundamental, in dB, at each step's time."""
    if not reduced:
        return None
    channels = sorted(reduced[0].harmonics, key=lambda name: run.channels[name].position_m or 0.0)
    if not channels:
        return None
    channel, origin = channels[-1], _origin_ns(run)
    order = np.argsort(np.concatenate([sweep.time_s for sweep in reduced]))
    time_s = np.concatenate([sweep.time_s for sweep in reduced])[order]
    sizes = np.concatenate([sweep.harmonics[channel] for sweep in reduced])[order]
    with np.errstate(divide="ignore", invalid="ignore"):
        dB = 20 * np.log10(sizes / sizes[:, :1])
    for k, number in enumerate((2, 3, 5)):
        log_series(recording, f"/harmonics/{number}", f"harmonic {number}", level_colour(k))
        log_samples(recording, f"/harmonics/{number}", time_s * 1e9 - origin, dB[:, number - 1])
    return rrb.TimeSeriesView(
        origin="/harmonics",
        name=printable(f"Harmonics of {channel}, dB of its fundamental, step by step"),
        axis_x=_whole_run(run),
    )


def _log_events(recording: rr.RecordingStream, run: Run) -> bool:
    """Events, and where each sweep begins and ends; whether there were any."""
    origin = _origin_ns(run)
    lines: list[tuple[int, str, rr.TextLogLevel]] = [
        (event.time_ns, f"{event.source}: {event.kind} {event.detail}".strip(), rr.TextLogLevel.WARN)
        for event in run.events
    ]
    seen: set[str] = set()
    for step in run.steps:
        if step.sweep not in seen:
            seen.add(step.sweep)
            lines.append((step.time_ns, f"{step.sweep} begins", rr.TextLogLevel.INFO))
        if step.state in (StepState.DONE, StepState.ABORTED):
            level = rr.TextLogLevel.INFO if step.state is StepState.DONE else rr.TextLogLevel.ERROR
            lines.append((step.time_ns, f"{step.sweep} {step.state.name.lower()}", level))
    lines.sort(key=lambda line: line[0])
    if len(lines) > MOST_EVENTS:
        more = f"and {len(lines) - MOST_EVENTS} more, not shown"
        lines = [*lines[:MOST_EVENTS], (lines[MOST_EVENTS][0], more, rr.TextLogLevel.WARN)]
    for time_ns, text, level in lines:
        recording.set_time(TIME, duration=np.timedelta64(time_ns - origin, "ns"))
        log_line(recording, (time_ns - origin) * 1e-9, text, level)
    return bool(lines)
