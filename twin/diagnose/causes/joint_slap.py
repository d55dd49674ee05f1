"""The joint opens on one side of its motion: the layer loses stiffness beyond a gap (micro-slap)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from twin.diagnose.cause import Cause, Parameter, Values
from twin.diagnose.one_sided import one_sided_harmonics
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension, NonlinearForce
from twin.structure import Structure

__all__ = ["JointSlap"]


class JointSlap(Cause):
    """Where the opening exceeds the gap, the layer's normal stiffness is multiplied by a factor.

    Opening and closing differ, so the joint's force has even harmonics, which no law that is odd in the strain has.
    """

    name = "joint-slap"
    summary = "the joint opens on one side of its motion and claps shut"

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """What is left of the stiffness, and the opening at which it goes."""
        gaps = tuple(self._largest_opening(evidence) * share for share in (0.5, 0.2, 0.8, 0.05))
        return (
            Parameter(name="stiffness_factor", scale=0.5, lower=0.0, upper=4.0, null=1.0, starts=(0.9,)),
            Parameter(name="gap_m", scale=2 * gaps[0], lower=0.0, upper=6 * gaps[0], starts=gaps),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """One force for each point of the layer where the opening is integrated."""
        s = evidence.model.structure
        E, gap = evidence.model.reference_E, values["gap_m"]
        forces = []
        for i, weight in enumerate(s.normal_weight):
            k = -(1 - values["stiffness_factor"]) * E * weight**2
            forces.append(_opening_force(i, k, gap))
        return Extension(nonlinear=tuple(forces))

    def _largest_opening(self, evidence: Evidence) -> float:
        """Opening at the layer's most strained point, at the largest measured amplitude."""
        s, phi = evidence.model.structure, evidence.model.basis.Phi[:, 0]
        per_tip = np.max(np.abs(s.B_E @ phi) / s.normal_weight) / abs(s.deflection(evidence.rig.length) @ phi)
        return float(per_tip * max(np.max(evidence.steps.amplitude_m, initial=0.0), 1e-5))


def _opening_force(point: int, k: float, gap: float) -> NonlinearForce:
    def harmonics(a: Any, count: int) -> Any:
        return k * one_sided_harmonics(a, gap, count)

    def equivalent(a: Any, omega: Any) -> Any:
        return harmonics(a, 1)[:, 0] / np.maximum(a, 1e-15)

    def opening(s: Structure) -> Any:
        return s.B_E[point] / s.normal_weight[point]

    return NonlinearForce(opening, equivalent, harmonics)
