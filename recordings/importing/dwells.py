"""Steps of a stepped sine in the signals themselves: where a sine keeps its frequency and size, and is settled."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from recordings.importing.phasor_track import HOP, Part, straight_parts, track

Array = NDArray[np.float64]

SINE = 0.6
"""Share of a frame's power in one spectral line from which on the frame holds a sine; noise has far less."""
LEAST_PERIODS = 10
"""Of a step that is measured: identification needs several, and the window's ends take some."""
SHORT = 0.4
"""Of the usual step's duration; what is shorter is a transient between two steps."""
SAME_TURN, SAME_SIZE = 4e-3, 0.03
"""Difference in periods over the shorter one, and relative in size, up to which two stretches are one step: a quarter
of what the finest usual grids have."""
SETTLED = 1e-3
"""Relative change of a phasor up to which a channel is settled, as far as its noise lets that be seen: half of what
identification takes for a change."""
MORE_REST, LEAST_REST = 2.0, 2e-3
"""What is left of a signal beside its sine in a period that still belongs to a step: times that within it, and
relative to the sine."""
BLOCKS = 8
"""Of a step, in which it is looked for when every channel had settled."""
COVERED = 0.5
"""Share of the time that steps must fill; else it is no stepped sine."""


@dataclass(frozen=True, kw_only=True)
class Dwell:
    """One step: samples `begin` to `settled` it waited, from there to `end` it was steady.

    `size` is the amplitude of the signal in which it was found; `still` whether every channel had settled.
    """

    begin: int
    settled: int
    end: int
    frequency_Hz: float
    size: float
    still: bool


def find_dwells(signals: Sequence[Array], rate_Hz: float, *, followed: int) -> tuple[list[Dwell], int] | None:
    """The steps of a stepped sine, and the place of the signal in which they were found.

    Parameters
    ----------
    signals : each shape (n,)
        Finite.
    followed
        So many of them, from the first on, may show the steps; the others must have settled.
    rate_Hz
        Sample rate.

    Returns
    -------
    tuple of list of Dwell and int, or None
        None if no signal is a sine for most of the time, or none keeps its frequency in steps.
    """
    for place, signal in enumerate(signals[:followed]):
        coarse = _coarse(signal, rate_Hz)
        if coarse is None:
            continue
        stretches = _joined(straight_parts(*track(signal, rate_Hz, *coarse)))
        dwells = [_dwell(signals, place, each, rate_Hz) for each in stretches]
        if dwells and sum(each.end - each.begin for each in dwells) > COVERED * len(signal):
            return _closed(dwells), place
    return None


def _coarse(signal: Array, rate_Hz: float) -> tuple[Array, Array] | None:
    """Middles of frames, s, and the strongest frequency of each, Hz; None if most are no sine."""
    if len(signal) < 256 or not np.ptp(signal) > 0:
        return None
    frequency, power = welch(signal, rate_Hz, nperseg=min(len(signal), int(4 * rate_Hz)), detrend="linear")
    total = np.cumsum(power)
    lowest = max(float(frequency[np.searchsorted(total, 0.02 * total[-1])]), 2 * float(frequency[1]))
    length = min(int(10 * rate_Hz / lowest), len(signal))
    if length < 16:
        return None
    starts = np.arange(0, len(signal) - length + 1, max(length // 2, 1))
    window, padded = np.hanning(length), 4 * length
    found, shares = np.empty(len(starts)), np.empty(len(starts))
    for at, start in enumerate(starts):
        frame = signal[start : start + length]
        lines = np.abs(np.fft.rfft((frame - frame.mean()) * window, padded)) ** 2
        peak = int(np.argmax(lines))
        found[at] = peak * rate_Hz / padded
        shares[at] = lines[max(peak - 8, 0) : peak + 9].sum() / max(lines.sum(), 1e-300)
    if np.median(shares) <= SINE:
        return None
    return (starts + length / 2) / np.float64(rate_Hz), np.maximum(found, rate_Hz / length)


def _joined(parts: Sequence[Part]) -> list[Part]:
    """Steps: parts of one step put together, transients left out."""
    whole = _put_together([each for each in parts if (each.end_s - each.begin_s) * each.frequency_Hz > HOP + 1])
    if not whole:
        return []
    lengths = np.sort([each.end_s - each.begin_s for each in whole])
    usual = float(lengths[np.searchsorted(np.cumsum(lengths), lengths.sum() / 2)])  # half of the time is in longer ones
    long = [
        each
        for each in whole
        if each.end_s - each.begin_s > SHORT * usual and (each.end_s - each.begin_s) * each.frequency_Hz > LEAST_PERIODS
    ]
    return _put_together(long)


def _put_together(parts: Sequence[Part]) -> list[Part]:
    """Neighbours of one frequency and size as one, with the frequency of the longer."""
    steps: list[Part] = []
    for each in parts:
        if steps:
            before = steps[-1]
            shorter, longer = sorted((before, each), key=lambda one: one.end_s - one.begin_s)
            turn = abs(each.frequency_Hz - before.frequency_Hz) * (shorter.end_s - shorter.begin_s)
            if turn < SAME_TURN and abs(each.log_size - before.log_size) < SAME_SIZE:
                steps[-1] = replace(longer, begin_s=before.begin_s, end_s=each.end_s)
                continue
        steps.append(each)
    return steps


def _dwell(signals: Sequence[Array], followed: int, part: Part, rate_Hz: float) -> Dwell:
    """A step to the sample: from where the followed signal keeps to its sine, and from when on all are settled."""
    first, last, frequency = round(part.begin_s * rate_Hz), round(part.end_s * rate_Hz), part.frequency_Hz
    period = rate_Hz / frequency
    models = [_Model(signal, first, last, frequency / rate_Hz) for signal in signals]
    begin, end = float(first), float(last)
    while end + period <= len(signals[0]) and all(each.holds(int(end), int(end + period)) for each in models):
        end += period
    while begin - period >= 0 and models[followed].holds(int(begin - period), int(begin)):
        begin -= period
    edges = np.linspace(begin, end, BLOCKS + 1)
    parts = [[each.phasor(int(a), int(b)) for a, b in itertools.pairwise(edges)] for each in models]
    settled = max(_settled(np.array(part), each.scatter) for part, each in zip(parts, models, strict=True))
    still = settled <= BLOCKS // 2
    start = edges[min(settled, BLOCKS // 2)]
    return Dwell(
        begin=int(begin), settled=int(start), end=int(end), frequency_Hz=frequency,
        size=float(abs(parts[followed][-1])), still=still,
    )  # fmt: skip


class _Model:
    """Three harmonics and a mean of one signal within a step."""

    def __init__(self, signal: Array, first: int, last: int, turns: float) -> None:
        self._signal, self._turns = signal, turns
        self._solution = np.linalg.lstsq(self._shapes(first, last), signal[first:last], rcond=None)[0]
        rest = signal[first:last] - self._shapes(first, last) @ self._solution
        self._rest = float(np.sqrt(np.mean(rest**2)))
        size = float(np.hypot(*self._solution[1:3]))
        per_block = max((last - first) / BLOCKS, 1.0)
        self.scatter = 2 * self._rest / max(size, 1e-300) / np.sqrt(per_block)
        """Standard deviation of a block's phasor, relative to it."""
        self._size = size

    def _shapes(self, first: int, last: int) -> Array:
        angle = 2 * np.pi * self._turns * np.arange(first, last)
        waves = [wave(order * angle) for order in (1, 2, 3) for wave in (np.cos, np.sin)]
        return np.stack([np.ones(last - first), *waves], axis=1)

    def holds(self, first: int, last: int) -> bool:
        """Whether the signal keeps to the model here as well as where it was fitted."""
        rest = self._signal[first:last] - self._shapes(first, last) @ self._solution
        return bool(np.sqrt(np.mean(rest**2)) < MORE_REST * self._rest + LEAST_REST * self._size)

    def phasor(self, first: int, last: int) -> complex:
        """Of the fundamental from here to there."""
        one = np.linalg.lstsq(self._shapes(first, last), self._signal[first:last], rcond=None)[0]
        return complex(one[1], -one[2])


def _settled(phasors: NDArray[np.complex128], scatter: float) -> int:
    """The first block from which on all are like the last one."""
    off = np.abs(phasors / (phasors[-1] if phasors[-1] else 1.0) - 1) > max(SETTLED, 5 * scatter)
    return int(np.flatnonzero(off)[-1]) + 1 if off.any() else 0


def _closed(dwells: list[Dwell]) -> list[Dwell]:
    """Steps that do not overlap, each waiting from the end of the one before."""
    closed: list[Dwell] = []
    for each in dwells:
        before = closed[-1].end if closed else each.begin
        settled = max(each.settled, before)
        if settled < each.end:
            closed.append(replace(each, begin=min(before, settled), settled=settled))
    return closed
