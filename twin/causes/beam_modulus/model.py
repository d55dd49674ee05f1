"""Young's modulus of one beam is not what the data sheet says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from twin.diagnose.cause import Cause, Parameter, Values
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension

__all__ = ["BeamModulus"]


class BeamModulus(Cause):
    """Scales the bending and axial stiffness of one beam."""

    name = "beam-modulus"
    summary = "a beam is softer or stiffer than its material data say"

    def labels(self, evidence: Evidence) -> Sequence[Mapping[str, str]]:
        """Any beam."""
        return tuple({"beam": beam.name} for beam in evidence.rig.layout().beams)

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """True over believed modulus."""
        return (
            Parameter(name="factor", scale=0.05, lower=0.3, upper=3.0, null=1.0, starts=(0.98,), model_error=0.025),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """The structure with the beam's modulus scaled."""
        return Extension(beam_modulus={label["beam"]: values["factor"]})
