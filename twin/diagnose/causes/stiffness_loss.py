"""A crack or a damaged section: a short length of beam bends more easily."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twin.diagnose.cause import Cause, Parameter, Values, position
from twin.identify.evidence import Evidence
from twin.identify.extension import Attachment, Extension
from twin.structure import Structure

__all__ = ["StiffnessLoss"]


class StiffnessLoss(Cause):
    """Takes a part of the bending stiffness off one element's length of beam."""

    name = "stiffness-loss"
    summary = "a short section of a beam is weaker in bending, as a crack makes it"

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """What is left of the section's stiffness, and where it is."""
        return (
            Parameter(name="factor", scale=0.4, lower=0.02, upper=1.0, null=1.0, starts=(0.8,)),
            position(evidence, 17),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """Negative bending stiffness over the section, by two-point quadrature of its curvature."""
        rig = evidence.rig
        total = rig.lower.length + rig.upper.length
        section = total / rig.mesh.beam_elements
        x = values["position_m"]
        beam = rig.lower if x <= rig.lower.length else rig.upper
        points = np.clip(x + section / 2 * np.array([-1, 1]) / np.sqrt(3), 0.0, rig.length)
        lost = (1 - values["factor"]) * beam.youngs_modulus * beam.second_moment * section / 2

        def rows(s: Structure) -> np.ndarray:
            return np.array([s.curvature(point) for point in points])

        return Extension(attachments=(Attachment(rows, lambda omega: np.full((len(omega), 2), -lost)),))
