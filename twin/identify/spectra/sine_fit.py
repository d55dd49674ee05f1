"""Steady states of a stepped sine: harmonics of every channel with their covariance, by least squares.

Each measured stretch is fitted by a constant and all harmonics of the drive frequency up to the Nyquist frequency.
The noise is estimated, not assumed: its power beside each harmonic is read off the residual's spectrum.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from recordings.run import DeviceSamples, Run, pieces
from recordings.sweeps import Stretch, measured_stretches
from twin.arrays import Array
from twin.identify.limits import LIMITS

MOST_HARMONICS = 40
Harmonics = tuple[Array, Array]
"""Complex amplitudes, and E|error|^2 of each."""


@dataclass(frozen=True)
class Line:
    """A line in a channel that no excitation made, such as mains hum: its frequency, Hz, and amplitude."""

    frequency_Hz: float
    amplitude: float


@dataclass(frozen=True, kw_only=True)
class SteadyState:
    """One measured step: x(t) = sum_h Re(Z_h exp(j h omega t)) from the stretch's start."""

    run: str
    sweep: str
    """Where it was measured."""
    index: int
    """Of the step in its sweep."""
    frequency_Hz: float
    target_channel: str
    target_amplitude: float
    """As commanded."""
    time_s: float
    """Of the stretch's middle, on the recording's own time base."""
    amplitude: dict[str, Array]
    """Complex harmonics 1 ... H of each channel, in its unit, up to what an anti-aliasing filter passes."""
    variance: dict[str, Array]
    """E|error of Z_h|^2 of each channel's harmonics."""
    drift: dict[str, complex]
    """Change of the fundamental over the stretch, relative to it."""
    drift_std: dict[str, float]
    """Standard deviation of its real and of its imaginary part."""
    lost: int
    overloaded: int
    """Samples of the stretch that are missing in some channel; samples on a converter's limit."""
    duration_s: float
    """Of the stretch."""
    up_to_nyquist: dict[str, dict[str, Harmonics]] = field(default_factory=dict)
    """By device and channel, amplitude and variance of all harmonics up to the Nyquist frequency: above what the filter
    passes sizes mean nothing, but one device's filters are alike, and so ratios of its channels do."""

    @property
    def omega(self) -> float:
        """Drive frequency in rad/s."""
        return 2 * np.pi * self.frequency_Hz

    def ratio(self, one: str, other: str) -> tuple[Array, Array]:
        """Harmonics of one channel over those of another, and their relative errors; none if two devices have them."""
        for measured in self.up_to_nyquist.values():
            if one in measured and other in measured:
                (A, A_variance), (B, B_variance) = measured[one], measured[other]
                A, B = (np.where(Z == 0, 1e-60, Z) for Z in (A, B))
                return A / B, np.sqrt(A_variance / np.abs(A) ** 2 + B_variance / np.abs(B) ** 2)
        return np.zeros(0, complex), np.zeros(0)

    def change(self, channel: str, *, force: str) -> complex:
        """Relative change of a channel's fundamental over the stretch, without the force's own turn of phase.

        Where the sampling clock is wrong all channels turn together, and nothing is unsettled by that.
        """
        return self.drift[channel] - 1j * self.drift[force].imag

    def change_sigma(self, channel: str, *, force: str) -> float:
        """:meth:`change` in standard deviations, each of its parts in its own.

        The turn of phase has the noise of both channels.  Where the force is small that of its cell is by far the
        larger one.
        """
        change, own, other = self.change(channel, force=force), self.drift_std[channel], self.drift_std[force]
        return float(np.hypot(change.real / own, change.imag / np.hypot(own, other)))


def steady_states(
    run: Run, *, channels: Sequence[str] | None = None, lines: Mapping[str, Line] | None = None
) -> list[SteadyState]:
    """Fit every measured sine step of `run`.

    Parameters
    ----------
    run
        A recorded run; broadband stretches (frequency 0) are passed over.
    channels
        The channels to fit; all by default.
    lines
        Foreign lines by channel: fitted beside the harmonics, and counted as noise of the harmonic that they fall on.

    Notes
    -----
    A step is dropped if less than two periods, fewer than sixteen sound samples, or fewer than three in four of some
    channel remain: what is missing in every period, as clipped peaks are, the others cannot make good.
    """
    names = list(channels or run.channels)
    measured = [stretch for stretch in measured_stretches(run) if stretch.step.frequency_Hz > 0]
    measured.sort(key=lambda stretch: stretch.start_ns)
    states = [_fit(run, stretch, names, lines or {}) for stretch in measured]
    return [state for state in states if state is not None]


def _fit(run: Run, stretch: Stretch, names: list[str], lines: Mapping[str, Line]) -> SteadyState | None:
    step = stretch.step
    omega = 2 * np.pi * step.frequency_Hz
    amplitude, variance, drift, drift_std = {}, {}, {}, {}
    up_to_nyquist: dict[str, dict[str, Harmonics]] = {}
    together: dict[tuple[str, int, bytes, Line | None], tuple[_Shapes, list[str]]] = {}
    lost = overloaded = 0
    for name in names:
        device, limit = run.device_of(name), run.channels[name].range
        first, last = device.position_at(stretch.start_ns), device.position_at(stretch.stop_ns)
        known = []
        for piece in pieces(device.values[name], first, last):
            known.append(np.isfinite(piece))
            if limit is not None:
                overloaded += int(np.sum(np.abs(piece[known[-1]].astype(float)) >= limit * (1 - 1e-6)))
        sound = np.concatenate([*known, np.zeros(0, bool)])
        lost = max(lost, int(np.sum(~sound)))
        periods = (sound.sum() - 1) / device.sample_rate_Hz * step.frequency_Hz
        if sound.sum() < 16 or sound.mean() < LIMITS.least_sound or periods < 2:
            return None
        shapes = _Shapes.of(device, first, sound, stretch.start_ns, omega, lines.get(name))
        # The channels of one device share their instants, and with them the costly part of the fit.
        key = (device.device, first, sound.tobytes(), lines.get(name))
        together.setdefault(key, (shapes, []))[1].append(name)
    fits = {
        name: fit
        for shapes, alike in together.values()
        for name, fit in zip(alike, _fit_channels(shapes, alike), strict=True)
    }
    for name in names:
        device, fit = run.device_of(name), fits[name]
        passed = max(1, int(LIMITS.sine_fit_passed * device.sample_rate_Hz / step.frequency_Hz))
        amplitude[name], variance[name] = fit[0][:passed], fit[1][:passed]
        up_to_nyquist.setdefault(device.device, {})[name] = fit[:2]
        drift[name], drift_std[name] = fit[2:]
    return SteadyState(
        run=run.path,
        sweep=step.sweep,
        index=step.index,
        frequency_Hz=step.frequency_Hz,
        target_channel=step.target_channel,
        target_amplitude=step.target_amplitude,
        time_s=(stretch.start_ns + stretch.stop_ns) / 2 * 1e-9,
        amplitude=amplitude,
        variance=variance,
        drift=drift,
        drift_std=drift_std,
        lost=lost,
        overloaded=overloaded,
        duration_s=(stretch.stop_ns - stretch.start_ns) * 1e-9,
        up_to_nyquist=up_to_nyquist,
    )


@dataclass(frozen=True)
class _Shapes:
    """Columns of the least-squares fit at given instants: cosines, minus sines, a line, a constant, the drift.

    A line too `near` to a harmonic to be told from it is not fitted but leaks.
    """

    device: DeviceSamples
    first: int
    sound: NDArray[np.bool_]
    start_ns: int
    omega: float
    count: int
    line: Line | None
    near: bool = False

    @staticmethod
    def of(
        device: DeviceSamples, first: int, sound: NDArray[np.bool_], start_ns: int, omega: float, line: Line | None
    ) -> _Shapes:
        """Those of as many samples from a position on as `sound` tells which are known of."""
        known = int(np.sum(sound))
        count = int(min(MOST_HARMONICS, 0.98 * np.pi * device.sample_rate_Hz / omega, (known - 1) // 4))
        shapes = _Shapes(device, first, sound, start_ns, omega, count, line)
        if line is None:
            return shapes
        drive = omega / (2 * np.pi)
        order = round(line.frequency_Hz / drive)
        apart = abs(line.frequency_Hz - order * drive) * shapes.known_s
        return replace(shapes, near=0 < order <= count and apart < LIMITS.sine_fit_apart)

    @cached_property
    def known(self) -> int:
        """How many samples are known."""
        return int(np.sum(self.sound))

    @cached_property
    def known_s(self) -> float:
        """From the first of them to the last."""
        first, last = np.flatnonzero(self.sound)[[0, -1]].tolist()
        return float(self.time_s(slice(last, last + 1))[0] - self.time_s(slice(first, first + 1))[0])

    @cached_property
    def _middle_s(self) -> float:
        return sum(float(np.sum(self.time_s(rows))) for rows in self._rows(slice(0, len(self.sound)))) / self.known

    def parts(self) -> Iterator[slice]:
        """The stretch in as few parts of about one length as make one spectrum each, but for those mostly lost."""
        count = -(-len(self.sound) // LIMITS.sine_fit_samples)
        edges = np.linspace(0, len(self.sound), count + 1).astype(int).tolist()
        return (slice(*ends) for ends in pairwise(edges) if np.mean(self.sound[slice(*ends)]) > 0.5)

    def blocks(self, part: slice) -> Iterator[tuple[slice, Array]]:
        """Columns, some rows at a time: those of a long step at a high rate are hundreds of megabytes."""
        if len(self.sound) <= LIMITS.sine_fit_rows:
            yield part, self._all
            return
        for rows in self._rows(part):
            yield rows, self._columns(rows)

    @staticmethod
    def _rows(part: slice) -> Iterator[slice]:
        each = LIMITS.sine_fit_rows
        return (slice(first, min(first + each, part.stop)) for first in range(part.start, part.stop, each))

    def samples(self, channels: Sequence[str], rows: slice) -> Array:
        """Those of some channels that are known, (n, channels)."""
        taken = slice(self.first + rows.start, self.first + rows.stop)
        return np.stack([self.device.values[name][taken][self.sound[rows]] for name in channels], axis=1).astype(float)

    def time_s(self, rows: slice) -> Array:
        """When they were taken, since the stretch began."""
        stamps = self.device.times_ns(self.first + rows.start, self.first + rows.stop)
        return np.asarray((stamps[self.sound[rows]] - self.start_ns) * 1e-9)

    @cached_property
    def _all(self) -> Array:
        return self._columns(slice(0, len(self.sound)))

    def _columns(self, rows: slice) -> Array:
        time = self.time_s(rows)
        turn = np.exp(1j * self.omega * time)[:, None]
        harmonics = np.cumprod(np.broadcast_to(turn, (len(time), self.count)), axis=1)
        cosine, sine = harmonics.real, harmonics.imag
        centred = (time - self._middle_s) / self.known_s
        # The slow columns take up a decay that is still going on, which else would look like noise.
        slow = np.stack([np.ones(len(time)), centred * cosine[:, 0], -centred * sine[:, 0]], axis=1)
        return np.hstack([cosine, -sine, *([] if self.near else [self.foreign(rows)]), slow])

    def foreign(self, rows: slice) -> Array:
        """Cosine and sine of the line, or no columns."""
        time = self.time_s(rows)
        if self.line is None:
            return np.zeros((len(time), 0))
        turn = 2 * np.pi * self.line.frequency_Hz * time
        return np.stack([np.cos(turn), np.sin(turn)], axis=1)


def _fit_channels(shapes: _Shapes, channels: Sequence[str]) -> list[tuple[Array, Array, complex, float]]:
    """Of each channel: harmonics, their variances, the relative drift of the fundamental, its standard deviation."""
    count, known = shapes.count, shapes.known
    gram, right, foreign = np.zeros(()), np.zeros(()), np.zeros(())
    for rows, basis in shapes.blocks(slice(0, len(shapes.sound))):
        gram = gram + basis.T @ basis
        right = right + basis.T @ shapes.samples(channels, rows)
        if shapes.near:
            foreign = foreign + basis.T @ shapes.foreign(rows)
    # Over two periods and more the columns are nearly orthogonal: normal equations lose nothing.
    ridge = 1e-12 * np.trace(gram) / len(gram)
    factor = cho_factor(gram + ridge * np.eye(len(gram)))
    leak = np.zeros(count + 1)  # the variance that the line adds to each harmonic, and to the drift as the last
    if shapes.line is not None and shapes.near:
        into = cho_solve(factor, foreign)
        power = np.concatenate([into[:count] ** 2 + into[count : 2 * count] ** 2, [np.sum(into[-2:] ** 2, axis=0)]])
        leak = shapes.line.amplitude**2 * power.mean(axis=1)
    # Each harmonic's variance over what the same noise would make of it in whole periods: where clipped peaks are
    # missing, the highest harmonics can hide in the gaps.
    own = np.diag(cho_solve(factor, np.eye(len(gram))))
    spread = (own[:count] + own[count : 2 * count]) * known / 4
    solutions = cho_solve(factor, right)
    noise, seen = np.zeros((len(channels), count)), 0.0
    for part in shapes.parts():
        residual = np.concatenate(
            [shapes.samples(channels, rows) - basis @ solutions for rows, basis in shapes.blocks(part)]
        )
        time, share = shapes.time_s(part), len(residual) / known
        seen += share
        # The longer the time, the less noise a line of it holds.
        noise += share**2 * _noise_beside(residual, time, shapes.omega, count)
    freedom = max(1, known - len(gram))
    fits = []
    for solution, beside in zip(solutions.T, noise, strict=True):
        Z = solution[:count] + 1j * solution[count : 2 * count]
        variance = beside / seen * known / freedom * spread + leak[:-1]
        change = complex(solution[-2], solution[-1]) / Z[0] if Z[0] else 0j
        # Var of a slope over a unit interval is 12 times that of the mean; half of it falls on each of the two parts.
        drift_variance = 12 * variance[0] / 2 + leak[-1]
        fits.append((Z, variance, change, float(np.sqrt(drift_variance) / max(abs(Z[0]), 1e-300))))
    return fits


def _noise_beside(residual: Array, time: Array, omega: float, count: int) -> Array:
    """Mean squared amplitude of the channels' residuals' (n, c) spectral lines beside each harmonic, (c, count).

    The fit has taken the harmonics' own lines out of the residual, so lines closer than 1.5 / duration are left out.
    """
    duration = (time[-1] - time[0]) * len(time) / max(len(time) - 1, 1)
    lines = np.abs(2 * np.fft.rfft(residual, axis=0) / len(residual)) ** 2
    frequency = np.arange(len(lines)) / duration
    harmonic = np.rint(frequency * 2 * np.pi / omega) * omega / (2 * np.pi)
    beside = np.abs(frequency - harmonic) >= LIMITS.sine_fit_apart / duration
    beside[0] = False
    # Of three periods or less every line is a harmonic's neighbour: the residual's power is spread over all lines then.
    every = np.mean(lines[beside] if beside.any() else 4 * residual**2 / len(residual), axis=0)
    out = np.empty((residual.shape[1], count))
    for h in range(1, count + 1):
        centre = round(h * omega / (2 * np.pi) * duration)
        near = slice(max(1, centre - LIMITS.sine_fit_neighbours), centre + LIMITS.sine_fit_neighbours + 1)
        out[:, h - 1] = np.mean(lines[near][beside[near]], axis=0) if beside[near].any() else every
    return np.maximum(out, np.finfo(float).tiny)
