"""A fitted model as a rig file: the believed rig with the moduli, the damping and the joint's law that were identified.

A rig file has no place for loss factors and for detunings.  The constant loss of G' is part of the law's loss; what the
others do is a few hundredths of a per cent of the response.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.evidence import Evidence
from twin.identify.gauss_newton import Solution
from twin.identify.linear_model import DAMPED_MODES
from twin.identify.unknowns import Unknowns
from twin.rigs import LayerLawTable, Rig
from twin.structure import normal_modes

__all__ = ["updated_rig"]

Array = NDArray[Any]

LAW_POINTS = 48
"""Knots of the law in a file, enough that its piecewise cubic functions are the splines that were fitted."""
BELOW = 3.0
"""First knot of the fitted law over the file's first one above zero."""


def updated_rig(evidence: Evidence, unknowns: Unknowns, solution: Solution) -> Rig:
    """The rig of `evidence` at the preload that was measured, which alone has this law.

    Parameters
    ----------
    unknowns
        Of the model.
    solution
        The minimum that they are; the first entries of its vector are those of ``unknowns.vector``.
    """
    rig, base = evidence.rig, unknowns.base
    (joint,) = rig.joints
    moduli = joint.preload[evidence.preload].model_copy(update={"normal_modulus": base.E, "shear_modulus": base.G})
    believed = list(rig.damping.modal_ratio)
    # Modes beyond the list take its last entry, so the believed one must stay the last.
    relative = np.sqrt(np.diag(solution.covariance)[4 : 4 + len(base.zeta)])  # the vector has their logarithms
    damping = rig.damping.model_copy(
        update={
            "modal_ratio": [*map(float, base.zeta), *(believed[DAMPED_MODES:] or believed[-1:])],
            "modal_ratio_std": (relative * base.zeta).tolist(),
        }
    )
    law = _law_table(evidence, unknowns, solution)
    joint = joint.model_copy(update={"preload": {evidence.preload: moduli}, "law": law})
    measured = {name: table for name, table in rig.measured.items() if name == evidence.preload}
    return rig.with_joints([joint]).model_copy(update={"damping": damping, "measured": measured})


def _law_table(evidence: Evidence, unknowns: Unknowns, solution: Solution) -> LayerLawTable:
    """Softening and loss with standard deviations of what a response feels: E' - g1, and g2 with mode 1's damping."""
    law, base = unknowns.law, unknowns.base
    opening, slip = _file_knots(law.opening_knots), _file_knots(law.slip_knots)
    seen = len(evidence.steps) > 0
    if not seen:  # nothing but the constant loss is known, and the splines' wide prior does not count
        opening, slip = opening[[0, -1]], slip[[0, -1]]
    softens, loses = law.softening_basis(opening), law.loss_basis(slip)
    by_E, by_loss = np.zeros((len(opening), len(solution.x))), np.zeros((len(slip), len(solution.x)))
    by_E[:, 0] = base.E
    by_loss[:, 1], by_loss[:, 3], by_loss[:, 4] = base.G * base.loss_G, base.G, _loss_of_mode_1(evidence, unknowns)
    if seen:
        by_E[:, unknowns.softening], by_loss[:, unknowns.loss] = -softens, loses
    return LayerLawTable(
        opening_m=opening.tolist(),
        softening=(softens @ law.softening).tolist(),
        slip_m=slip.tolist(),
        loss=np.maximum(base.G * base.loss_G + loses @ law.loss, 0.0).tolist(),
        softening_std=_std(by_E, solution.covariance),
        loss_std=_std(by_loss, solution.covariance),
    )


def _file_knots(knots: Array) -> Array:
    return np.concatenate([[0.0], np.geomspace(knots[0] / BELOW, knots[-1], LAW_POINTS)])


def _loss_of_mode_1(evidence: Evidence, unknowns: Unknowns) -> float:
    """Loss modulus in shear that is worth the damping ratio of mode 1, N/m2: a sweep tells their sum, not each."""
    structure, base = evidence.model.structure, unknowns.base
    modes = normal_modes(structure.M, structure.stiffness(base.E, base.G), 1)
    sheared = float(np.sum((structure.joints[0].B_G @ modes.Phi[:, 0]) ** 2))
    return float(2 * modes.omega[0] ** 2 / sheared * base.zeta[0])


def _std(rows: Array, covariance: Array) -> list[float]:
    variance = np.einsum("xi,ij,xj->x", rows, covariance, rows)
    return np.sqrt(np.maximum(variance, 0.0)).tolist()
