"""What is not the parameters' doing: noise, and the model's own errors, as covariances of the residuals.

A model is wrong in its dynamic stiffness, not in its response: a relative error of a mode's stiffness changes the
response little away from the resonance and much within its width.  So the error of a response is that of each mode's
stiffness times the response's sensitivity to it, which all channels share, beside a small error of every channel
against the others.  How large both are is inferred with the parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.frequency_shifts import SHIFT
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_fit import MODULI_STD
from twin.identify.measured_data import StepArrays
from twin.identify.residuals.whitening import CovarianceTerms, HarmonicResiduals, Whitening, as_real
from twin.identify.spectra.broadband import BinnedResponse


@dataclass(frozen=True)
class Discrepancy:
    """Model error of one kind of data."""

    stiffness: float
    """Relative error of a mode's dynamic stiffness, drawn anew at every frequency."""
    ratio: float
    """Relative error of one channel's response against the others'."""


OF_BROADBAND, OF_STEPS = slice(0, 2), slice(2, 4)
OF_HARMONICS, OF_SHIFTS, OF_SOFTENING, OF_LOSS = range(4, 8)
"""Where :attr:`ErrorModel.log_sizes` has each."""
HELD_MEAN = 1e6
"""Precision of the sum of the shifts of sweeps about one mode: a thousandth of one is nothing."""


@dataclass(frozen=True, kw_only=True)
class ErrorModel:
    """Model error of the steps' fundamentals and of the broadband runs."""

    steps: Discrepancy
    broadband: Discrepancy
    frequency: float = LIMITS.frequency_std
    """Prior of what the finite elements and rounded dimensions leave wrong in each natural frequency, relative."""
    moduli: float = MODULI_STD
    """Prior of the logarithms of E' and G': tight only while a fit with large errors finds its way, for these are
    shared by many bins and would else count as many independent witnesses for wrong moduli."""
    roughness: tuple[float, float] = (1.6, 7.8)
    """Prior of how a joint's softening and how its loss bends, see
    :func:`twin.identify.nonlinear.joint_law.curve_precision`: how large they are goes by it, too."""
    harmonics: float = 1.0
    """Error of each point's share in the odd harmonics, over :data:`LIMITS.share_error`."""
    shifts: float = 1.0
    """Prior of how far all resonances of a run or sweep lie off, over :data:`~twin.identify.frequency_shifts.SHIFT`."""

    @property
    def log_sizes(self) -> Array:
        """Logarithms (8,) of what is inferred: errors of stiffness and ratio of both kinds of data, and the others."""
        kinds = (self.broadband, self.steps)
        pairs = [size for kind in kinds for size in (kind.stiffness, kind.ratio)]
        return np.log([*pairs, self.harmonics, self.shifts, *self.roughness])

    def with_log_sizes(self, log_sizes: Array) -> ErrorModel:
        """The same with others of these."""
        sizes = np.exp(log_sizes).tolist()
        return replace(
            self, broadband=Discrepancy(*sizes[OF_BROADBAND]), steps=Discrepancy(*sizes[OF_STEPS]),
            harmonics=sizes[OF_HARMONICS], shifts=sizes[OF_SHIFTS], roughness=(sizes[OF_SOFTENING], sizes[OF_LOSS]),
        )  # fmt: skip

    def loosened(self, stiffness: float, frequency: float, moduli: float) -> ErrorModel:
        """The same with errors of stiffness no smaller than this, and of ratios three times that."""
        steps, broadband = (
            Discrepancy(max(own.stiffness, stiffness), max(own.ratio, 3 * stiffness))
            for own in (self.steps, self.broadband)
        )
        return replace(self, steps=steps, broadband=broadband, frequency=frequency, moduli=moduli)

    def shift_precision(self, about: NDArray[np.int64]) -> Array:
        """Precision (k, k) of shifts, see :func:`~twin.identify.frequency_shifts.swept_modes`.

        A natural frequency is what the sweeps about it have in the mean: a broadband run moves the joints otherwise,
        sweeps about other modes are off by those modes' discrepancies, and neither is theirs to share.
        """
        together = (about[:, None] == about) & (about >= 0)
        return np.eye(len(about)) / self.shifts**2 + HELD_MEAN * together

    def as_small_as(self, sound: ErrorModel) -> bool:
        """Whether no error of any kind of data is larger than one in six of sound rigs needs."""
        own, usual = (errors.log_sizes[: OF_STEPS.stop] for errors in (self, sound))
        return bool(np.all(own < usual + SPREAD))


SOUND = ErrorModel(steps=Discrepancy(2e-6, 5e-5), broadband=Discrepancy(4e-5, 6e-5))
"""What sound rigs need: medians over two clean campaigns of a program that shares no code with the bench, and the
bench's seed 5301.  The roughness: these two, and the bench's seeds 7201 and 7202."""
SPREAD = np.log(3.0)
"""Standard deviation of the logarithm of each: sound rigs lie within a factor of three."""
CONTINUATION = (
    (1e-2, 3e-2, 0.01),
    (3e-3, 1e-2, 0.03),
    (1e-3, 3e-3, MODULI_STD),
    (1e-4, 7e-4, MODULI_STD),
    (1e-5, 2e-4, MODULI_STD),
)
"""Errors of stiffness, priors of frequencies and of moduli through which a fit comes to its minimum: with large ones it
follows the resonances wherever they are, and each smaller one asks the parameters to explain more of that."""


def continuation(errors: ErrorModel) -> tuple[ErrorModel, ...]:
    """Model errors of successive fits, the last one `errors` themselves."""
    return (*(errors.loosened(*level) for level in CONTINUATION if level[0] > errors.steps.stiffness), errors)


def log_prior(errors: ErrorModel, sound: ErrorModel = SOUND, *, free: bool = False) -> float:
    """Log density of :attr:`ErrorModel.log_sizes`.

    Normal about sound rigs'; but with a curve's roughness goes its size, which may be next to nothing where a joint
    loses nothing: half-Cauchy (Gelman 2006, Prior distributions for variance parameters), of sound rigs' median.

    Parameters
    ----------
    sound
        Those of sound rigs.
    free
        Whether those of stiffness may have any size up to :data:`LIMITS.error_model_any`, over a sound rig's.
    """
    away = errors.log_sizes - sound.log_sizes
    each = -0.5 * (away / SPREAD) ** 2 - np.log(np.sqrt(2 * np.pi) * SPREAD)
    each[OF_SOFTENING:] = -np.log(np.pi * np.cosh(away[OF_SOFTENING:]))
    if free:
        each[[OF_BROADBAND.start, OF_STEPS.start]] = -np.log(np.log(LIMITS.error_model_any))
    return float(np.sum(each))


def log_prior_slopes(errors: ErrorModel, sound: ErrorModel = SOUND, *, free: bool = False) -> Array:
    """Derivatives (8,) of :func:`log_prior` by :attr:`ErrorModel.log_sizes`."""
    away = errors.log_sizes - sound.log_sizes
    slopes = -away / SPREAD**2
    slopes[OF_SOFTENING:] = -np.tanh(away[OF_SOFTENING:])
    if free:
        slopes[[OF_BROADBAND.start, OF_STEPS.start]] = 0.0
    return np.asarray(slopes)


@dataclass(frozen=True)
class ErrorSources:
    """What the covariances of a model's residuals are made of, at parameters that are held."""

    terms_of_broadband: tuple[CovarianceTerms, ...]
    """Of each broadband run's residuals, with the errors of stiffness and of ratio."""
    terms_of_steps: CovarianceTerms
    """And of the steps', or of a table's frequencies."""
    terms_of_harmonics: tuple[CovarianceTerms, ...]
    """And of the steps' harmonics, where these are data."""
    shifts: tuple[tuple[Array, ...], Array]
    """Changes of the residuals of broadband runs (b, o, k) and of steps (s, 2 o, k), or of a table's frequencies
    (n, 1, k), as all frequencies of one of the k runs and sweeps, or states, shift by SHIFT."""

    def of_broadband(self, errors: Discrepancy) -> tuple[Whitening, ...]:
        """Of each broadband run's residuals."""
        return tuple(terms.whitening(errors.stiffness, errors.ratio) for terms in self.terms_of_broadband)

    def of_steps(self, errors: Discrepancy) -> Whitening:
        """And of the steps', or of a table's frequencies."""
        return self.terms_of_steps.whitening(errors.stiffness, errors.ratio)

    def of_harmonics(self, error: float) -> Whitening | None:
        """And of the steps' harmonics, where these are data."""
        return next((terms.whitening(error) for terms in self.terms_of_harmonics), None)


@dataclass(frozen=True)
class StepErrors:
    """How the steps' residuals go by what errs."""

    steps: StepArrays
    by_stiffness: Array
    """D log response / d log stiffness of each mode, (s, o, m)."""
    by_amplitude: Array
    """Array (s, o). D log response / d log amplitude of the reference channel, by which the joint's law goes: its
    noise is in the prediction, too."""
    reference: int
    """Number of that channel."""
    ratio: Array
    """Measured over predicted response, by which the steps' residuals are multiplied, (s, o)."""
    unsettled: Array
    """What the balance of each step misses, relative, (s,): the model says its responses no better than that."""

    @property
    def terms(self) -> CovarianceTerms:
        """Of the steps' residuals (s, 2 o), real parts above imaginary ones."""
        steps, outputs = self.steps, self.ratio.shape[1]
        own = steps.response_variance[:, :, 0] / np.abs(steps.response[:, :, 0]) ** 2 + self.unsettled[:, None] ** 2
        through = np.tile(np.eye(2 * outputs), (len(steps), 1, 1))
        through[:, :outputs, self.reference] -= self.by_amplitude.real
        through[:, outputs:, self.reference] -= self.by_amplitude.imag
        noise = through * (np.concatenate([own, own], axis=1) / 2)[:, None, :] @ np.swapaxes(through, 1, 2)
        # A mode's dynamic stiffness changes with frequency as with its stiffness, twice as much over the frequency.
        by_growth = 2 * self.by_stiffness.sum(axis=2, keepdims=True) / steps.omega[:, None, None]
        force = steps.force_variance[:, 0] / np.abs(steps.force[:, 0]) ** 2
        shared = force[:, None, None] + 2 * _outer(by_growth * steps.growth_std[:, None, None])  # of each of two parts
        turn = as_real(self.ratio[:, :, None] * np.eye(outputs))
        given, by_stiffness, by_ratio = (
            turn @ covariance @ np.swapaxes(turn, 1, 2)
            for covariance in (
                noise + as_real(shared) / 2,
                as_real(_outer(self.by_stiffness)) / 2,
                np.eye(2 * outputs) / 2,
            )
        )
        return CovarianceTerms(given, (by_stiffness, by_ratio))


def error_sources(
    broadband: Sequence[BinnedResponse],
    broadband_by_stiffness: Sequence[Array],
    of_steps: StepErrors,
    harmonics: HarmonicResiduals | None,
) -> ErrorSources:
    """Those of recordings, with d log response / d log stiffness of each mode (b, o, m) of the broadband runs."""
    terms, runs, sweeps = [], [], of_steps.steps.by_sweep
    count = len(broadband) + len(sweeps)
    for number, (data, by_stiffness) in enumerate(zip(broadband, broadband_by_stiffness, strict=True)):
        ratio = data.depth[:, :, None] ** 2 * np.eye(by_stiffness.shape[1])
        terms.append(CovarianceTerms(data.relative_covariance, (_outer(by_stiffness), ratio)))
        columns = np.zeros((*by_stiffness.shape[:2], count), complex)
        columns[:, :, number] = 2 * SHIFT * by_stiffness.sum(axis=2)
        runs.append(columns)
    steps = np.zeros((*of_steps.ratio.shape, count), complex)
    for number, rows in enumerate(sweeps.values(), len(broadband)):
        steps[rows, :, number] = 2 * SHIFT * of_steps.ratio[rows] * of_steps.by_stiffness[rows].sum(axis=2)
    return ErrorSources(
        tuple(terms), of_steps.terms, () if harmonics is None else (harmonics.beside(of_steps.unsettled).terms,),
        (tuple(runs), np.concatenate([steps.real, steps.imag], axis=1)),
    )  # fmt: skip


def _outer(columns: Array) -> Array:
    return np.asarray(columns @ np.swapaxes(columns.conj(), 1, 2))
