"""A crack or a damaged section: a short length of beam bends more easily."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from twin.diagnose.cause import Cause, Parameter, Values, position
from twin.identify.evidence import Evidence
from twin.identify.extension import Attachment, Extension
from twin.structure import Structure
from twin.structure.beam import beam_stiffness, weakened_stiffness

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
        rig = evidence.rig
        half = (rig.lower.length + rig.upper.length) / rig.mesh.beam_elements / 2
        x, factor = values["position_m"], values["factor"]
        mesh = evidence.model.structure.mesh
        lower = x <= rig.lower.length
        beam, nodes, first = (rig.lower, mesh.lower_x, 0) if lower else (rig.upper, mesh.upper_x, len(mesh.lower_x))
        section = {"EA": beam.youngs_modulus * beam.area, "EI": beam.youngs_modulus * beam.second_moment}
        forms, lost = [], []
        for e, (a, b) in enumerate(pairwise(nodes)):
            weak = max(a, x - half) - a, min(b, x + half) - a
            if weak[0] >= weak[1]:
                continue
            element = {**section, "length": float(b - a), "shear_ratio": beam.shear_ratio}
            change = weakened_stiffness(**element, weak=weak, factor=factor) - beam_stiffness(**element)
            size, shape = np.linalg.eigh(change)
            for k in range(3):  # the other three are rigid motions
                form = np.zeros(3 * mesh.nodes)
                form[3 * (first + e) + np.arange(6)] = shape[:, k]
                forms.append(form)
                lost.append(size[k])

        def rows(s: Structure) -> np.ndarray:
            return np.array(forms)[:, s.free]

        return Extension(attachments=(Attachment(rows, lambda omega: np.tile(lost, (len(omega), 1))),))
