"""A recorded run to look at."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from recordings import Run, read_run
from twin.lab.shown import Shown
from twin.views.extremes import extremes
from twin.views.style import AFTER, level_colour, unit_text
from twin.views.table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from twin.views.curves import SteppedSweep


@dataclass(frozen=True, repr=False, eq=False)
class Recording(Shown):
    """A run in memory, its sweeps reduced when they are asked for."""

    run: Run

    @property
    def sentence(self) -> str:
        """Which rig, which procedure, how long."""
        info = self.run.info
        what = ", ".join(f"{key} {info[key]}" for key in ("rig", "procedure", "source") if info.get(key))
        longest = max((device.end_ns - int(device.block_time_ns[0]) for device in self.run.devices.values()), default=0)
        return f"{Path(self.run.path).name}: {what or 'a run'}; {1e-9 * longest:.1f} s."

    @cached_property
    def sweeps(self) -> tuple[SteppedSweep, ...]:
        """Its sine sweeps, reduced to harmonics."""
        from twin.views.curves import stepped_sweeps

        return stepped_sweeps(self.run)

    def tables(self) -> Sequence[Table]:
        """Channels, sweeps and events."""
        from twin.views.run_text import run_tables

        return run_tables(self.run, self.sweeps)

    def plot_sweeps(self) -> Figure:
        """Receptance against frequency, a panel a channel.

        Raises
        ------
        ValueError
            If the run has no sine sweeps.
        """
        from twin.views.drawing import dressed, legend, panels
        from twin.views.receptance import per_force_label

        if not self.sweeps:
            raise ValueError(f"{self.run.path} has no sine sweeps to plot")
        channels = list(self.sweeps[0].receptance)
        figure, (row,) = panels(1, len(channels), height_in=3.6)
        for channel, axes in zip(channels, row, strict=True):
            for i, sweep in enumerate(self.sweeps):
                order = np.argsort(sweep.frequency_Hz, kind="stable")
                size = sweep.receptance[channel][order]
                style = {"markersize": 3.2, "color": level_colour(i), "label": sweep.name}
                axes.plot(sweep.frequency_Hz[order], size, "o-", **style)
            axes.set_ylim(bottom=0)
            label = per_force_label(channel, self.run.channels[channel].quantity)
            dressed(axes, title=channel, xlabel="frequency, Hz", ylabel=label)
        legend(figure)
        return figure

    def plot_samples(self, channel: str, *, start_s: float = 0.0, duration_s: float = float("inf")) -> Figure:
        """Samples of one channel against time since the device's first one.

        Raises
        ------
        KeyError
            If no samples of that channel were recorded.
        """
        from twin.views.drawing import dressed, panels

        device = self.run.device_of(channel)
        first = int(device.block_time_ns[0])
        stop = device.end_ns if np.isinf(duration_s) else first + round(1e9 * (start_s + duration_s))
        begin, end = device.position_at(first + round(1e9 * start_s)), device.position_at(stop)
        time_s = 1e-9 * (device.times_ns(begin, end) - first)
        figure, ((axes,),) = panels(1, 1, height_in=3.0)
        position, drawn = extremes(device.values[channel][begin:end], -(-2 * (end - begin) // 20_000))
        axes.plot(time_s[position], drawn, color=AFTER, linewidth=0.8)
        label = f"{channel}, {unit_text(self.run.channels[channel].unit)}"
        dressed(axes, title=channel, xlabel="time, s", ylabel=label)
        return figure


def load_run(path: str | Path) -> Recording:
    """Read a recording (.mcap).

    Raises
    ------
    InputError
        If it cannot be read, or breaks the recording contract.
    """
    return Recording(read_run(path))


def as_runs(runs: Iterable[Recording | Run | str | Path]) -> list[Run]:
    """Runs in memory; files are read."""
    return [run if isinstance(run, Run) else run.run if isinstance(run, Recording) else read_run(run) for run in runs]
