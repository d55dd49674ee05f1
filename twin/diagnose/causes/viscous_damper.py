"""Something that rubs viscously against the surroundings: a cable in a tight guide, grease, a foam rest."""

from __future__ import annotations

from collections.abc import Mapping

from twin.diagnose.cause import Cause, Parameter, Values, point, position
from twin.identify.evidence import Evidence
from twin.identify.extension import Attachment, Extension

__all__ = ["ViscousDamper"]


class ViscousDamper(Cause):
    """A dashpot to ground."""

    name = "viscous-damper"
    summary = "a dashpot acts between the structure and its surroundings"

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """Damping constant and place."""
        return (
            Parameter(
                name="damping_Ns_per_m", scale=1.0, lower=0.0, upper=100.0, null=0.0, starts=(0.1,), model_error=0.01
            ),
            position(evidence),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """J omega c at the place."""
        c = values["damping_Ns_per_m"]
        at = point(values["position_m"])
        return Extension(attachments=(Attachment(at, lambda omega: 1j * c * omega[:, None]),))
