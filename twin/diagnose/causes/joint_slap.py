"""The joint opens on one side of its motion: the layer loses stiffness beyond a gap (micro-slap)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from twin.diagnose.cause import Cause, Parameter, Values
from twin.diagnose.opening import opening_harmonics
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension, JointState, NonlinearForce
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
            Parameter(
                name="stiffness_factor", scale=0.5, lower=0.0, upper=4.0, null=1.0, starts=(0.9,), model_error=0.1
            ),
            Parameter(name="gap_m", scale=2 * gaps[0], lower=0.0, upper=6 * gaps[0], starts=gaps, model_error=0.08),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """The even part of the force on the layer's rms opening in the shape of mode 1."""
        s, phi = evidence.model.structure, evidence.model.basis.Phi[:, 0]
        tip = np.sign(s.deflection(evidence.rig.length) @ phi)
        pattern = tip * (s.B_E @ phi) / np.linalg.norm(s.B_E @ phi)
        area = float(np.sum(s.normal_weight**2))
        k = evidence.model.reference_E * area
        force = _opening_force(pattern / np.sqrt(area), k, values["gap_m"], values["stiffness_factor"])
        return Extension(nonlinear=(force,))

    def _largest_opening(self, evidence: Evidence) -> float:
        """Rms opening of the layer at the largest measured amplitude, in the shape of mode 1."""
        s, phi = evidence.model.structure, evidence.model.basis.Phi[:, 0]
        rms = np.linalg.norm(s.B_E @ phi) / np.sqrt(np.sum(s.normal_weight**2))
        per_tip = rms / abs(s.deflection(evidence.rig.length) @ phi)
        return float(per_tip * max(np.max(evidence.steps.amplitude_m, initial=0.0), 1e-5))


def _opening_force(pattern: Any, k: float, gap: float, factor: float) -> NonlinearForce:
    def harmonics(a: Any, count: int, joint: JointState) -> Any:
        return k * opening_harmonics(a, joint, gap=gap, factor=factor, count=count)

    def equivalent(a: Any, omega: Any) -> Any:
        # At the fundamental the slap is one with the joint's law, whose function of amplitude is free to take it in.
        return np.zeros_like(a)

    def opening(s: Structure) -> Any:
        return pattern @ s.B_E

    return NonlinearForce(opening, equivalent, harmonics)
