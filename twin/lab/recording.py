"""A recorded run to look at."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from recordings import Run, read_run
from recordings.importing.extras import extra
from twin.arrays import Array
from twin.lab.shown import Shown
from twin.views.extremes import extremes
from twin.views.style import AFTER, unit_text
from twin.views.table import Table

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from twin.views.curves import SteppedSweep


@dataclass(frozen=True, repr=False, eq=False)
class Recording(Shown):
    """A run, its sweeps reduced when they are asked for.

    ``run["acc1"]`` are the samples of a channel, and ``for channel in run`` goes through the channels.
    """

    run: Run

    def __iter__(self) -> Iterator[str]:
        """Channels of which samples were recorded."""
        return (channel for device in self.run.devices.values() for channel in device.values)

    def __getitem__(self, channel: str) -> Array:
        """Samples of a channel in its unit, (n,); those that were lost are NaN.

        Raises
        ------
        KeyError
            If none were recorded.
        """
        return np.asarray(self.run.device_of(channel).values[channel]).astype(float)

    @property
    def time(self) -> Array:
        """When each sample was taken, s since the first one, (n,).

        Raises
        ------
        ValueError
            If the run is of several devices, each with its own clock: see :meth:`time_of`.
        """
        if len(self.run.devices) != 1:
            devices = ", ".join(self.run.devices)
            raise ValueError(f"{self.run.path} has the clocks of {devices}: ask for time_of(a channel)")
        return self.time_of(next(iter(self)))

    def time_of(self, channel: str) -> Array:
        """When each sample of a channel was taken, s since the first one of the run, (n,).

        Raises
        ------
        KeyError
            If no samples of that channel were recorded.
        """
        first = min(int(device.block_time_ns[0]) for device in self.run.devices.values())
        return 1e-9 * (self.run.device_of(channel).times_ns() - first)

    def to_pandas(self) -> pandas.DataFrame:
        """A column a channel, over time in s; where devices have their own clocks, NaN at the times of the others.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        pandas = extra("pandas", Path(self.run.path), of="frames")
        return pandas.DataFrame({
            channel: pandas.Series(self[channel], index=pandas.Index(self.time_of(channel), name="time, s"))
            for channel in self
        })  # fmt: skip

    def to_xarray(self) -> xarray.Dataset:
        """A variable a channel, with quantity, unit and place, over the time of its device; the run's description.

        Raises
        ------
        InputError
            If xarray is not installed.
        """
        xarray = extra("xarray", Path(self.run.path), of="frames")
        several = len(self.run.devices) > 1
        variables = {}
        for channel in self:
            about = self.run.channels[channel]
            axis = f"time_{about.device}" if several else "time"
            told: dict[str, str | float] = {
                "quantity": about.quantity,
                "units": about.unit,
                "direction": about.direction,
            }
            if about.position_m is not None:
                told["position_m"] = about.position_m
            coordinate = (axis, self.time_of(channel), {"units": "s"})
            variables[channel] = xarray.DataArray(self[channel], coords={axis: coordinate}, dims=axis, attrs=told)
        return xarray.Dataset(variables, attrs=dict(self.run.info))

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
        from twin.views.figures import plots_figure
        from twin.views.plots import stepped_plots

        if not self.sweeps:
            raise ValueError(f"{self.run.path} has no sine sweeps to plot")
        plots = [*stepped_plots(self.run, self.sweeps).values()]
        return plots_figure(plots, columns=len(plots), height_in=3.0)

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
