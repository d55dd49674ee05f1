"""The linear model of a rig with an extension's structure, positions and ports."""

from __future__ import annotations

import numpy as np

from twin.identify.evidence import Evidence
from twin.identify.extension import Extension
from twin.identify.linear_model import LinearModel, Output, build_linear_model
from twin.structure import Structure, assemble

__all__ = ["extended_model", "extended_structure"]


def extended_model(evidence: Evidence, extension: Extension) -> LinearModel:
    """The linear model with the extension's structure, positions and ports."""
    outputs = [
        Output(o.channel, o.quantity, extension.output_position_m.get(o.channel, o.position_m), o.sign)
        for o in evidence.outputs
    ]
    moved = extension.output_position_m or extension.drive_position_m is not None
    model = evidence.model
    if extension.changes_structure or moved:
        model = build_linear_model(
            evidence.rig,
            outputs,
            preload=evidence.preload,
            structure=extended_structure(evidence, extension),
            drive_position_m=extension.drive_position_m,
        )
    rows = [attachment.rows(model.structure) for attachment in extension.attachments]
    rows += [force.row(model.structure)[None] for force in extension.nonlinear]
    if extension.base_receptance:
        s = model.structure
        rigid = np.zeros(3 * s.mesh.nodes)
        rigid[1::3] = 1.0
        rows.append((s.M @ rigid[s.free])[None])
    return model.with_ports(np.vstack(rows)) if rows else model


def extended_structure(evidence: Evidence, extension: Extension) -> Structure:
    """The structure assembled anew where a cause changes it."""
    if not extension.changes_structure:
        return evidence.model.structure
    rig = evidence.rig
    beams = {}
    for name in ("lower", "upper"):
        beam = getattr(rig, name)
        modulus = beam.youngs_modulus * extension.beam_modulus.get(name, 1.0)
        shear = extension.beam_shear_ratio.get(name, beam.shear_ratio)
        beams[name] = beam.model_copy(update={"youngs_modulus": modulus, "shear_ratio": shear})
    spring = 1 / extension.clamp_rad_per_Nm if extension.clamp_rad_per_Nm else None
    structure = assemble(rig.model_copy(update=beams), clamp_rotation_stiffness=spring)
    return structure.with_layer_gradient(extension.layer_gradient) if extension.layer_gradient else structure
