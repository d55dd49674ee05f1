"""Responses at given frequencies with nothing but one joint's moduli free: what laws of amplitude are fitted with.

The rig's linear receptances are computed once; a change (dE, dG) of the layer's moduli is then one small solve in its
strain ports, and the same solve gives the sensitivities, as products of receptances (2011 paper, equation 15)::

    R' = R - R_:L S (1 + R_LL S)^-1 R_L:        d R'_oi / dE = - R'_on R'_ni      (n: the normal strains)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.linear.linear_model import LinearParameters
from twin.identify.linear.structural_modification import update_receptance
from twin.identify.residuals.residual_model import ResidualModel

__all__ = ["LayerResponse", "layer_response"]

Array = NDArray[Any]


@dataclass(frozen=True)
class LayerResponse:
    """Receptances of the linear rig at f frequencies.

    Attributes
    ----------
    residual_model : ResidualModel
    omega : ndarray, (f,)
        As the model has them: a wrong sample clock is already taken off.
    R : ndarray, (f, p, p)
        Between all ports, linear attachments included.
    """

    residual_model: ResidualModel
    omega: Array
    R: Array

    def pick(self, rows: Array) -> LayerResponse:
        """The same at the frequencies `rows`, in that order, repeated ones included."""
        return LayerResponse(self.residual_model, self.omega[rows], self.R[rows])

    def with_stiffness(self, ports: slice, k: Array) -> LayerResponse:
        """The same with complex stiffness k (f, q) on `ports`."""
        return LayerResponse(self.residual_model, self.omega, update_receptance(self.R, ports, k))

    def responses(self, dE: Array, dG: Array) -> tuple[Array, Array, Array]:
        """Responses and their logarithmic sensitivities.

        Parameters
        ----------
        dE, dG : ndarray, (f,)
            Complex changes of E' and G' beyond those in `R`.

        Returns
        -------
        H : ndarray, (f, o)
            Measured response per measured force, in the channels' units.
        by_E, by_G : ndarray, (f, o)
            d log H / dE and d log H / dG, of the structure's own part of H.
        """
        R, into = self._updated(dE, dG)
        p = self.residual_model.model.ports
        H = self.residual_model.responses(R, self.omega)
        product = -into[:, :, [p.drive]] * into[:, :, p.outputs] / R[:, None, p.outputs, p.drive]
        by_E, by_G = (part.sum(axis=1) for part in np.split(product, [len(p.normals[0])], axis=1))
        return H, by_E, by_G

    def with_moduli(self, dE: Array, dG: Array) -> Array:
        """Receptances (f, p, p) between all ports with these changes of the moduli, (f,)."""
        return update_receptance(self.R, self._strains, self._stiffness(dE, dG))

    def by_drive(self, dE: Array, dG: Array) -> tuple[Array, Array]:
        """The layer's strains (f, r), normal ones first, and the outputs' displacements (f, o) per drive force."""
        R, into = self._updated(dE, dG)
        p = self.residual_model.model.ports
        return into[:, :, 0], R[:, p.outputs, p.drive]

    @property
    def _strains(self) -> slice:
        """The ports of the layer's strains, normal ones first."""
        p = self.residual_model.model.ports
        return slice(p.normal[0].start, p.shear[0].stop)

    def _stiffness(self, dE: Array, dG: Array) -> Array:
        """Changes of the moduli as stiffness (f, r) on the layer's strains."""
        p = self.residual_model.model.ports
        parts = ((dE, p.normals[0]), (dG, p.shears[0]))
        return np.hstack([np.repeat(np.reshape(change, (-1, 1)), len(rows), axis=1) for change, rows in parts])

    def _updated(self, dE: Array, dG: Array) -> tuple[Array, Array]:
        """Receptances among drive, outputs and extra ports (others are left zero), and those from there to strains."""
        outer = len(self.residual_model.model.ports.outer)
        S, layer, rest = self._stiffness(dE, dG), self._strains, slice(0, outer)
        A = np.eye(S.shape[1]) + self.R[:, layer, layer] * S[:, None, :]
        into = np.linalg.solve(A, self.R[:, layer, rest])
        R = np.zeros_like(self.R)
        R[:, rest, rest] = self.R[:, rest, rest] - self.R[:, rest, layer] @ (S[:, :, None] * into)
        return R, into


def layer_response(residual_model: ResidualModel, base: LinearParameters, omega: Array, time_s: Array) -> LayerResponse:
    """Set up at commanded `omega` (f,) and times since the first step, with the extension's changes of the moduli."""
    clocked = residual_model.clock(omega, time_s)
    return LayerResponse(residual_model, clocked, residual_model.receptance(clocked, base, time_s))
