"""A crack or a damaged section: a short length of beam bends more easily."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twin.diagnose.cause import Cause, Parameter, Values, position
from twin.identify.evidence import Evidence
from twin.identify.extension import Attachment, Extension
from twin.structure import Structure
from twin.structure.weakened import weakened_elements

__all__ = ["StiffnessLoss"]


class StiffnessLoss(Cause):
    """Takes a part of the stiffness off one element's length of beam."""

    name = "stiffness-loss"
    summary = "a short section of a beam is weaker in bending, as a crack makes it"

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """What is left of the section's stiffness, and where it is."""
        return (
            Parameter(name="factor", scale=0.4, lower=0.02, upper=1.0, null=1.0, starts=(0.8,), model_error=0.01),
            position(evidence, 17, model_error=6e-3),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """What an element that the section covers, wholly or in part, has less than a sound one."""
        mesh = evidence.model.structure.mesh
        forms, lost = [], []
        place = values["position_m"]
        for first, change in weakened_elements(evidence.rig, mesh, position_m=place, factor=values["factor"]):
            size, shape = np.linalg.eigh(change)
            for k in range(3):  # the other three are rigid motions
                form = np.zeros(3 * mesh.nodes)
                form[first + np.arange(6)] = shape[:, k]
                forms.append(form)
                lost.append(size[k])

        def rows(s: Structure) -> np.ndarray:
            return np.array(forms)[:, s.free]

        return Extension(attachments=(Attachment(rows, lambda omega: np.tile(lost, (len(omega), 1))),))
