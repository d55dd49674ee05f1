"""Broadband records as frequency responses in bins, each with its covariance.

Within a bin, which is narrow beside the distance to the nearest resonance, the response is a reference model's plus a
constant, found by least squares on the record's own spectral lines: no window, no leakage, because the transient of
the record's ends is fitted with the reference model's poles and taken off.  The noise is estimated from what the
constants leave: white noise of each channel, noise of the force (which all channels then share), and more where the
joint's nonlinearity under broadband excitation distorts the lines.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import percentile_filter
from scipy.optimize import nnls
from scipy.signal import find_peaks

from twin.arrays import Array
from twin.identify.limits import LIMITS
from twin.identify.spectra.spectrum import BroadbandRecord, h1

GRID, SURROUNDINGS = 0.01, 111
"""Step in log frequency, and how many of them are a response's surroundings: a factor of three."""

EXCITED = 0.02


@dataclass(frozen=True, kw_only=True)
class BinnedResponse:
    """Frequency responses with their covariance."""

    run: str
    time_s: float
    frequency_Hz: Array
    """(b,)."""
    H: Array
    """Response per force, in unit/N, (b, o)."""
    relative_covariance: Array
    """Hermitian covariance of the errors of log H, (b, o, o)."""
    channels: tuple[str, ...]
    noise_density: dict[str, float]
    """Estimated noise of each channel, unit/sqrt(Hz)."""
    distortion: Array
    """Measured scatter in units of the white noise's; well above one where nonlinear distortion shows, (b,)."""
    force_power: Array
    """Mean square of the force within each bin, N^2, (b,)."""
    resonances_Hz: Array = field(default_factory=lambda: np.zeros(0))
    """Where the response was taken to change fast."""
    drive: int = 0
    """Number of the rig's drive."""
    frequency_offset: Array | float = 0.0
    """Relative, of this run's natural frequencies from those that all runs have in common, (m,)."""

    @property
    def omega(self) -> Array:
        """Bin centres, rad/s."""
        return 2 * np.pi * self.frequency_Hz

    @property
    def variance(self) -> Array:
        """Complex variance of each response's error, relative, (b, o)."""
        return np.asarray(np.einsum("boo->bo", self.relative_covariance).real)

    @cached_property
    def depth(self) -> Array:
        """How far each response lies below its surroundings, (b, o), at least 1: large between resonances.

        There modes cancel, and a small relative error of each is a large one of their sum.
        """
        level = np.log(np.abs(self.H))
        grid = np.arange(np.log(self.frequency_Hz[0]), np.log(self.frequency_Hz[-1]) + GRID, GRID)
        around = [
            percentile_filter(np.interp(grid, np.log(self.frequency_Hz), row), 75, size=SURROUNDINGS, mode="nearest")
            for row in level.T
        ]
        near = np.stack([np.interp(np.log(self.frequency_Hz), grid, row) for row in around], axis=1)
        return np.asarray(np.exp(np.maximum(near - level, 0.0)))


def hidden_resonances(data: BinnedResponse) -> Array:
    """Frequencies, Hz, at which bins were too wide for what the response does there.

    A light resonator on the structure makes a kink, no peak that stands out by itself.
    """
    scatter, f, reach = data.distortion, data.frequency_Hz, LIMITS.broadband_around
    around = np.array([np.median(scatter[max(0, i - reach) : i + reach + 1]) for i in range(len(f))])
    kinked = (scatter > LIMITS.broadband_kinked * around) & (np.gradient(f) > LIMITS.broadband_coarse_Hz)
    runs = np.split(np.arange(len(f)), np.flatnonzero(np.diff(kinked)) + 1)
    return np.array([np.average(f[run], weights=scatter[run]) for run in runs if kinked[run[0]]])


def find_resonances(record: BroadbandRecord, *, force: str, channels: tuple[str, ...]) -> tuple[Array, Array]:
    """Peaks of the summed H1 magnitude within the excited band.

    Returns
    -------
    frequency_Hz : ndarray
        Of the resonances.
    band_Hz : ndarray, (2,)
        Where the force's power is above :data:`EXCITED` of its upper level.
    """
    response = h1(record, force=force)
    S = np.zeros(record.part_length // 2 + 1)
    for part in record.parts():
        S += np.abs(np.fft.rfft(part.samples[force])) ** 2
    frequency = np.fft.rfftfreq(record.part_length, 1 / record.sample_rate_Hz)
    smooth = np.convolve(S, np.ones(61) / 61, mode="same")
    excited = frequency[smooth > EXCITED * _upper_level(smooth)]
    band = np.array([excited[0], excited[-1]])
    level = np.log10(sum(np.abs(response.H[c]) for c in channels) + 1e-300)
    inside = (response.frequency_Hz >= band[0]) & (response.frequency_Hz <= band[1])
    peaks, _ = find_peaks(np.where(inside, level, level.min()), prominence=0.5)
    return response.frequency_Hz[peaks], band


def _upper_level(power: Array) -> float:
    """The level above which half of the amplitudes lies, however little of the spectrum is excited.

    Of the power a shaker may have half in a single peak.
    """
    ordered = np.sort(power)[::-1]
    summed = np.cumsum(np.sqrt(ordered))
    return float(ordered[np.searchsorted(summed, 0.5 * summed[-1])])


@dataclass(frozen=True, kw_only=True)
class Binning:
    """How a record is reduced to bins."""

    force: str
    channels: tuple[str, ...]
    reference: Callable[[Array], Array]
    """Frequency responses (f, o) at given omega: what is smooth about the difference to it is all that is assumed."""
    poles: Array
    """Complex poles (rad/s) of the reference, for the transient."""
    resonances_Hz: Array
    """Where the response may change fast: the data's own and the reference's resonances."""
    band_Hz: Array
    mended: Callable[[BroadbandRecord], BroadbandRecord] = lambda part: part
    """A part with its missing samples filled in by what is known of them."""


def bin_response(record: BroadbandRecord, binning: Binning) -> BinnedResponse:
    """Reduce a record to bins.

    A long one is reduced part by part, each with its own transient; the scatter of a bin is that of all parts' lines.
    """
    force, channels, reference = binning.force, binning.channels, binning.reference
    parts = [_reduced(part, binning) for part in record.parts()]
    counts, lines_per_Hz = len(parts) * parts[0].counts, record.part_length / record.sample_rate_Hz
    Su, Sy = float(np.mean([part.Su for part in parts])), np.mean([part.Sy for part in parts], axis=0)
    total = np.sum([part.total for part in parts], axis=0)
    centre = np.sum([part.total * part.centre for part in parts], axis=0) / total
    D = np.sum([part.total[:, None] * part.D for part in parts], axis=0) / total[:, None]
    scatter = np.sum([part.scatter + _products(part.D - D, part.total[:, None]) for part in parts], axis=0)
    smooth = reference(2 * np.pi * centre)
    # Noise of the force makes the least-squares ratio too small by its share of the force's power.
    H = (smooth + D) * (1 + Su * counts / total)[:, None]
    # The reference's direction, not the noisy estimate's: else one line of weak force would set its own weight.
    covariance = Su * smooth[:, :, None] * np.conj(smooth)[:, None, :] + np.eye(len(channels)) * Sy
    distortion = _distortion(scatter, covariance, counts, centre)
    covariance = covariance * np.maximum(1.0, distortion)[:, None, None] / total[:, None, None]
    # The logarithm of a response wants it well above its noise.
    share = np.max(np.einsum("boo->bo", covariance).real / np.abs(smooth) ** 2, axis=1)
    clear = share < LIMITS.broadband_noisiest**2
    kept = (centre, H, smooth, covariance, distortion, total)
    centre, H, smooth, covariance, distortion, total = (values[clear] for values in kept)
    # A line's amplitude is a peak value: its variance is twice the density times the resolution.
    density = np.sqrt(np.concatenate([[Su], Sy]) * lines_per_Hz / 2)
    return BinnedResponse(
        run=record.run,
        time_s=record.time_s,
        frequency_Hz=centre,
        H=H,
        relative_covariance=covariance / (smooth[:, :, None] * np.conj(smooth)[:, None, :]),
        channels=channels,
        noise_density=dict(zip((force, *channels), density.tolist(), strict=True)),
        distortion=distortion,
        force_power=total / (2 * len(parts)),
        resonances_Hz=binning.resonances_Hz,
    )


@dataclass(frozen=True, kw_only=True)
class _Part:
    """Bins (b,) of one part of a record: lines, their force's power in all, and its centre, Hz.

    `D` (b, o) is the best constant difference to the reference, `scatter` (b, o, o) the products of what it leaves;
    `Su` and `Sy` (o,) are the white noise of the force's lines and of the channels'.
    """

    counts: NDArray[np.int64]
    total: Array
    centre: Array
    D: Array
    scatter: Array
    Su: float
    Sy: Array


def _products(E: Array, weight: Array | float = 1.0) -> Array:
    """E E^H of each row, (b, o) to (b, o, o)."""
    return np.asarray((weight * E)[:, :, None] * np.conj(E)[:, None, :])


def _reduced(part: BroadbandRecord, binning: Binning) -> _Part:
    record, channels, poles = binning.mended(part), binning.channels, binning.poles
    band = float(binning.band_Hz[0]), float(binning.band_Hz[1])
    frequency, U = record.lines(binning.force, band)
    omega = 2 * np.pi * frequency
    H_reference = np.empty((len(omega), len(channels)), complex)
    for rows in _blocks(len(omega)):
        H_reference[rows] = binning.reference(omega[rows])
    R = -H_reference * U[:, None]
    for o, channel in enumerate(channels):
        R[:, o] += record.lines(channel, band)[1]
    edges = response_bins(frequency, binning.resonances_Hz)
    starts, counts = edges[:-1], np.diff(edges)
    bin_of = np.repeat(np.arange(len(starts)), counts)
    power = np.abs(U) ** 2
    total = np.add.reduceat(power, starts)
    # Weighting the transient's fit wants the noise, whose estimate wants the transient taken off: two passes do.
    Su, Sy = 1.0, np.full(len(channels), np.median(np.abs(H_reference) ** 2))
    for _ in range(2):
        E = R - _transient(R, omega, poles, H_reference, Su, Sy)
        D = np.add.reduceat(np.conj(U)[:, None] * E, starts) / total[:, None]
        E -= D[bin_of] * U[:, None]
        Su, Sy = _white_noise(E, H_reference, bin_of, counts)
    scatter = np.empty((len(starts), len(channels), len(channels)), complex)
    for o in range(len(channels)):
        scatter[:, o] = np.add.reduceat(E[:, o, None] * np.conj(E), starts)
    centre = np.add.reduceat(power * frequency, starts) / total
    return _Part(counts=counts, total=total, centre=centre, D=D, scatter=scatter, Su=Su, Sy=Sy)


def _blocks(lines: int, outputs: int = 1) -> Iterator[slice]:
    """Slices of spectral lines of whose responses memory holds what is made."""
    each = max(1, LIMITS.lines_at_once // outputs)
    return (slice(first, first + each) for first in range(0, lines, each))


def _transient(R: Array, omega: Array, poles: Array, H: Array, Su: float, Sy: Array) -> Array:
    """Least-squares fit of the free decays that the record's ends cut: one residue per pole and channel.

    Weighted by the lines' noise: that of the force, `Su`, moves all channels together by their responses `H` (f, o) and
    far more than their own noise `Sy` does, and unweighted it would leak into their ratio.
    """
    outputs, count = R.shape[1], len(poles) + 3

    def decays(rows: slice) -> Array:
        jw, scale = 1j * omega[rows], omega[-1]
        return np.stack([1 / (jw - pole) for pole in poles] + [np.ones_like(jw), jw / scale, scale / jw], axis=1)

    gram, right = np.zeros((outputs * count, outputs * count), complex), np.zeros((outputs, count), complex)
    own = np.zeros((outputs, count, count), complex)
    for rows in _blocks(len(omega), outputs):
        # A line's inverse covariance is 1 / Sy less a product of u / sqrt(Sy): only the force's noise is shared.
        d, u = decays(rows), H[rows] / np.sqrt(Sy)
        power = np.abs(u) ** 2
        size = 1 + Su * np.sum(power, axis=1, keepdims=True)
        shared = ((np.sqrt(Su / size) * np.conj(u) / np.sqrt(Sy))[:, :, None] * d[:, None]).reshape(len(d), -1)
        gram -= shared.conj().T @ shared
        own += d.conj().T @ (((size - Su * power) / (size * Sy)).T[:, :, None] * d)
        whitened = R[rows] / np.sqrt(Sy)
        for _ in range(2):  # by its root twice, which leaves more digits than it would itself
            whitened = whitened - u * (
                np.sum(np.conj(u) * whitened, axis=1, keepdims=True) * Su / (size + np.sqrt(size))
            )
        right += (whitened / np.sqrt(Sy)).T @ d.conj()
    for o in range(outputs):
        each = slice(o * count, (o + 1) * count)
        gram[each, each] = own[o]
    norm = np.sqrt(np.diag(gram).real)
    inverse = np.linalg.pinv(gram / np.outer(norm, norm), rcond=1e-13, hermitian=True)
    residues = (inverse @ (right.ravel() / norm) / norm).reshape(outputs, count).T
    return np.concatenate([decays(rows) @ residues for rows in _blocks(len(omega))])


def response_bins(frequency: Array, resonances_Hz: Array) -> NDArray[np.int64]:
    """Edges, as places in `frequency`, of bins that are narrow near resonances and at most 8 Hz wide elsewhere."""
    edges = [0]
    step = frequency[1] - frequency[0]
    while edges[-1] < len(frequency):
        distance = np.min(np.abs(frequency[edges[-1]] - resonances_Hz), initial=1e3) + LIMITS.half_width_Hz
        width = min(LIMITS.bin_share * distance, 8.0)
        edges.append(edges[-1] + max(1, int(width / step)))
    edges[-1] = len(frequency)
    return np.array(edges)


def _white_noise(E: Array, H: Array, bin_of: NDArray[np.int64], counts: NDArray[np.int64]) -> tuple[float, Array]:
    """White noise of force and channels from |E_o|^2 = Su |H_o|^2 + Sy_o, over bins of many lines.

    Fitted to the median of the scatter, relative to its size: nonlinear distortion near resonances is no outlier then.
    """
    outputs = H.shape[1]
    wide = counts[bin_of] >= 8
    of_bin = counts[bin_of[wide]]
    rows = []
    for o in range(outputs):
        left, size = np.abs(E[wide, o]) ** 2 * (of_bin / (of_bin - 1)), np.abs(H[wide, o])
        for part in np.array_split(np.argsort(np.log(size)), 40):
            if len(part) < 8:
                continue
            row = np.zeros(1 + outputs)
            row[0], row[1 + o] = np.median(size[part] ** 2), 1.0
            # The median of an exponential variable is ln 2 times its mean.
            rows.append(row / (np.median(left[part]) / np.log(2)))
    if not rows:
        return 0.0, np.full(outputs, float(np.mean(np.abs(E) ** 2)) + 1e-300)
    A = np.array(rows)
    norm = np.linalg.norm(A, axis=0) + 1e-300
    solution = nnls(A / norm, np.ones(len(A)))[0] / norm
    floor = 1e-6 * float(np.median(np.abs(E) ** 2)) + 1e-300
    return float(solution[0]), np.maximum(solution[1:], floor)


def _distortion(scatter: Array, covariance: Array, counts: NDArray[np.int64], centre: Array) -> Array:
    """Scatter of the lines in units of the white noise, pooled over neighbouring bins."""
    sums = np.einsum("boo->b", np.linalg.solve(covariance, scatter)).real
    freedom = scatter.shape[1] * (counts - 1.0)
    out = np.ones(len(counts))
    for b in range(len(counts)):
        lo, hi, have = b, b + 1, freedom[b]
        while have < 40 and (lo > 0 or hi < len(counts)):
            take_low = hi == len(counts) or (lo > 0 and centre[b] - centre[lo - 1] < centre[hi] - centre[b])
            lo, hi = (lo - 1, hi) if take_low else (lo, hi + 1)
            have = freedom[lo:hi].sum()
        if have > 0:
            out[b] = sums[lo:hi].sum() / have
    return out
