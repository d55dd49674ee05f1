"""The finite elements condensed to a few coordinates that hold every mode and load the bench will ask of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import eigh

from twin.arrays import Array
from twin.bench.plan import Matrices
from twin.structure import normal_modes
from twin.structure.sparse import solved


@dataclass(frozen=True)
class ModalModel:
    """Kept modes, and the static flexibility of all others between any two loads of the condensed basis."""

    omega: Array
    """Natural frequencies, rad/s, (m,)."""
    Phi: Array
    """Mass-normalised modes in the condensed coordinates, (r, m)."""
    residual: Array
    """K^-1 - Phi omega^-2 Phi', (r, r)."""


@dataclass(frozen=True)
class Condensed:
    """Structure x = T z with orthonormal mass: K is affine in the joints' moduli and in drift."""

    T: Array
    """Basis, T' M T = 1, (n, r)."""
    K0: Array
    """Of parts, supports and ground springs, (r, r)."""
    K_E: tuple[Array, ...]
    K_G: tuple[Array, ...]
    """Each joint's layer per unit of E' and of G', (r, r)."""
    C: Array
    """Of viscous dampers, (r, r)."""

    def modes(self, E: Sequence[float], G: Sequence[float], *, below_Hz: float, factor: float = 1.0) -> ModalModel:
        """Modes below a frequency at moduli E', G' of the joints, all stiffness times `factor`."""
        K = factor * with_layers(self.K0, self.K_E, self.K_G, E, G)
        values, vectors = eigh(K)
        omega = np.sqrt(np.maximum(values, 0.0))
        kept = max(1, int(np.count_nonzero(omega <= 2 * np.pi * below_Hz)))
        rest = vectors[:, kept:] / omega[kept:]
        signs = np.where(vectors[:, :kept].sum(axis=0) < 0, -1.0, 1.0)
        return ModalModel(omega[:kept], vectors[:, :kept] * signs, rest @ rest.T)


def with_layers(K0: Any, K_E: Sequence[Any], K_G: Sequence[Any], E: Sequence[float], G: Sequence[float]) -> Any:
    """Stiffness with the joints' layers at moduli E', G', of dense or of sparse matrices."""
    K = K0
    for by_E, by_G, e, g in zip(K_E, K_G, E, G, strict=True):
        K = K + e * by_E + g * by_G
    return K


def condense(
    matrices: Matrices, *, E: Sequence[float], G: Sequence[float], loads: Sequence[Array], modes: int = 30
) -> Condensed:
    """Condense to the lowest modes and the static shapes of all loads (Rubin's basis).

    Parameters
    ----------
    E, G
        Moduli of the joints at which the basis is built, N/m2.
    loads : sequence of ndarray, (n,)
        Force patterns whose static deflection the basis must hold.
    """
    M, K = matrices.M, with_layers(matrices.K0, matrices.K_E, matrices.K_G, E, G)
    Phi = normal_modes(M, K, modes).Phi
    static = solved(K, np.column_stack(list(loads)))
    basis = np.column_stack([Phi, static - Phi @ (Phi.T @ M @ static)])
    size = np.sqrt(np.einsum("ij,ij->j", basis, M @ basis))
    basis /= np.where(size > 0, size, 1.0)  # a load where all is held moves nothing
    values, vectors = eigh(basis.T @ M @ basis)
    good = values > 1e-9
    T = basis @ (vectors[:, good] / np.sqrt(values[good]))
    K_E, K_G = (tuple(T.T @ A @ T for A in layers) for layers in (matrices.K_E, matrices.K_G))
    return Condensed(T, T.T @ matrices.K0 @ T, K_E, K_G, T.T @ matrices.C @ T)
