"""What a rehearsal knows: the procedure, what came of it, and what is assumed of the rig."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from recordings.quantities import is_motion, quantity
from recordings.run import Channel, Step
from twin.arrays import Array
from twin.procedures import Impact, Procedure, ProcedureResult, StepResult, SweptSine
from twin.rehearsal.bands import band_numbers
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.nominal import NominalRig


@dataclass(frozen=True, kw_only=True)
class Caution:
    """A warning of a rehearsal."""

    kind: str
    """``dwell-too-short``, ``sweep-too-fast``, ``grid-too-coarse``, ``overload``, ``limit-reached``, ``force-drop-out``
    (too low) or ``force-too-high``, ``response-drop-out`` or ``response-too-high`` where the response is held,
    ``jump-ahead``, ``noise-floor``, ``quantisation``, ``branch-ends-early``, ``internal-resonance``,
    ``too-short`` or ``implausible-rig``."""
    severity: Literal["stop", "warning", "note"]
    """``stop``: the procedure must not be run like this.  ``warning``: its data would mislead.  ``note``: the procedure
    is right, its reader should know."""
    sweep: str
    index: int
    frequency_Hz: float
    """The worst step; no sweep where it is about none."""
    steps: int
    """How many steps of the sweep are concerned."""
    reason: str
    advice: str
    """What is wrong, with figures; what to change."""
    changes: Mapping[str, Any] = field(default_factory=dict)
    """Fields of the procedure with the values that the advice means; None removes a field."""
    channel: str = ""
    """Whose signal it is about, where it is about one."""
    size: float = 0.0
    """How bad the worst step is, comparable within a kind."""
    cases: tuple[Caution, ...] = ()
    """All that it stands for, where it stands for several that differ in sweep and channel."""

    @classmethod
    def at(cls, worst: StepResult | Step, **told: Any) -> Caution:
        """About a step as it was measured, or as it was running when a guard ended it."""
        return cls(sweep=worst.sweep, index=worst.index, **{"frequency_Hz": worst.frequency_Hz, **told})

    @property
    def place(self) -> str:
        """The worst step in words."""
        return f"{self.sweep}, step {self.index}" + (f" at {self.frequency_Hz:g} Hz" if self.frequency_Hz else "")


def by_sweep(steps: Iterable[StepResult]) -> dict[str, list[StepResult]]:
    """Steps of each sweep, in the order they were taken."""
    found: dict[str, list[StepResult]] = {}
    for step in steps:
        found.setdefault(step.sweep, []).append(step)
    return found


@dataclass(frozen=True, kw_only=True)
class SweepSummary:
    """One sweep about one resonance at a glance; that is a fit of one degree of freedom, NaN where there is none.

    The peak is the largest response; where the response is held, the largest response per force.
    """

    sweep: str
    steps: int
    duration_s: float
    response_channel: str
    peak_frequency_Hz: float
    peak_response: float
    quality_factor: float


@dataclass(frozen=True, kw_only=True)
class Rehearsal:
    """A procedure that was run on the twin, and what is assumed of the rig."""

    procedure: Procedure
    result: ProcedureResult
    channels: Mapping[str, Channel]
    nominal: NominalRig = field(default_factory=NominalRig)

    @property
    def lowest_mode(self) -> tuple[float, float] | None:
        """Frequency, Hz, and damping ratio of the lowest mode in the band of a procedure that has one."""
        low, high = getattr(self.procedure, "band", (math.inf, 0.0))
        return next(((f, ratio) for f, ratio in self.nominal.modes if low <= f <= high), None)

    def time_constant_s(self, frequency_Hz: float) -> float:
        """Of a free decay near a frequency, s."""
        return 1.0 / (2 * math.pi * self.half_width_Hz(frequency_Hz))

    def half_width_Hz(self, frequency_Hz: float) -> float:
        """Half of the half-power bandwidth of a resonance near a frequency."""
        return self.nominal.damping_ratio * frequency_Hz

    def sweeps(self) -> dict[str, list[StepResult]]:
        """The sine steps of each sweep, in the order they were taken; ring-downs and broadband steps left out."""
        return by_sweep(step for step in self.result.steps if step.frequency_Hz > 0 and step.phasors)

    @property
    def force_channel(self) -> str | None:
        """Name of the force cell."""
        return next((name for name, channel in self.channels.items() if channel.quantity == "force"), None)

    @property
    def response_channels(self) -> list[str]:
        """Names of accelerations, velocities and displacements."""
        return [n for n, c in self.channels.items() if is_motion(c.quantity)]

    def response_channel(self, steps: Sequence[StepResult]) -> str | None:
        """The response that moves most over some steps."""
        sizes = {
            name: max((abs(step.phasors.get(name, 0j)) for step in steps), default=0.0)
            for name in self.response_channels
        }
        return max(sizes, key=lambda name: sizes[name], default=None)

    def bands(self, steps: Sequence[StepResult]) -> list[list[int]]:
        """Places of a sweep's steps about each resonance, the lowest resonance first; one if the frequency stays."""
        frequency_Hz = np.array([step.frequency_Hz for step in steps])
        if len(np.unique(frequency_Hz)) < 2:
            return [list(range(len(steps)))]
        H = np.array([[abs(self.transfer(step, name)) for step in steps] for name in self.response_channels])
        largest = np.maximum(H.max(axis=1, keepdims=True), np.finfo(float).tiny)
        numbers = band_numbers(frequency_Hz, np.sum(H / largest, axis=0))
        return [[int(i) for i in np.flatnonzero(numbers == number)] for number in range(numbers.max() + 1)]

    def receptances(self, steps: Sequence[StepResult]) -> Array:
        """Receptance of each step of a sweep, at the channel that moves most about the step's own resonance."""
        found = np.zeros(len(steps), complex)
        for band, channel in self._about_resonances(steps):
            found[band] = [self.receptance(steps[i], channel) for i in band]
        return found

    def near_resonance(self, steps: Sequence[StepResult]) -> Array:
        """Whether each step of a sweep lies near enough to its resonance to tell something of it."""
        near = np.zeros(len(steps), bool)
        for band, channel in self._about_resonances(steps):
            size = np.array([abs(self.transfer(steps[i], channel)) for i in band])
            near[band] = size > LIMITS.rehearsal_near * size.max()
        return near

    def _about_resonances(self, steps: Sequence[StepResult]) -> Iterator[tuple[list[int], str]]:
        """Each of :meth:`bands` with the response that moves most in it."""
        for band in self.bands(steps):
            channel = self.response_channel([steps[i] for i in band])
            if channel is not None:
                yield band, channel

    def transfer(self, step: StepResult, channel: str) -> complex:
        """Response over force, or the response itself where there is no force channel."""
        response = step.phasors.get(channel, 0j)
        force = step.phasors.get(self.force_channel or "", 0j)
        return response / force if force else response

    def receptance(self, step: StepResult, channel: str) -> complex:
        """Displacement at a channel's sensor over the force, whatever quantity the sensor measures."""
        iw = 2j * math.pi * step.frequency_Hz
        return complex(self.transfer(step, channel) / iw ** quantity(self.channels[channel].quantity).derivative)

    def summaries(self) -> Iterator[SweepSummary]:
        """Each sine sweep at a glance, about each of its resonances."""
        for sweep, steps, channel in (
            (sweep, [whole[i] for i in band], channel)
            for sweep, whole in self.sweeps().items()
            for band, channel in self._about_resonances(whole)
        ):
            sizes = [abs(step.phasors.get(channel, 0j)) for step in steps]
            peak = int(np.argmax([abs(self.transfer(s, channel)) for s in steps] if self._response_is_held else sizes))
            yield SweepSummary(
                sweep=sweep,
                steps=len(steps),
                duration_s=sum(step.settle_s + step.measure_s for step in steps),
                response_channel=channel,
                peak_frequency_Hz=steps[peak].frequency_Hz,
                peak_response=sizes[peak],
                quality_factor=self._quality_factor(steps, channel),
            )

    @property
    def _response_is_held(self) -> bool:
        procedure = self.procedure
        return not isinstance(procedure, (SweptSine, Impact)) and procedure.control == "response"

    def _quality_factor(self, steps: Sequence[StepResult], channel: str) -> float:
        """Q of one degree of freedom: 1/H = k - m w2 + i w c, least squares weighted by H, over the peak's steps."""
        frequency_Hz = np.array([step.frequency_Hz for step in steps])
        # a backbone or a ladder has many frequencies or levels, but no resonance curve
        if len(np.unique(frequency_Hz)) < 4 or len({step.target_amplitude for step in steps}) > 1:
            return math.nan
        w = frequency_Hz / frequency_Hz.mean()
        H = np.array([self.receptance(step, channel) for step in steps])
        near = abs(H) > 0.2 * abs(H).max()
        if near.sum() < 3:
            return math.nan
        H, w = H[near] / abs(H).max(), w[near]
        design = np.column_stack([H, -H * w**2, 1j * H * w])
        k, m, c = np.linalg.lstsq(
            np.vstack([design.real, design.imag]), np.r_[np.ones(len(w)), np.zeros(len(w))], rcond=None
        )[0]
        return float(np.sqrt(abs(k * m)) / abs(c)) if c and k * m > 0 else math.nan
