"""Tikhonov regularisation of S dphi = eps, its strength by the L-curve's corner or by generalised cross-validation.

    min |S dphi - eps|^2 + lambda^2 |dphi|^2          (2011 paper, equation 17)

All strengths share one singular value decomposition S = U diag(s) V': with beta = U' eps and the filter factors
f = s^2 / (s^2 + lambda^2) the solution is V (f beta / s), and norms and curvature are sums over singular values.
"""

from dataclasses import dataclass

import numpy as np

from twin.arrays import Array
from twin.identify.limits import LIMITS

POINTS = 200


@dataclass(frozen=True)
class LCurve:
    """The size of the solution over the size of its residual as the strength changes."""

    strength: Array
    """The strengths lambda, rising, (p,)."""
    residual_norm: Array
    solution_norm: Array
    """The norms rho = |S x - eps| and eta = |x|, (p,)."""
    curvature: Array
    """Of (log rho, log eta), positive where the curve turns as the letter does, (p,)."""
    cross_validation: Array
    """The ratio rho^2 / (rows - sum f)^2, which estimates how well left-out rows would be met, (p,)."""

    @property
    def corner(self) -> float:
        """Strength at the largest curvature; the weakest one where the curve has no corner."""
        best = int(np.argmax(self.curvature))
        return float(self.strength[best if self.curvature[best] > 0 else 0])

    @property
    def cross_validated(self) -> float:
        """Strength that minimises the cross-validation."""
        return float(self.strength[int(np.argmin(self.cross_validation))])


@dataclass(frozen=True)
class Tikhonov:
    """A decomposed problem."""

    singular: Array
    """Singular values, falling; those that are nothing but round-off are left out, (r,)."""
    V: Array
    """Right singular vectors, (n, r)."""
    beta: Array
    """Parts of the right-hand side along the left singular vectors, (r,)."""
    outside: float
    """Norm of what no solution can meet."""
    rows: int

    def solve(self, strength: float) -> Array:
        """The regularised solution, (n,)."""
        s = self.singular
        return np.asarray(self.V @ (s * self.beta / (s**2 + strength**2)))

    def l_curve(self, points: int = POINTS) -> LCurve:
        """Norms and curvature from strengths below the smallest singular value to the largest."""
        s, beta = self.singular, np.abs(self.beta)
        if len(s) == 0 or not beta.any():
            nothing = np.zeros(1)
            return LCurve(nothing, nothing + self.outside, nothing, nothing, nothing)
        weakest = max(0.1 * s[-1], LIMITS.l_curve_smallest * s[0])
        lam = np.geomspace(weakest, s[0], points)
        f = s**2 / (s**2 + lam[:, None] ** 2)
        c = 1 - f
        x = beta / s
        eta = np.linalg.norm(f * x, axis=1)
        rho = np.sqrt(np.sum((c * beta) ** 2, axis=1) + self.outside**2)
        free = self.rows - np.sum(f, axis=1)
        validation = rho**2 / np.maximum(free, 1e-12) ** 2
        return LCurve(lam, rho, eta, _curvature(lam, f, c, x, beta, eta, rho), validation)


def decompose(S: Array, eps: Array) -> Tikhonov:
    """Decompose S (m, n) with right-hand side eps (m,)."""
    U, s, Vt = np.linalg.svd(S, full_matrices=False)
    kept = s > np.finfo(float).eps * max(S.shape) * (s[0] if len(s) else 0.0)
    U = U[:, kept]
    beta = U.T @ eps
    return Tikhonov(s[kept], Vt[kept].T, beta, float(np.linalg.norm(eps - U @ beta)), len(eps))


def _curvature(lam: Array, f: Array, c: Array, x: Array, beta: Array, eta: Array, rho: Array) -> Array:
    """Curvature of (log rho, log eta) by the derivatives of the filter factors in lambda (Hansen and O'Leary 1993)."""
    lam = lam[:, None]
    df = -2 * f * c / lam
    ddf = -df * (3 - 4 * f) / lam
    rho = np.maximum(rho, np.finfo(float).tiny)
    d_eta = np.sum(f * df * x**2, axis=1) / eta
    d_rho = -np.sum(c * df * beta**2, axis=1) / rho
    dd_eta = np.sum((df**2 + f * ddf) * x**2, axis=1) / eta - d_eta**2 / eta
    dd_rho = np.sum((df**2 - c * ddf) * beta**2, axis=1) / rho - d_rho**2 / rho
    log_rho, log_eta = d_rho / rho, d_eta / eta
    log_rho2, log_eta2 = dd_rho / rho - log_rho**2, dd_eta / eta - log_eta**2
    size = np.maximum((log_rho**2 + log_eta**2) ** 1.5, np.finfo(float).tiny)
    return np.asarray((log_rho * log_eta2 - log_rho2 * log_eta) / size)
