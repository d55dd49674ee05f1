"""The equivalent-linear model, whose layer has other moduli at every step: low rank against the full matrices."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from twin.identify.baseline_parameters import LinearParameters
from twin.identify.linear.linear_model import LinearModel, Output, build_linear_model, nominal_parameters
from twin.rigs import load_rig

Array = NDArray[Any]


@dataclass(frozen=True)
class SofteningSweep:
    """The steel rig's model, drive frequencies (rad/s), base parameters, and by how much E' is changed at each."""

    model: LinearModel
    omega: Array
    base: LinearParameters
    dE: Array

    def receptance(self) -> Array:
        """Displacement of the output per unit force at each step, by the model."""
        R = self.model.receptance(self.omega, self.base, dE=self.dE[:, None], inner=False)
        return np.asarray(R[:, self.model.ports.outputs.start, self.model.ports.drive])


def softening_sweep(count: int = 400) -> SofteningSweep:
    """A sweep through mode 1 whose layer loses up to a third of its E'.

    Damped in the joint alone: modal damping would fill the full matrices.
    """
    rig = load_rig("steel-lap-joint")
    model = build_linear_model(rig, [Output("acc2", "acceleration", rig.layout().place(rig.layout().length))])
    base = replace(nominal_parameters(rig), loss_E=np.array([0.02]), loss_G=np.array([0.05]), zeta=np.full(5, 1e-12))
    omega = 2 * np.pi * np.linspace(20.0, 32.0, count)
    return SofteningSweep(model, omega, base, -np.linspace(0.0, base.E[0] / 3, count))


def in_bands(parts: list[Array]) -> tuple[Array, int, Array]:
    """Matrices (k, 2 width + 1, n) as :func:`scipy.linalg.solve_banded` has them, the width, and the order of rows."""
    pattern = np.sum(np.abs(parts), axis=0)
    order = reverse_cuthill_mckee(csr_array(pattern), symmetric_mode=True)
    rows, columns = np.nonzero(pattern[np.ix_(order, order)])
    width = int(np.max(abs(rows - columns)))
    bands = np.zeros((len(parts), 2 * width + 1, len(order)))
    for band, part in zip(bands, parts, strict=True):
        band[width + rows - columns, columns] = part[order[rows], order[columns]]
    return bands, width, order


def banded_model(model: LinearModel) -> Callable[[Array, Array, Array], Array]:
    """Displacement of the output per unit force at given omega, E' and G', from the full matrices in bands."""
    s, port = model.structure, model.ports.outputs.start
    K = s.stiffness(0.0, 0.0)
    banded, width, order = in_bands([K, s.joints[0].KE, s.joints[0].KG, s.M])
    load, read = (model.ports.rows[row][order] for row in (model.ports.drive, port))

    def response(omega: Array, E: Array, G: Array) -> Array:
        out = []
        for w, e, g in zip(omega, E, G, strict=True):
            band = banded[0] + e * banded[1] + g * banded[2] - w**2 * banded[3]
            out.append(read @ solve_banded((width, width), band, load, check_finite=False))
        return np.array(out)

    return response


def woodbury(sweep: SofteningSweep) -> Array:
    """Displacement of the output per unit force, from the receptances between the needed ports and low-rank updates."""
    model, ports = sweep.model, sweep.model.ports
    soft = np.arange(len(ports.rows))[ports.soft]
    rows = ports.rows[np.r_[ports.drive, ports.outputs.start, soft]]
    basis = model.basis.with_damping(sweep.base.zeta, sweep.base.frequency_discrepancy)
    P, w2 = rows @ basis.Phi, sweep.omega[:, None] ** 2
    D = 1.0 / (basis.omega**2 - w2 + 2j * basis.zeta * basis.omega * sweep.omega[:, None])
    R = (
        (P * D[:, None, :]) @ P.T
        + rows @ basis.flexibility @ rows.T
        + w2[..., None] * (rows @ basis.flexibility2 @ rows.T)
    )
    S = model.soft_stiffness(sweep.omega, sweep.base, sweep.dE[:, None], 0.0)
    inner, out, into = R[:, 2:, 2:], R[:, 1, 2:], R[:, 2:, 0]
    held = np.linalg.solve(np.eye(len(soft)) + S[:, :, None] * inner, (S * into)[..., None])[..., 0]
    return np.asarray(R[:, 1, 0] - np.sum(out * held, axis=1))
