"""Lines beside the drive's own: a rig that changes by itself while it is driven, or that answers at a fraction of it.

Whatever goes by the motion alone repeats with the drive, and leaves nothing between its harmonics but noise.  So lines
there that keep their distance to the drive from step to step are evidence for something that no listed cause does.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from recordings.run import Run
from recordings.sweeps import Stretch, sweeps
from twin.arrays import Array
from twin.diagnose.signals.limits import LIMITS
from twin.diagnose.signals.remainder import remainders
from twin.identify.spectra.sine_fit import Line, SteadyState
from twin.identify.spectra.sweeps import rows_by_sweep

MOST_STEPS, LEAST_STEPS = 48, 8


@dataclass(frozen=True)
class Sidebands:
    """The clearest lines beside the drive's."""

    channel: str
    offset_Hz: float
    """Their distance to the drive, in the middle of the steps."""
    power: float
    """Over that of the noise there, median of the steps."""
    log_bayes: float
    """How much more probable they make something that is on no list than noise, nats."""

    @property
    def told(self) -> str:
        """One sentence."""
        return (
            f"{self.channel} holds lines {self.offset_Hz:.3g} Hz beside the drive's, of {self.power:.3g} times the "
            "noise's power: something changes the rig by itself, which no listed cause does"
        )


def find_sidebands(
    runs: Sequence[Run],
    channels: Sequence[str],
    lines: Mapping[str, Line],
    *,
    unsettled: Sequence[SteadyState] = (),
    resonance_Hz: Mapping[tuple[str, str], float] | None = None,
) -> Sidebands | None:
    """Look for them in the sine steps of some channels, in which samples may be missing; None where noise will do.

    Parameters
    ----------
    lines
        Foreign ones by channel, such as mains hum: they keep their frequency instead.
    unsettled
        Steps in which the rig still rings at its own frequency, which are not looked at.
    resonance_Hz
        By run and sweep: there it rings a little in every step, and makes more of any noise that drives it.
    """
    ringing = {(state.run, state.sweep, state.index) for state in unsettled}
    stretches = [(run, stretch) for run in runs for sweep in sweeps(run) for stretch in sweep.stretches]
    stretches = [
        (run, stretch)
        for run, stretch in stretches
        if stretch.step.frequency_Hz > 0 and (run.path, stretch.step.sweep, stretch.step.index) not in ringing
    ]
    stretches = stretches[:: -(-len(stretches) // MOST_STEPS) or 1]
    best: Sidebands | None = None
    for channel in channels:
        powers = [
            _powers(
                run, stretch, channel, lines.get(channel),
                own_Hz=(resonance_Hz or {}).get((run.path, stretch.step.sweep), np.inf),
            )
            for run, stretch in stretches
        ]  # fmt: skip
        seen = [one for one in powers if one is not None]
        if len(seen) < LEAST_STEPS:
            continue
        table = np.vstack(seen)
        count = np.isfinite(table).sum(axis=0)
        looked_at = np.flatnonzero(count >= 2 * LEAST_STEPS)
        count = count[looked_at]
        power = np.nanmedian(table[:, looked_at], axis=0) / np.log(2)
        log_bayes = np.where(power > 1, count * (power - 1 - np.log(power)), 0.0) - np.log(
            len(looked_at) * len(channels)
        )
        k = int(np.argmax(log_bayes))
        if log_bayes[k] > (best.log_bayes if best else LIMITS.least_log_bayes):
            middle = float(np.median([stretch.step.frequency_Hz for _, stretch in stretches]))
            offset = float(_offsets(middle)[looked_at[k]])
            best = Sidebands(channel, offset, float(power[k]), float(log_bayes[k]))
    return best


def loudest_Hz(states: Sequence[SteadyState], channels: Sequence[str], *, force: str) -> dict[tuple[str, str], float]:
    """Where the responses to a newton are largest, by run and sweep: about there the rig rings by itself."""
    found = {}
    for rows in rows_by_sweep(states).values():
        own = [states[i] for i in rows]
        size = np.array([[abs(s.amplitude[c][0] / (s.amplitude[force][0] or 1e-60)) for c in channels] for s in own])
        loudest = own[int(np.argmax(np.sum(size / size.max(axis=0).clip(1e-60), axis=1)))]
        found[loudest.run, loudest.sweep] = loudest.frequency_Hz
    return found


def _offsets(frequency_Hz: float) -> Array:
    """Distances to a drive that are looked at, Hz."""
    return np.append(
        np.arange(LIMITS.sidebands_apart_Hz, LIMITS.sidebands_farthest_Hz, LIMITS.sidebands_apart_Hz),
        [(1 - part) * frequency_Hz for part in LIMITS.sidebands_fractions],
    )


def _powers(run: Run, stretch: Stretch, channel: str, line: Line | None, *, own_Hz: float) -> Array | None:
    """Power on both sides of the drive, (2, offsets), over the noise's; NaN too near to the drive's line or to own."""
    x = run.between(channel, stretch.start_ns, stretch.stop_ns)[: LIMITS.sidebands_samples].astype(float)
    rate, drive = run.device_of(channel).sample_rate_Hz, stretch.step.frequency_Hz
    if len(x) < 64 or not np.isfinite(x).all():
        return None
    t, length = np.arange(len(x)) / rate, len(x) / rate
    orders = np.arange(1, min(12, int(0.45 * rate / drive)) + 1)

    def repeating(at: Array) -> Array:
        angle = 2 * np.pi * drive * t[at, None] * orders
        slow = (t[at, None] / length - 0.5) ** np.arange(4)  # a transient may die within the step
        turn = 2 * np.pi * line.frequency_Hz * t[at, None] if line else np.zeros((len(at), 0))
        first = [np.cos(angle[:, :1]) * slow[:, 1:], np.sin(angle[:, :1]) * slow[:, 1:]]
        return np.hstack([np.cos(angle), np.sin(angle), slow, *first, np.cos(turn), np.sin(turn)])

    left = np.concatenate([rest[:, 0] for _, rest in remainders(len(x), lambda at: x[at, None], repeating)])
    padded = 1 << (4 * len(x) - 1).bit_length()
    lines = np.abs(np.fft.fft(left * np.exp(-2j * np.pi * drive * t), padded)) ** 2
    nearest = LIMITS.sidebands_nearest / length

    def both_sides(offsets: Array) -> Array:
        found = []
        for sign in (-1, 1):
            hidden = (offsets < nearest) | (offsets > drive - nearest)
            hidden |= np.abs(drive + sign * offsets - own_Hz) < nearest
            found.append(np.where(hidden, np.nan, lines[sign * np.rint(offsets / rate * padded).astype(int)]))
        return np.array(found)

    offsets = _offsets(drive)
    power = both_sides(offsets)
    if not np.isfinite(power).any():
        return None
    # The noise about each, where it is larger than elsewhere: that of some instruments grows towards low frequencies.
    away = nearest * np.arange(1.0, 3.5, 0.5)
    noise = np.full(power.shape, np.nanmedian(power))
    around = both_sides(offsets[:, None] + np.append(-away, away))
    told = np.isfinite(around).any(axis=-1)
    noise[told] = np.maximum(noise[told], np.nanmedian(around[told], axis=-1))
    return np.asarray(power / np.maximum(noise / np.log(2), np.finfo(float).tiny))
