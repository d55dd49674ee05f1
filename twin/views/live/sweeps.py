"""The running sweep, point by point over the predicted branches, and its harmonics."""

from dataclasses import dataclass, field

import numpy as np
import rerun as rr

from recordings.run import Channel
from twin.procedures import Dwell, Procedure, RingDown, SteppedSine, StepResult
from twin.procedures.grid import fixed_frequencies
from twin.views.live.about import LiveAbout
from twin.views.plot import Axis, PlotCurve, common_range
from twin.views.receptance import branch_curves, per_force, per_force_label, reading_label
from twin.views.rerun.chart import Chart
from twin.views.style import INK, level_colour, unit_text

WIDE = 1200.0
GROW = 0.35
"""Spare room, as a share of the range, when a point falls outside the axes and these are drawn anew."""
NUMBERS = (2, 3, 4, 5)
LOWEST_dB, HIGHEST_dB = -120.0, 0.0


def stepped(procedure: Procedure | None) -> bool:
    """Whether a procedure measures step by step."""
    return isinstance(procedure, SteppedSine | Dwell | RingDown)


@dataclass
class _Sweep:
    level: str
    x: list[float] = field(default_factory=list)
    y: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class _Across:
    """What lies along the horizontal axis: the frequency where it moves, the amplitude held where it does not."""

    label: str
    by_amplitude: bool
    ends: tuple[float, float]

    def of(self, result: StepResult) -> float:
        return result.target_amplitude if self.by_amplitude else result.frequency_Hz


def _across(about: LiveAbout) -> _Across:
    procedure = about.procedure
    if isinstance(procedure, SteppedSine) and procedure.order == "frequency":
        known = fixed_frequencies(procedure)
        ends = common_range([np.array(known)], margin=0.03 if len(known) > 1 else 0.06)
        return _Across("frequency, Hz", False, ends)
    assert isinstance(procedure, SteppedSine | Dwell | RingDown)
    unit = next((channel.unit for channel in about.channels if channel.name == procedure.target_channel), "")
    ends = common_range([np.array([0.0, *procedure.amplitudes])])
    return _Across(f"{procedure.target_channel} held, {unit_text(unit)}", True, ends)


class SweepChart:
    """Receptance at one channel of every step so far, each sweep a curve, over the predicted branches."""

    def __init__(self, recording: rr.RecordingStream, about: LiveAbout, channel: Channel) -> None:
        self._recording, self._channel, self._across = recording, channel, _across(about)
        self._force = next((each.name for each in about.channels if each.quantity == "force"), "")
        """Name of the force's channel; nothing where there is none."""
        self._sweeps: dict[str, _Sweep] = {}
        self._levels: list[str] = []
        self._unit = {each.name: each.unit for each in about.channels}
        curves = branch_curves(about.branches, channel)
        self._branches = [(self._level_of(force_N, self._force), x, y) for force_N, x, y in curves]
        highest = max((float(y.max()) for *_, y in self._branches), default=0.0)
        self.chart = self._drawn_anew(self._across.ends, (0.0, 1.1 * highest or 1.0))
        self._known = bool(self._branches)

    def add(self, result: StepResult) -> None:
        """Draw one more step."""
        if self._channel.name not in result.phasors or not result.frequency_Hz:
            return
        drive = abs(result.phasors[self._force]) if self._force in result.phasors else 1.0
        size = abs(result.phasors[self._channel.name]) / max(drive, 1e-300)
        y = float(per_force(np.array(size), self._channel.quantity, np.array(result.frequency_Hz)))
        level = self._level_of(result.target_amplitude, result.target_channel)
        sweep = self._sweeps.setdefault(result.sweep, _Sweep(level))
        sweep.x.append(self._across.of(result))
        sweep.y.append(y)
        x_range = _wide_enough(self.chart.x.ends, sweep.x[-1], known=True)
        y_range = _wide_enough(self.chart.y.ends, y, known=self._known)
        self._known = True
        if (x_range, y_range) != (self.chart.x.ends, self.chart.y.ends):
            self.chart = self._drawn_anew(x_range, y_range)
        else:
            self._draw(result.sweep)
            self.chart.close()

    def _drawn_anew(self, x_range: tuple[float, float], y_range: tuple[float, float]) -> Chart:
        label = per_force_label if self._force else reading_label
        chart = self.chart = Chart(
            self._recording,
            "/sweeps",
            f"Sweeps at {self._channel.name}, as they grow",
            Axis(self._across.label, x_range),
            Axis(label(self._channel.name, self._channel.quantity), y_range),
            width=WIDE,
            growing=True,
            legend_rows=2,
        )
        for i, (level, x, y) in enumerate(self._branches):
            chart.draw(PlotCurve(f"branches/{i}", x, y, self._colour(level), "dashed", 1.5))
        if self._branches:
            chart.tell("predicted", INK, "dashed")
        for name in self._sweeps:
            self._draw(name)
        chart.close()
        return chart

    def _draw(self, name: str) -> None:
        sweep, chart = self._sweeps[name], self.chart
        x, y, colour = np.array(sweep.x), np.array(sweep.y), self._colour(sweep.level)
        chart.draw(PlotCurve(f"{name}/line", x, y, colour, size=1.0))
        chart.draw(PlotCurve(f"{name}/steps", x, y, colour, "point", 3.5))
        chart.tell(name, colour, "point")

    def _colour(self, level: str) -> str:
        if level not in self._levels:
            self._levels.append(level)
        return level_colour(self._levels.index(level))

    def _level_of(self, amplitude: float, channel: str) -> str:
        return f"{amplitude:g} {self._unit.get(channel, '')}"


class HarmonicsChart:
    """Higher harmonics at one channel in the latest sweep, relative to the fundamental."""

    def __init__(self, recording: rr.RecordingStream, about: LiveAbout, channel: Channel) -> None:
        self._recording, self._channel, self._across = recording, channel, _across(about)
        self._sweep = ""
        self._x: list[float] = []
        self._dB: list[list[float]] = []
        self._x_range = self._across.ends
        self._draw()

    def add(self, result: StepResult) -> None:
        """Draw one more step."""
        sizes = result.harmonics.get(self._channel.name, ())
        if len(sizes) < 2 or not result.frequency_Hz:
            return
        if result.sweep != self._sweep:
            self._sweep, self._x, self._dB = result.sweep, [], []
        self._x.append(self._across.of(result))
        with np.errstate(divide="ignore", invalid="ignore"):
            dB = 20 * np.log10(np.array(sizes) / sizes[0])
        self._dB.append([float(dB[n - 1]) if n <= len(dB) else float("nan") for n in NUMBERS])
        self._x_range = _wide_enough(self._x_range, self._x[-1], known=True)
        self._draw()

    def _draw(self) -> None:
        running = f" in {self._sweep}" if self._sweep else ""
        chart = self.chart = Chart(
            self._recording,
            "/harmonics",
            f"Harmonics of {self._channel.name}",
            Axis(self._across.label, self._x_range),
            Axis(f"{self._channel.name}{running}, dB of its fundamental", (LOWEST_dB, HIGHEST_dB)),
            growing=True,
            legend_rows=1,
        )
        for i, number in enumerate(NUMBERS):
            x, y = np.array(self._x), np.clip([row[i] for row in self._dB], LOWEST_dB, HIGHEST_dB)
            chart.draw(PlotCurve(f"{number}/line", x, y, level_colour(i), size=1.5))
            chart.draw(PlotCurve(f"{number}/steps", x, y, level_colour(i), "point", 3.0))
            chart.tell(f"harmonic {number}", level_colour(i), "line")
        chart.close()


def _wide_enough(ends: tuple[float, float], value: float, *, known: bool) -> tuple[float, float]:
    """The same ends if `value` lies between them, or wider ones; the first value sets ends that were guessed."""
    low, high = ends
    if not known:
        return low, value * (1 + GROW)
    if value > high:
        high = low + (value - low) * (1 + GROW)
    if value < low:
        low = high - (high - value) * (1 + GROW)
    return low, high
