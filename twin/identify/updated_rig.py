"""A fitted model as a rig file: the nominal rig with its identified moduli, damping and joints' laws.

A rig file has no place for loss factors and for frequency discrepancies.  The constant loss of G' is part of the
law's loss; what the others do is a few hundredths of a per cent of the response.
"""

import numpy as np
from pydantic import ValidationError

from recordings.errors import InputError
from recordings.numbers import LARGEST
from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.gauss_newton import Solution
from twin.identify.limits import LIMITS
from twin.identify.measured_data import MeasuredData
from twin.rigs import LayerLawTable, Rig
from twin.structure import normal_modes


def updated_rig(evidence: MeasuredData, baseline: BaselineParameters, solution: Solution) -> Rig:
    """The rig of `evidence` at the preload that was measured, which alone has this law.

    Parameters
    ----------
    baseline
        Parameters at the minimum.
    solution
        The minimum; its vector begins with those of ``baseline``.

    Raises
    ------
    InputError
        If the minimum is nowhere near a joint.
    """
    rig, base = evidence.rig, baseline.base
    nominal = list(rig.damping.modal_ratio)
    # Modes beyond the list take its last entry, so the assumed one must stay the last.
    relative = np.sqrt(np.diag(solution.covariance))[baseline.blocks["log_zeta"]]
    damping = rig.damping.model_copy(
        update={
            "modal_ratio": [*map(float, base.zeta), *(nominal[LIMITS.damped_modes :] or nominal[-1:])],
            "modal_ratio_std": (relative * base.zeta).tolist(),
        }
    )
    joints = []
    for number, joint in enumerate(rig.joints):
        identified = {"normal_modulus": float(base.E[number]), "shear_modulus": float(base.G[number])}
        moduli = joint.preload[evidence.preload].model_copy(update=identified)
        law = _law_table(evidence, baseline, solution, number)
        joints.append(joint.model_copy(update={"preload": {evidence.preload: moduli}, "law": law}))
    measured = {name: table for name, table in rig.measured.items() if name == evidence.preload}
    return rig.with_joints(joints).model_copy(update={"damping": damping, "measured": measured})


def _law_table(evidence: MeasuredData, baseline: BaselineParameters, solution: Solution, joint: int) -> LayerLawTable:
    """Softening and loss with standard deviations of what a response feels: E' - g1, and g2 with mode 1's damping."""
    law, base, blocks = baseline.laws[joint], baseline.base, baseline.blocks
    G, loss_G = base.G[joint], base.loss_G[joint]
    opening, slip = _file_knots(law.opening_knots), _file_knots(law.slip_knots)
    seen = len(evidence.steps) > 0
    if not seen:  # nothing but the constant loss is known, and the splines' wide prior does not count
        opening, slip = opening[[0, -1]], slip[[0, -1]]
    softens, loses = law.softening_basis(opening), law.loss_basis(slip)
    by_E, by_loss = np.zeros((len(opening), len(solution.x))), np.zeros((len(slip), len(solution.x)))
    by_E[:, blocks["log_E"].start + joint] = base.E[joint]
    by_loss[:, blocks["log_G"].start + joint], by_loss[:, blocks["loss_G"].start + joint] = G * loss_G, G
    by_loss[:, blocks["log_zeta"].start] = _loss_of_mode_1(evidence, baseline, joint)
    if seen:
        by_E[:, baseline.softening(joint)], by_loss[:, baseline.loss(joint)] = -softens, loses
    try:
        return LayerLawTable(
            opening_m=opening.tolist(),
            softening=(softens @ law.softening).tolist(),
            slip_m=slip.tolist(),
            loss=np.maximum(G * loss_G + loses @ law.loss, 0.0).tolist(),
            softening_std=_std(by_E, solution.covariance),
            loss_std=_std(by_loss, solution.covariance),
        )
    except ValidationError as error:
        reason = "the fit comes to values that no layer has: do the recordings belong to this rig?"
        remedy = f"look at them with 'twin check RUN... --rig {evidence.rig.name}'"
        raise InputError(evidence.rig.name, f"joint {evidence.rig.joints[joint].name}, law", reason, remedy) from error


def _file_knots(knots: Array) -> Array:
    return np.concatenate([[0.0], np.geomspace(knots[0] / LIMITS.updated_rig_below, knots[-1], LIMITS.law_points)])


def _loss_of_mode_1(evidence: MeasuredData, baseline: BaselineParameters, joint: int) -> float:
    """Loss modulus in shear that is worth the damping ratio of mode 1, N/m2: a sweep tells their sum, not each."""
    structure, base = evidence.model.structure, baseline.base
    modes = normal_modes(structure.M, structure.stiffness(base.E, base.G), 1)
    sheared = float(np.sum((structure.joints[joint].B_G @ modes.Phi[:, 0]) ** 2))
    return float(2 * modes.omega[0] ** 2 / sheared * base.zeta[0])


def _std(rows: Array, covariance: Array) -> list[float]:
    """Standard deviations; of what the data say nothing of, the largest that a file can have."""
    variance = np.einsum("xi,ij,xj->x", rows, covariance, rows)
    return np.clip(np.sqrt(np.maximum(variance, 0.0)), 0.0, LARGEST).tolist()
