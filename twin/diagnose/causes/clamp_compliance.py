"""The clamp turns under the beam's root moment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from twin.diagnose.cause import Cause, Parameter, Values
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension

__all__ = ["ClampCompliance"]


class ClampCompliance(Cause):
    """A rotational spring between the clamp and the beam's root."""

    name = "clamp-compliance"
    summary = "the clamp is not rigid: the beam's root turns under its moment"

    def labels(self, evidence: Evidence) -> Sequence[Mapping[str, str]]:
        """One search where any beam's rotation is held, none where nothing is."""
        layout = evidence.rig.layout()
        beams = {beam.name for beam in layout.beams}
        return ({},) if any("rz" in s.fix and s.part in beams for s in layout.supports) else ()

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """Rotation per moment; one element's own flexibility is the natural unit."""
        layout = evidence.rig.layout()
        held = next(support.part for support in layout.supports if "rz" in support.fix)
        beam = layout.beam(held)
        unit = beam.length / (beam.youngs_modulus * beam.second_moment)
        return (
            Parameter(
                name="rotational_rad_per_Nm", scale=0.02 * unit, lower=1e-6 * unit, upper=unit, null=1e-6 * unit,
                starts=(0.005 * unit,), model_error=0.004,
            ),
        )  # fmt: skip

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """The structure with its root free to turn against a spring."""
        return Extension(clamp_rad_per_Nm=values["rotational_rad_per_Nm"])
