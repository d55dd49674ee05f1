"""One run in progress: generator, samples and file together, for whichever procedure is running."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from recordings.quantities import follows_excitation
from recordings.run import Channel, Event, Indicator, Step, StepState
from recordings.streams import Acquisition, Excitation
from twin.procedures.limits import LIMITS
from twin.procedures.recorder import Recorder
from twin.procedures.results import StepResult
from twin.procedures.sine_fit import SineFit, fit_sine
from twin.procedures.stream import Series, Stream


@dataclass(frozen=True, kw_only=True)
class StepPlace:
    """Which step of which sweep is running."""

    sweep: str
    index: int
    target_channel: str
    target_amplitude: float


class Session:
    """What every procedure needs while it runs.

    Parameters
    ----------
    acquisition
        Started.
    stream, recorder
        Its samples and where they are written.
    voltage_limit_V
        The generator saturates here.
    on_time
        Called with the seconds of rig time that have passed, after every window.
    """

    def __init__(
        self,
        acquisition: Acquisition,
        stream: Stream,
        recorder: Recorder,
        *,
        voltage_limit_V: float,
        on_step: Callable[[StepResult], None] | None = None,
        on_time: Callable[[float], None] | None = None,
    ) -> None:
        self._acquisition, self.stream, self.recorder = acquisition, stream, recorder
        self._limit_V, self._on_step, self._on_time = voltage_limit_V, on_step, on_time
        self.channels: Mapping[str, Channel] = {channel.name: channel for channel in acquisition.channels}
        self.steps: list[StepResult] = []
        self.place: tuple[StepPlace, float] | None = None
        self.last_step: Step | None = None
        self.start_ns: int | None = None
        self.frequency_Hz = 0.0
        self.voltage_V = 0.0
        self.saturated = False
        self.latency_ns = 0
        self.free_rate: complex | None = None
        """Of the structure's own decay as the last step showed it, -1/tau + 2 pi i f0, 1/s."""

    @property
    def force_channel(self) -> Channel | None:
        """The force cell, if there is one; of several the one that is held, or else the first."""
        cells = [channel for channel in self.channels.values() if channel.quantity == "force"]
        return min(cells, key=lambda channel: channel.name != self.stream.primary, default=None)

    @property
    def reference_channel(self) -> str:
        """The channel whose phase the others are told by: the force where there is one."""
        force = self.force_channel
        return force.name if force is not None else next(iter(self.channels))

    @property
    def elapsed_s(self) -> float:
        """Rig time since the first output, s."""
        return 0.0 if self.start_ns is None else max(0, self.stream.latest_ns - self.start_ns) * 1e-9

    def set_sine(self, frequency_Hz: float, voltage_V: float) -> int:
        """Change the generator; returns the time from which samples show it, on the primary device's grid."""
        self.saturated = voltage_V > self._limit_V
        self.frequency_Hz, self.voltage_V = frequency_Hz, min(voltage_V, self._limit_V)
        return self.set_output(Excitation(kind="sine", frequency_Hz=frequency_Hz, amplitude_V=self.voltage_V))

    def set_output(self, excitation: Excitation) -> int:
        """Change the generator; returns the time from which samples show it, on the primary device's grid."""
        before_ns = self.stream.latest_ns
        holds_ns = self._acquisition.set_output(excitation)
        self.latency_ns = max(0, holds_ns - before_ns)
        if self.start_ns is None:
            self.start_ns = holds_ns
        return self.stream.align(holds_ns)

    def expected_ns(self) -> int:
        """The time from which a change made now would probably hold."""
        return self.stream.latest_ns + self.latency_ns

    def mark(self, place: StepPlace, state: StepState, time_ns: int, frequency_Hz: float) -> None:
        """Write the start of a state of a step."""
        self.place = (place, frequency_Hz)
        self.last_step = Step(**vars(place), time_ns=time_ns, frequency_Hz=frequency_Hz, state=state)
        self.recorder.step(self.last_step)

    def end(self, state: StepState) -> None:
        """Mark the end of the step that is running, if there is one."""
        if self.place is not None:
            self.mark(self.place[0], state, self.stream.latest_ns, self.place[1])

    def note(self, kind: str, detail: str, *, source: str = "procedure", time_ns: int | None = None) -> None:
        """Write an event of the procedure's own, now."""
        time_ns = self.stream.latest_ns if time_ns is None else time_ns
        self.stream.note(Event(time_ns=time_ns, source=source, kind=kind, detail=detail))

    def finish_step(self, result: StepResult, time_ns: int) -> None:
        """Keep a measured step, write its indicators, tell whoever wants to know, and end the recorded stretch."""
        self.steps.append(result)
        values = {"voltage": (result.voltage_V, "V"), "frequency": (result.frequency_Hz, "Hz")}
        for name, phasor in result.phasors.items():
            values[f"{name}_amplitude"] = (abs(phasor), self.channels[name].unit)
        for name, (value, unit) in values.items():
            self.recorder.indicator(Indicator(name=name, time_ns=time_ns, value=value, unit=unit))
        if self._on_step is not None:
            self._on_step(result)
        self.recorder.close()

    def window(self, start_ns: int, duration_s: float) -> dict[str, Series]:
        """All channels of a window of any length; waits for it in pieces of a second, so that progress is seen."""
        done_s = 0.0
        while done_s < duration_s:
            done_s = min(duration_s, done_s + 1.0)
            self.stream.wait(start_ns + round(done_s * 1e9))
            self.tick()
        series = self.stream.window(start_ns, duration_s)
        self.stream.drop_before(start_ns)
        return series

    def tick(self) -> None:
        """Tell whoever wants to know how much rig time has passed."""
        if self._on_time is not None:
            self._on_time(self.elapsed_s)

    def fits(self, series: Mapping[str, Series], *, modulation: int = 0, delay_s: float = 0.0) -> dict[str, SineFit]:
        """Sine fits at the generator's frequency of the channels that follow the excitation and have enough samples.

        Phases refer to the moment `delay_s` before the window.
        """
        found = {}
        for name, one in series.items():
            if not follows_excitation(self.channels[name].quantity):
                continue
            try:
                found[name] = fit_sine(
                    one.samples,
                    frequency_Hz=self.frequency_Hz,
                    sample_rate_Hz=one.sample_rate_Hz,
                    offset_s=one.offset_s + delay_s,
                    harmonics=LIMITS.fitted_harmonics,
                    modulation=modulation,
                )
            except ValueError:  # too many samples lost
                continue
        return found
