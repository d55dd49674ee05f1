"""The linear model of a rig with an extension's structure, positions and ports."""

from __future__ import annotations

import numpy as np

from twin.identify.evidence import Evidence
from twin.identify.extension import Extension
from twin.identify.linear_model import LinearModel

__all__ = ["extended_model"]


def extended_model(evidence: Evidence, extension: Extension) -> LinearModel:
    """The linear model with the extension's structure, positions and ports."""
    model = evidence.model
    if extension.changes_structure or extension.output_offset_m or extension.drive_offset_m:
        model = evidence.changed_models.model(extension, evidence.outputs)
    rows = [attachment.rows(model.structure) for attachment in extension.attachments]
    rows += [force.row(model.structure)[None] for force in extension.nonlinear]
    if extension.base_receptance:
        s = model.structure
        rows.append((s.M @ s.rigid_translation(evidence.rig.drive_place.direction))[None])
    return model.with_ports(np.vstack(rows)) if rows else model
