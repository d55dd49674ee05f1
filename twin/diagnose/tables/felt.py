"""Causes that natural frequencies of small motion can show."""

from dataclasses import fields

from twin.diagnose.cause import Cause
from twin.diagnose.models import CAUSES
from twin.identify.model_modification import ModelModification
from twin.identify.residuals.frequency_model import mass_and_spring
from twin.identify.residuals.natural_frequencies import MeasuredFrequencies

STRUCTURAL = {"beam_modulus", "beam_shear_ratio", "clamp_rad_per_Nm", "layer_gradient", "moduli_factor", "attachments"}
"""What of an extension natural frequencies feel."""


def felt_causes(evidence: MeasuredFrequencies) -> dict[str, Cause]:
    """Of the causes those that act on the structure, linearly and without loss, and are not identified anyway."""
    return {name: cause for name, cause in CAUSES.items() if _is_felt(evidence, cause)}


def _is_felt(evidence: MeasuredFrequencies, cause: Cause) -> bool:
    empty, known = ModelModification(), all(len(beams) == 1 for beams in evidence.materials) and evidence.materials
    for label in cause.labels(evidence):
        acts = cause.begun(evidence, label)
        touched = {f.name for f in fields(ModelModification) if getattr(acts, f.name) != getattr(empty, f.name)}
        structure = evidence.model.structure
        plain = all(mass_and_spring(attachment, structure) is not None for attachment in acts.attachments)
        if touched and touched <= STRUCTURAL and plain and not (known and touched == {"beam_modulus"}):
            return True
    return False
