"""What a procedure gives back: every step as it was measured, and how the run ended."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from recordings.run import Event, Step


@dataclass(frozen=True, kw_only=True)
class StepResult:
    """One measured step."""

    sweep: str
    index: int
    frequency_Hz: float
    target_channel: str
    target_amplitude: float
    """As in the recording's ``Step``."""
    voltage_V: float
    """Peak of the generator while measuring; rms for random excitation."""
    amplitude: float
    """What the target channel reached: peak of the fundamental, or rms for random excitation."""
    settle_s: float
    measure_s: float = 0.0
    """Waiting and measuring, s of the rig's time."""
    settled: bool | None = None
    """False if the wait ended at its maximum; None if it was fixed."""
    remaining: float | None = None
    """The transient left at the end of the wait, relative to the response, as far as the wait showed it."""
    drift: float | None = None
    """Largest change of any channel between the halves of the measurement, relative to its response."""
    phasors: Mapping[str, complex] = field(default_factory=dict)
    """Complex fundamental of each channel, peak values, relative to the phase of the force (of the target channel where
    there is no force)."""
    std: Mapping[str, float] = field(default_factory=dict)
    """Standard deviation of real and imaginary part of each phasor from the noise."""
    harmonics: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """Amplitudes of harmonics 1, 2, ... of each channel, peak values."""
    distortion: Mapping[str, float] = field(default_factory=dict)
    """Higher harmonics over the fundamental of each channel."""
    peak: Mapping[str, float] = field(default_factory=dict)
    """Largest magnitude of each channel while measuring."""
    peak_frequency_Hz: float | None = None
    """Of a swept sine: its frequency when the response that moves most was largest."""

    @property
    def amplitude_error(self) -> float:
        """Relative error of the held amplitude."""
        if self.target_amplitude == 0.0:
            return 0.0
        return self.amplitude / self.target_amplitude - 1.0


@dataclass(frozen=True, kw_only=True)
class ProcedureResult:
    """How a run went.

    `state` is ``done``; ``aborted`` by a guard, a silent device or a lost connection; or ``interrupted`` from outside.
    `reason` says why it is not done.  `duration_s` is the rig's time from the first output to the last sample.
    `events` are all that were recorded, `last_step` is the last state that was, both in the devices' time.
    """

    state: Literal["done", "aborted", "interrupted"]
    reason: str
    steps: tuple[StepResult, ...]
    duration_s: float
    sample_rate_Hz: float
    events: tuple[Event, ...] = ()
    last_step: Step | None = None
