"""Residuals of unit covariance, and higher harmonics of the steps as residuals."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from twin.arrays import Array
from twin.structure import Structure


@dataclass(frozen=True)
class Whitening:
    """Gives small groups of residuals unit covariance: one multiplication a group; all are whitened many times."""

    factor: Array
    """Cholesky factors of the groups' covariances, (..., k, k)."""

    @classmethod
    def of(cls, covariance: Array) -> Whitening:
        """From covariances (..., k, k); of one that is indefinite by rounding, with as much more of each variance."""
        try:
            return cls(np.linalg.cholesky(covariance))
        except np.linalg.LinAlgError:
            size = np.trace(covariance, axis1=-2, axis2=-1)[..., None, None]
            rounding = 2 * np.finfo(float).eps * size * np.eye(covariance.shape[-1])
            return cls(np.linalg.cholesky(covariance + rounding))

    @cached_property
    def inverse(self) -> Array:
        """Inverses of the factors, row by row: they are triangular."""
        inverse = np.zeros_like(self.factor)
        for row in range(self.factor.shape[-1]):
            own = 1 / self.factor[..., row, row, None]
            inverse[..., row, row] = own[..., 0]
            above = self.factor[..., row, None, :row] @ inverse[..., :row, :row]
            inverse[..., row, :row] = -own * above[..., 0, :]
        return inverse

    def __call__(self, values: Array) -> Array:
        """Whitened values (g k,) of (..., k), for g groups."""
        return np.asarray(self.inverse @ values[..., None]).ravel()

    def columns(self, values: Array) -> Array:
        """Whitened values (g k, c) of (..., k, c)."""
        return np.asarray(self.inverse @ values).reshape(math.prod(values.shape[:-1]), values.shape[-1])

    def undone(self, white: Array) -> Array:
        """Values (..., k, c) of whitened ones (g k, c)."""
        return np.asarray(self.factor @ white.reshape(*self.factor.shape[:-1], white.shape[1]))

    def log_determinant(self) -> float:
        """Of all covariances together."""
        return float(2 * np.log(np.einsum("...ii->...i", self.factor).real).sum())


@dataclass(frozen=True)
class CovarianceTerms:
    """Covariances (..., k, k) of small groups of residuals, as a sum."""

    given: Array
    by_square: tuple[Array, ...]
    """What a size multiplies by its square, of each size."""

    def whitening(self, *sizes: float) -> Whitening:
        """With these sizes."""
        terms = zip(sizes, self.by_square, strict=True)
        return Whitening.of(self.given + sum(size**2 * each for size, each in terms))

    def slopes(self, *sizes: float) -> list[Array]:
        """Derivatives by the logarithm of each size."""
        return [2 * size**2 * each for size, each in zip(sizes, self.by_square, strict=True)]

    @property
    def of_real_ones(self) -> CovarianceTerms:
        """The same of the real parts above the imaginary ones, each times the square root of two."""
        return CovarianceTerms(as_real(self.given), tuple(map(as_real, self.by_square)))


@dataclass(frozen=True)
class LowRankWhitening:
    """Gives residuals of unit covariance, to which columns T with standard normal amounts add, that covariance again.

    By (1 + T T')^(-1/2) = 1 - T K T', with T' T = V s^2 V', q = (1 + s^2)^(1/2) and K = V / (q (1 + q)) V'.
    """

    columns: Array
    """Array (r, k)."""
    between: Array
    """K, (k, k)."""

    @classmethod
    def of(cls, columns: Array) -> LowRankWhitening:
        """From T."""
        square, V = np.linalg.eigh(columns.T @ columns)
        q = np.sqrt(1 + np.maximum(square, 0.0))
        return cls(columns, V / (q * (1 + q)) @ V.T)

    def __call__(self, values: Array) -> Array:
        """Whitened values (r,) or columns (r, u)."""
        return np.asarray(values - self.columns @ (self.between @ (self.columns.T @ values)))


@dataclass(frozen=True)
class HarmonicResiduals:
    """Higher harmonics less the linear response to the force's own, and what whitens them."""

    orders: Array
    """Array (h,)."""
    residual: Array
    """Array (s, h, o)."""
    covariance: Array
    """Array (s, h, o, o). Theirs, without the shares: noise, the error of the linear part, and, in odd harmonics,
    anything at all in the direction of the joint's own signature, since the time form of the joint's law is not
    known beforehand."""
    shares: Array
    """What each point of the layers makes of it, times its usual error, (s, h, o, p)."""
    field: Array
    """Response of the outputs to unit forces on all degrees of freedom of `structure`, (s, h, o, n)."""
    structure: Structure
    """The model's that they were reduced against: a cause may have given it another mesh than the assumed one."""

    def beside(self, unsettled: Array) -> HarmonicResiduals:
        """The same where the balance of each step misses so much (s,), relative: all of it is the balance's making."""
        if not unsettled.any():
            return self
        error = unsettled[:, None, None, None] ** 2 * np.abs(self.residual[..., None]) ** 2
        return replace(self, covariance=self.covariance + error * np.eye(self.residual.shape[2]))

    @cached_property
    def terms(self) -> CovarianceTerms:
        """Of their covariance with the shares."""
        return CovarianceTerms(self.covariance, (self.shares @ np.conj(np.swapaxes(self.shares, 2, 3)),))

    def whitening(self, share_error: float) -> Whitening:
        """With errors of the shares that are so many times the usual ones."""
        return self.terms.whitening(share_error)

    def whiten(self, values: Array, whitening: Whitening) -> Array:
        """Real whitened values (r,) of complex ones (s, h, o), or (r, u) of (s, h, o, u)."""
        white = whitening.columns(values) if values.ndim == 4 else whitening(values)
        return real_ones(white)


def as_real(matrices: Array) -> Array:
    """Complex matrices (..., k, k) as they act on real parts above imaginary ones."""
    return np.block([[matrices.real, -matrices.imag], [matrices.imag, matrices.real]])


def real_ones(white: Array, axis: int = 0) -> Array:
    """Whitened complex numbers (k, ...) as twice as many real ones of unit variance."""
    if axis == 0:  # of many columns: one pass, where joining takes three
        real = np.empty((2, *white.shape))
        for part, values in zip(real, (white.real, white.imag), strict=True):
            np.multiply(values, np.sqrt(2.0), out=part)
        return real.reshape(2 * len(white), *white.shape[1:])
    return np.asarray(np.sqrt(2.0) * np.concatenate([white.real, white.imag], axis))
