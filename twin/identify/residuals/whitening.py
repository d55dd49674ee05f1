"""Residuals of unit covariance, and higher harmonics of the steps as residuals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from twin.arrays import Array
from twin.structure import Structure


@dataclass(frozen=True)
class Whitening:
    """Gives small groups of residuals unit covariance: one multiplication a group, since all are whitened many times.

    Attributes
    ----------
    factor : ndarray, (..., k, k)
        Cholesky factors of the groups' covariances.
    """

    factor: Array

    @classmethod
    def of(cls, covariance: Array) -> Whitening:
        """From covariances (..., k, k)."""
        return cls(np.linalg.cholesky(covariance))

    @cached_property
    def inverse(self) -> Array:
        """Inverses of the factors."""
        return np.linalg.inv(self.factor)

    def __call__(self, values: Array) -> Array:
        """Whitened values (g k,) of (..., k), for g groups."""
        return np.asarray(np.einsum("...ij,...j->...i", self.inverse, values)).ravel()

    def columns(self, values: Array) -> Array:
        """Whitened values (g k, c) of (..., k, c)."""
        return np.asarray(self.inverse @ values).reshape(-1, values.shape[-1])

    def undone(self, white: Array) -> Array:
        """Values (..., k, c) of whitened ones (g k, c)."""
        return np.asarray(self.factor @ white.reshape(*self.factor.shape[:-1], white.shape[1]))

    def log_determinant(self) -> float:
        """Of all covariances together."""
        return float(2 * np.log(np.einsum("...ii->...i", self.factor).real).sum())


@dataclass(frozen=True)
class HarmonicResiduals:
    """Higher harmonics less the linear response to the force's own, and what whitens them.

    Attributes
    ----------
    orders : ndarray, (h,)
    residual : ndarray, (s, h, o)
    whitening : Whitening, (s, h, o, o)
        Of their covariance: noise, the error of the linear part, and, in odd harmonics, anything at all in the
        direction of the joint's own signature, since the time form of the joint's law is not known beforehand.
    field : ndarray, (s, h, o, n)
        Response of the outputs to unit forces on all degrees of freedom of `structure`.
    structure : Structure
        The model's that they were reduced against: a cause may have given it another mesh than the assumed one.
    """

    orders: Array
    residual: Array
    whitening: Whitening
    field: Array
    structure: Structure

    def select(self, keep: Array) -> HarmonicResiduals:
        """The steps where `keep` is true."""
        return replace(
            self, residual=self.residual[keep], whitening=Whitening(self.whitening.factor[keep]), field=self.field[keep]
        )

    def whiten(self, values: Array) -> Array:
        """Real whitened values (r,) of complex ones (s, h, o), or (r, u) of (s, h, o, u)."""
        white = self.whitening.columns(values) if values.ndim == 4 else self.whitening(values)
        return np.sqrt(2.0) * np.concatenate([white.real, white.imag])
