"""Receptances between ports of the rig, with the layer's moduli free at every frequency.

A port is a row c with displacement c x (and force c' f): the drive point, a sensor's place, a strain of the layer, a
modal coordinate, a place where something may be attached.  In the modes of a reference structure the receptance
matrix of all ports costs a product; a change of the layer's moduli, E' + dE and G' + dG, is an update of the rank of
its strain operators (Woodbury), different at each frequency if need be::

    R' = R - R_:L T R_L:,     T = S (1 + R_LL S)^-1,     S = diag(dE, ..., dG, ...)

Every sensitivity is then a product of receptances: d R'_oi / dp = - R'_o: (dZ/dp) R'_:i  (2011 paper, equation 15).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.arrays import Array
from twin.structure import JointOperators, Modes, normal_modes, rigid_motions

KEPT_MODES = 18


@dataclass(frozen=True)
class ModalBasis:
    """Kept modes of a structure with viscous modal damping, and the static remainder of the others."""

    omega: Array
    zeta: Array
    """Natural frequencies and damping ratios of the kept modes, (m,)."""
    Phi: Array
    """Their mass-normalised shapes, (n, m)."""
    flexibility: Array
    flexibility2: Array
    """Remainder (n, n) of the other modes in powers of omega^2: sum phi phi' / omega_r^2, sum phi phi' / omega_r^4."""

    def with_damping(self, zeta: Array, frequency_discrepancy: Array) -> ModalBasis:
        """Return the same modes with other damping ratios and relatively shifted frequencies for the first ones."""
        shifted = self.omega.copy()
        shifted[: len(frequency_discrepancy)] *= np.sqrt(1 + 2 * frequency_discrepancy)
        return replace(self, omega=shifted, zeta=np.concatenate([zeta, self.zeta[len(zeta) :]]))

    def receptance(self, ports: Array, omega: Array) -> Array:
        """Receptance matrices between `ports`.

        Parameters
        ----------
        ports : ndarray, (p, n)
        omega : ndarray, (f,)

        Returns
        -------
        ndarray, (f, p, p)
        """
        P = ports @ self.Phi
        w = omega[:, None]
        D = 1.0 / (self.omega**2 - w**2 + 2j * self.zeta * self.omega * w)
        static, static2 = ports @ self.flexibility @ ports.T, ports @ self.flexibility2 @ ports.T
        # Symmetric: one product for the pairs of ports above the diagonal.
        above = np.triu_indices(len(P))
        pairs = (P[above[0]] * P[above[1]]).T
        values = D.real @ pairs + w**2 * static2[above] + static[above] + 1j * (D.imag @ pairs)
        R = np.empty((len(omega), len(P), len(P)), complex)
        R[:, above[0], above[1]] = R[:, above[1], above[0]] = values
        return R

    def field(self, rows: Array, omega: Array) -> Array:
        """Displacements (f, o, n) under loads `rows` (f, o, n)."""
        w = omega[:, None]
        D = 1.0 / (self.omega**2 - w**2 + 2j * self.zeta * self.omega * w)
        modal = (rows @ self.Phi) * D[:, None, :]
        return modal @ self.Phi.T + rows @ self.flexibility + omega[:, None, None] ** 2 * (rows @ self.flexibility2)


def lowest_modes_basis(M: Array, K: Array, zeta: Array, *, kept: int = KEPT_MODES) -> ModalBasis:
    """The `kept` lowest modes of M, K with damping ratios `zeta`, and the rest as flexibility.

    Rigid motions come last: a mode's number, and its damping ratio, count those that strain something.
    """
    modes: Modes = normal_modes(M, K)
    kept = min(kept, len(modes.omega))
    rigid = rigid_motions(modes.omega)
    order = np.r_[rigid:kept, :rigid]
    rest = modes.Phi[:, kept:]
    scaled = rest / modes.omega[kept:]
    scaled2 = scaled / modes.omega[kept:]
    return ModalBasis(
        modes.omega[order], padded(zeta, kept), modes.Phi[:, order], scaled @ scaled.T,
        scaled2 @ scaled2.T,
    )  # fmt: skip


def layer_ports(joint: JointOperators) -> tuple[Array, Array]:
    """Strain operators of the layer compressed to their ranks, Q_E' Q_E = KE and Q_G' Q_G = KG."""
    return _compress(joint.B_E), _compress(joint.B_G)


def _compress(B: Array) -> Array:
    _, singular, Vt = np.linalg.svd(B, full_matrices=False)
    rank = int(np.sum(singular > 1e-9 * singular[0]))
    return singular[:rank, None] * Vt[:rank]


def padded(zeta: Array, count: int) -> Array:
    """Damping ratios of so many modes, whose last ones are alike."""
    zeta = np.asarray(zeta, float)[:count]
    return np.concatenate([zeta, np.full(count - len(zeta), zeta[-1])])
