"""A mass nobody told the model of: a cable clamp, a heavier sensor, a magnet left on."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twin.diagnose.cause import Cause, Parameter, Values, position
from twin.identify.evidence import Evidence
from twin.identify.extension import Attachment, Extension
from twin.structure import Structure

__all__ = ["AddedMass"]


class AddedMass(Cause):
    """Adds -omega^2 m at a place, along and across the beam."""

    name = "added-mass"
    summary = "a mass sits on the structure that the model does not have"

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """Mass and where it sits."""
        return (
            Parameter(name="mass_kg", scale=0.02, lower=-0.05, upper=0.5, null=0.0, starts=(0.004,), model_error=0.002),
            position(evidence),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """A point mass."""
        x, mass = values["position_m"], values["mass_kg"]

        def rows(s: Structure) -> np.ndarray:
            return np.array([s.deflection(x), s.axial(x)])

        return Extension(attachments=(Attachment(rows, lambda omega: -mass * omega[:, None] ** 2 * np.ones(2)),))
