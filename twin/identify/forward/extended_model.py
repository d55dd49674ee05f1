"""The linear model of a rig with an extension's structure, positions and ports."""

import numpy as np

from twin.identify.linear.linear_model import LinearModel
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification


def extended_model(evidence: MeasuredData, modification: ModelModification) -> LinearModel:
    """The linear model with the extension's structure, positions and ports."""
    model = evidence.model
    if modification.changes_structure or modification.output_offset_m or modification.drive_offset_m:
        model = evidence.changed_models.model(modification, evidence.outputs)
    rows = [attachment.rows(model.structure) for attachment in modification.attachments]
    rows += [force.row(model.structure)[None] for force in modification.nonlinear]
    if modification.base_receptance:
        s = model.structure
        rows.append((s.M @ s.rigid_translation(evidence.rig.drive_place.direction))[None])
    return model.with_ports(np.vstack(rows)) if rows else model
