"""Frequency responses of an impact test: windows, averages over the hits of each point, coherence.

An exponential window on force and response alike, exp(-a t), moves the frequency axis to s = j omega + a: the ratio is
the structure's response there, its poles shifted by a and nothing else, so that the damping it adds comes off exactly.
The pulse is cut out by a force window, which leaves the noise of the rest of the record out of the force.

H1 = S_xf / S_ff is unbiased where the responses alone are noisy, H2 = S_xx / S_fx where the force is; Hv, their
geometric mean, is total least squares with both spectra scaled alike (Rocklin, Crowley and Vold, IMAC 1985).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal.windows import tukey

from twin.arrays import Array
from twin.identify.impacts.hits import HitRecord, Hits
from twin.identify.limits import LIMITS
from twin.identify.responses.limits import LIMITS as RESPONSES
from twin.identify.rms import rms

Estimator = Literal["H1", "H2", "Hv"]


@dataclass(frozen=True, kw_only=True)
class Reduction:
    """How hits are reduced."""

    estimator: Estimator = "H1"
    force_window_s: float | None = None
    """Kept of the force before and after its peak; None for the pulse with its filtering."""
    left: float | None = None
    """What the exponential window leaves at the record's end, 1 for none; None for as much as the decay needs."""


@dataclass(frozen=True, kw_only=True)
class ImpactResponses:
    """Averaged responses of every channel to a force at every point."""

    points: tuple[str, ...]
    channels: tuple[str, ...]
    """Of p and o."""
    frequency_Hz: Array
    """Within the band that the pulses excite, (f,)."""
    H: Array
    """Complex, at s = j omega + `rate_per_s`, in the channels' units per newton, (f, p, o)."""
    coherence: Array
    """One everywhere where a point was hit once, (f, p, o)."""
    std: Array
    """Root of the complex variance: the coherence's, and no better than a lab reproduces a response, (f, p, o)."""
    rate_per_s: float
    """Of the exponential window."""
    notes: tuple[str, ...]
    """What is wrong with windows or hits, and what was done about it."""


def reduce_hits(hits: Hits, how: Reduction, *, band_Hz: tuple[float, float] | None = None) -> ImpactResponses:
    """Average the hits of each point.

    Parameters
    ----------
    band_Hz
        Where to look; where the hits excite if not given.

    Raises
    ------
    ValueError
        If the band has no lines.
    """
    remains, moving = _ends(hits)
    rest_s = (hits.length - min(hit.top for hit in hits.each)) / hits.sample_rate_Hz
    share = how.left if how.left is not None else min(1.0, LIMITS.window_wanted / max(remains, 1e-12))
    rate = -float(np.log(share)) / rest_s
    spectra = {
        point: [_spectra(hits, one, how.force_window_s, rate) for one in own] for point, own in hits.records.items()
    }
    frequency = np.fft.rfftfreq(hits.length, 1 / hits.sample_rate_Hz)
    power = np.mean([np.abs(F) ** 2 for own in spectra.values() for F, _ in own], axis=0)
    weak = np.flatnonzero((power < LIMITS.excited * power.max()) & (frequency > frequency[int(np.argmax(power))]))
    top_Hz = min(LIMITS.sine_fit_passed * hits.sample_rate_Hz, frequency[weak[0]] if len(weak) else np.inf)
    low, high = band_Hz or (LIMITS.lowest_line / rest_s, top_Hz)
    inside = (frequency >= low) & (frequency <= min(high, top_Hz)) & (frequency > 0)
    if not inside.any():
        raise ValueError(f"the hits excite up to {top_Hz:.4g} Hz: no lines in the band")
    averaged = [_averaged(own, inside, how.estimator) for own in spectra.values()]
    H, coherence, std = (np.stack(each, axis=1) for each in zip(*averaged, strict=True))
    return ImpactResponses(
        points=tuple(hits.records), channels=hits.channels, frequency_Hz=frequency[inside], H=H, coherence=coherence,
        std=std, rate_per_s=rate,
        notes=(*hits.set_aside, *_notes(hits, how, remains, moving, share)),
    )  # fmt: skip


def _spectra(hits: Hits, hit: HitRecord, force_window_s: float | None, rate: float) -> tuple[Array, Array]:
    """Spectra of the windowed force (n,) and of the windowed responses (n, o) of one hit."""
    record, top, half = hit.record, hit.top, hit.half
    force = record.samples[hits.force][: hits.length]
    if force_window_s is not None:
        half = max(1, round(force_window_s * hits.sample_rate_Hz))
    rest = force[: max(1, top - half)]
    window = np.zeros(hits.length)
    first, last = max(0, top - half), min(hits.length, top + half + 1)
    window[first:last] = tukey(last - first, LIMITS.force_taper)
    decay = np.exp(-rate * (np.arange(hits.length) - top) / hits.sample_rate_Hz)
    F = np.fft.rfft((force - np.mean(rest)) * window * decay)
    frequency = np.fft.rfftfreq(hits.length, 1 / hits.sample_rate_Hz)
    X = []
    for name in hits.channels:
        late = record.late_s.get(name, 0.0) - record.late_s.get(hits.force, 0.0)
        X.append(np.fft.rfft(record.samples[name][: hits.length] * decay) * np.exp(-2j * np.pi * frequency * late))
    return F, np.stack(X, axis=1)


def _averaged(own: list[tuple[Array, Array]], inside: Array, estimator: Estimator) -> tuple[Array, Array, Array]:
    """Response, coherence and standard deviation, (f, o) each, of one point."""
    F = np.stack([each for each, _ in own])[:, inside, None]
    X = np.stack([each for _, each in own])[:, inside]
    S_ff, S_xx = np.mean(np.abs(F) ** 2, axis=0), np.mean(np.abs(X) ** 2, axis=0)
    S_xf = np.mean(X * np.conj(F), axis=0)
    tiny = np.finfo(float).tiny
    coherence = np.minimum(np.abs(S_xf) ** 2 / np.maximum(S_ff * S_xx, tiny), 1.0)
    H = S_xf / S_ff
    if estimator != "H1":
        H = H / np.maximum(coherence, 1e-9) ** (1.0 if estimator == "H2" else 0.5)
    n, size = len(own), np.abs(H)
    # Few hits tell the coherence of one line badly: the variance of its neighbourhood.
    variance = (1 - coherence) / (n * np.maximum(coherence, 1e-9)) * size**2
    variance = uniform_filter1d(variance, LIMITS.coherent_lines, axis=0, mode="nearest")
    return H, coherence, np.sqrt(variance + (RESPONSES.reproduced * size) ** 2 + tiny)


def _ends(hits: Hits) -> tuple[float, float]:
    """What is left of the response at the records' ends, and what was there before the hits, over its beginning.

    Medians over the hits, of the channel that is worst.
    """
    remains, moving = [], []
    for hit in hits.each:
        top = hit.top
        after = max(1, (hits.length - top) // 10)
        ends = []
        for name in hits.channels:
            x = hit.record.samples[name][: hits.length]
            before, first, last = x[: max(1, top - hit.half)], x[top : top + after], x[-after:]
            begin = rms(first)
            quiet = rms(np.diff(before) / np.sqrt(2)) if len(before) > 2 else 0.0
            ends.append([np.sqrt(max(rms(each) ** 2 - quiet**2, 0.0)) / begin for each in (last, before)])
        remains.append([end for end, _ in ends])
        moving.append([start for _, start in ends])
    return float(np.max(np.median(remains, axis=0))), float(np.max(np.median(moving, axis=0)))


def _notes(hits: Hits, how: Reduction, remains: float, moving: float, share: float) -> Iterator[str]:
    """What windows and hits do to the data."""
    needed_s = (float(np.median([hit.half for hit in hits.each])) - LIMITS.pulse_ringing) / hits.sample_rate_Hz
    if how.force_window_s is not None and how.force_window_s < needed_s:
        yield (
            f"wrong window: the force window of {1e3 * how.force_window_s:.3g} ms cuts the pulse, which needs "
            f"{1e3 * needed_s:.3g} ms to either side of its peak"
        )
    if remains * share > LIMITS.window_leaks:
        wanted = LIMITS.window_wanted / remains
        what = "with the exponential window given" if share < 1 else "without an exponential window"
        yield (
            f"wrong window: {what}, {remains * share:.2g} of the response is left where the record ends, and its "
            f"resonances leak; let the window end at {min(wanted, 1.0):.2g}, or record longer"
        )
    elif share < 1 and how.left is None:
        yield f"the response has decayed to {remains:.2g} at the record's end: exponential window to {share:.2g} there"
    if moving > LIMITS.moving_before:
        yield f"the structure still moved, by {moving:.2g} of the response, when it was hit: wait longer between hits"
    few = [point for point, own in hits.records.items() if len(own) == 1]
    if few:
        yield f"point{'s' if len(few) > 1 else ''} {', '.join(few)}: one hit has no coherence; hit at least three times"
