"""The clamp's foundation moves with the drive force."""

from __future__ import annotations

from collections.abc import Mapping

from twin.diagnose.cause import Cause, Parameter, Values
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension

__all__ = ["BaseMotion"]


class BaseMotion(Cause):
    """The clamp moves across the beam by a receptance times the drive force, and carries the beam along."""

    name = "base-motion"
    summary = "the clamp is not at rest: it moves with the drive force"

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """Motion of the clamp per force."""
        return (
            Parameter(
                name="receptance_m_per_N",
                scale=3e-7,
                lower=-1e-4,
                upper=1e-4,
                null=0.0,
                starts=(1e-8,),
                model_error=0.015,
            ),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """A moving clamp."""
        return Extension(base_receptance=values["receptance_m_per_N"])
