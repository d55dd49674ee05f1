"""A beam so thick or so soft in shear that Euler and Bernoulli do not hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from twin.diagnose.cause import Cause, Parameter, Values
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension

__all__ = ["TransverseShear"]


class TransverseShear(Cause):
    """Timoshenko elements, with rotary inertia, for one beam."""

    name = "transverse-shear"
    summary = "a beam shears: its higher modes lie lower than bending alone would have them"

    def labels(self, evidence: Evidence) -> Sequence[Mapping[str, str]]:
        """Any beam."""
        return tuple({"beam": beam.name} for beam in evidence.rig.layout().beams)

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """E over kappa G: about 3 for a metal, tens for laminates."""
        return (
            Parameter(
                name="modulus_ratio", scale=30.0, lower=1e-3, upper=500.0, null=1e-3, starts=(10.0,), model_error=0.08
            ),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """The structure with one beam of Timoshenko elements."""
        return Extension(beam_shear_ratio={label["beam"]: values["modulus_ratio"]})
