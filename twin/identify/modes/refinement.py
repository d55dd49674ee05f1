"""Maximum likelihood of poles and residues together, which gives the poles their standard deviations.

    H_o(w) = sum_r [ R_or / (j w - p_r) + conj(R_or) / (j w - conj(p_r)) ] + U_o + L_o / w^2 + V_o w^2

The residues and the remainders U, L, V of modes outside the band are linear and are projected out at each step (Golub
and Pereyra; with Kaufman's Jacobian), so that only the poles are iterated.
"""

from dataclasses import dataclass

import numpy as np

from twin.arrays import Array
from twin.identify.gauss_newton import StepRule, minimise
from twin.identify.limits import LIMITS

REMAINDERS = 3
ITERATIONS, TOLERANCE = 40, 1e-3
HARDLY = 1e-9
"""Precision beforehand of a pole that no line shows."""


@dataclass(frozen=True)
class PoleFit:
    """Poles with covariance, residues, and how well they fit."""

    omega: Array
    zeta: Array
    """Natural frequencies (rad/s) and damping ratios, (m,)."""
    covariance: Array
    """Of (log omega ..., log zeta ...), for the weights as given, (2 m, 2 m)."""
    residues: Array
    """(o, m)."""
    remainders: Array
    """U, L and V, these two at the ends of `band`, (o, 3)."""
    band: tuple[float, float]
    """First and last omega, rad/s."""
    chi2: float
    """Sum of squares of the weighted residual."""
    dof: int

    @property
    def poles(self) -> Array:
        """Complex poles, rad/s, (m,)."""
        return np.asarray(self.omega * (-self.zeta + 1j * np.sqrt(1 - self.zeta**2)))

    def parts(self, omega: Array) -> Array:
        """Each mode's part of the responses at `omega`, (f, o, m)."""
        s, p, r = 1j * np.asarray(omega)[:, None, None], self.poles, self.residues
        return np.asarray(r / (s - p) + r.conj() / (s - p.conj()))

    def responses(self, omega: Array) -> Array:
        """The fitted responses at `omega`, (f, o); beyond the band with the remainders that they have at its ends."""
        rest = _remainder_basis(np.clip(omega, *self.band), self.band) @ self.remainders.T
        return np.asarray(np.sum(self.parts(omega), axis=2) + rest)


def refine_poles(
    frequency_Hz: Array, H: Array, weight: Array, *, omega: Array, zeta: Array, iterations: int = ITERATIONS
) -> PoleFit:
    """Fit `H` from starting poles.

    Parameters
    ----------
    frequency_Hz, H, weight
        As in :func:`twin.identify.modes.rational.pole_chart`.
    omega, zeta : ndarray, (m,)
        Natural frequencies (rad/s) and damping ratios to start from.
    iterations
        At most; with 0 only residues are fitted.
    """
    w, m = 2 * np.pi * np.asarray(frequency_Hz, float), len(omega)
    start = np.concatenate([np.log(omega), np.log(zeta)])
    linear: dict[bytes, list[Array]] = {}

    def evaluate(x: Array) -> tuple[Array, Array]:
        residual, jacobian, *linear[x.tobytes()] = _projected(x, w, H, weight)
        return residual, jacobian

    def moved(x: Array, step: Array) -> Array:
        return np.asarray(x + step * min(1.0, LIMITS.largest_step / max(_size(step, x, w), 1e-300)))

    # A pole far from all lines, which may wander to nothing or without end, is one remainder more; none tells its
    # damping.
    around = np.min(w[w > 0]) / LIMITS.refinement_far, np.max(w) * LIMITS.refinement_far
    lower, upper = np.repeat(np.log([around, LIMITS.refinement_damping]).T, m, axis=1)
    solution = minimise(
        evaluate, start, mean=start, precision=HARDLY * np.eye(2 * m), iterations=iterations,
        tolerance=TOLERANCE, steps=StepRule(bounds=(lower, upper), moved=moved),
    )  # fmt: skip
    x, J = solution.x, solution.jacobian
    dof = max(1, 2 * H.size - len(x) - H.shape[1] * 2 * (m + REMAINDERS))
    (residues, remainders), covariance = linear[x.tobytes()], np.linalg.pinv(J.T @ J, hermitian=True)
    band = float(w[0]), float(w[-1])
    return PoleFit(np.exp(x[:m]), np.exp(x[m:]), covariance, residues, remainders, band, solution.chi2, dof)


def _size(step: Array, x: Array, w: Array) -> float:
    """Largest change of a log damping, or of a frequency in half-widths, or over its distance from all lines `w`."""
    m = len(x) // 2
    omega = np.exp(x[:m])
    reach = np.max([np.exp(x[m:]), w[0] / omega - 1, 1 - w[-1] / omega], axis=0)
    return float(max(np.max(np.abs(step[m:])), np.max(np.abs(step[:m]) / reach) / 4))


def _projected(x: Array, w: Array, H: Array, weight: Array) -> tuple[Array, Array, Array, Array]:
    """Residual and Jacobian at given poles, with the linear part at its best: residues, remainders."""
    m = len(x) // 2
    omega, zeta = np.exp(x[:m]), np.exp(x[m:])
    root = np.sqrt(1 - zeta**2)
    p = omega * (-zeta + 1j * root)
    s = 1j * w[:, None]
    plus, minus = 1 / (s - p), 1 / (s - p.conj())
    # d p / d log omega and d p / d log zeta.
    by = (p, omega * zeta * (-1 - 1j * zeta / root))
    rest = _remainder_basis(w, (float(w[0]), float(w[-1])))
    basis = np.hstack([plus + minus, 1j * (plus - minus), rest, 1j * rest])
    norm = np.linalg.norm(basis, axis=0)
    residual, jacobian, residues, remainders = [], [], [], []
    for h, g in zip(H.T, weight.T, strict=True):
        A = _stacked(g[:, None] * basis / norm)
        Q, R = np.linalg.qr(A)
        # Where poles meet, rounding would choose the directions of no weight: these are left out.
        U, size, V = np.linalg.svd(R)
        kept = size > LIMITS.refinement_dependent * size[0]
        Q = Q @ U[:, kept]
        y = _stacked((g * h)[:, None])[:, 0]
        c = V[kept].T @ (Q.T @ y / size[kept]) / norm
        r = c[:m] + 1j * c[m : 2 * m]
        columns = [r * d * plus**2 + (r * d).conj() * minus**2 for d in by]
        D = _stacked(g[:, None] * np.hstack(columns))
        residual.append(y - A @ (c * norm))
        jacobian.append(D - Q @ (Q.T @ D))
        residues.append(r)
        remainders.append(c[2 * m : 2 * m + REMAINDERS] + 1j * c[2 * m + REMAINDERS :])
    return np.concatenate(residual), np.vstack(jacobian), np.array(residues), np.array(remainders)


def _remainder_basis(w: Array, band: tuple[float, float]) -> Array:
    return np.stack([np.ones_like(w), (band[0] / w) ** 2, (w / band[1]) ** 2], axis=1)


def _stacked(values: Array) -> Array:
    """Real parts above imaginary parts."""
    return np.vstack([values.real, values.imag])
