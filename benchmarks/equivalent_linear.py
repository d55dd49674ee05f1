"""The equivalent-linear model, whose layer has other moduli at every step: low rank against the full matrices."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from benchmarks.measured import Measured, timed_in_turns
from twin.identify.baseline_parameters import LinearParameters
from twin.identify.linear_model import LinearModel, Output, build_linear_model, nominal_parameters
from twin.rigs import load_rig

Array = NDArray[Any]


@dataclass(frozen=True)
class SofteningSweep:
    """The steel rig's model, drive frequencies (rad/s), base parameters, and by how much E' is changed at each."""

    model: LinearModel
    omega: Array
    base: LinearParameters
    dE: Array


def softening_sweep(count: int = 400) -> SofteningSweep:
    """A sweep through mode 1 whose layer loses up to a third of its E'.

    Damped in the joint alone: modal damping would fill the full matrices.
    """
    rig = load_rig("steel-lap-joint")
    model = build_linear_model(rig, [Output("acc2", "acceleration", rig.layout().place(rig.length))])
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


def equivalent_linear_sweep() -> Measured:
    """A sweep whose layer is softer at every step."""
    sweep = softening_sweep()
    model, base = sweep.model, sweep.base
    response = banded_model(model)
    E, G = base.complex_E[0] + sweep.dE, np.full(len(sweep.omega), base.complex_G[0])

    def full() -> Array:
        return response(sweep.omega, E, G)

    def ours() -> Array:
        R = model.receptance(sweep.omega, base, dE=sweep.dE[:, None], inner=False)
        return R[:, model.ports.outputs.start, model.ports.drive]

    mine, other = timed_in_turns(ours, full, ours_each=20)
    found, exact = ours(), full()
    error = float(np.max(abs(found - exact)) / np.max(abs(exact)))
    return Measured(ratio=other / mine, promise=40, against="the banded full model", error=error)
