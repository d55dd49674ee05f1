"""The extended model as a rig file that every other command accepts."""

from __future__ import annotations

import numpy as np

from twin.diagnose.search import Search
from twin.identify.evidence import Evidence
from twin.rigs import Effect, LawTable, Rig

__all__ = ["extended_rig"]


def extended_rig(evidence: Evidence, search: Search) -> Rig:
    """The believed rig with what was identified and, as effects, what was blamed."""
    rig, unknowns = evidence.rig, search.model.unknowns
    moduli = rig.joint.preload[evidence.preload].model_copy(
        update={"normal_modulus": unknowns.base.E, "shear_modulus": unknowns.base.G}
    )
    joint = {"preload": {**rig.joint.preload, evidence.preload: moduli}}
    if len(evidence.steps):
        std = np.sqrt(np.diag(search.model.solution.covariance))
        first, knots = len(unknowns.base.vector), len(unknowns.law.knots)
        table = LawTable(
            channel=evidence.outputs[evidence.reference].channel,
            amplitude_m=unknowns.law.knots.tolist(),
            softening=unknowns.law.softening.tolist(),
            loss=np.maximum(unknowns.law.loss, 0.0).tolist(),
            softening_std=std[first : first + knots].tolist(),
            loss_std=std[first + knots : first + 2 * knots].tolist(),
        )
        joint["law"] = table  # type: ignore[assignment]
    effects = []
    for blame in search.model.blames:
        values, errors = blame.cause.reported(blame.values, blame.std)
        effects.append(Effect(cause=blame.cause.name, parameters={**blame.label, **values}, std=errors))
    zeta = [float(z) for z in unknowns.base.zeta]
    return rig.model_copy(
        update={
            "joint": rig.joint.model_copy(update=joint),
            "damping": rig.damping.model_copy(update={"modal_ratio": zeta}),
            "effect": [*rig.effect, *effects],
        }
    )
