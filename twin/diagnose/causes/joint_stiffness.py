"""The joint's linear stiffness is far from what was believed: another torque, another surface."""

from __future__ import annotations

from collections.abc import Mapping

from twin.diagnose.cause import Cause, Parameter, Values
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension

__all__ = ["JointStiffness"]


class JointStiffness(Cause):
    """Factors on E' and G' beyond the ten per cent that no experimenter knows."""

    name = "joint-stiffness"
    summary = "the joint's E' and G' are not those that were believed"

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """Factors on both moduli."""
        return (
            Parameter(name="normal_factor", scale=0.7, lower=0.02, upper=20.0, null=1.0, starts=(0.8,)),
            Parameter(name="shear_factor", scale=0.7, lower=0.02, upper=20.0, null=1.0, starts=(1.0,)),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """Scaled moduli."""
        return Extension(moduli_factor=(values["normal_factor"], values["shear_factor"]))
