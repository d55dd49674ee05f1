"""A sensor sits at another place than was written down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from twin.diagnose.cause import Cause, Parameter, Values, response_channels
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension

__all__ = ["SensorPosition"]


class SensorPosition(Cause):
    """Moves the place where one channel measures."""

    name = "sensor-position"
    summary = "a sensor sits at another place than was written down"

    def labels(self, evidence: Evidence) -> Sequence[Mapping[str, str]]:
        """Any response channel."""
        return response_channels(evidence)

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """Offset towards the tip."""
        x, L = _position(evidence, label), evidence.rig.length
        return (Parameter(name="offset_m", scale=0.01, lower=-0.5 * x, upper=L - x, null=0.0, starts=(-0.001,)),)

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """The channel read elsewhere; its mass is small enough to stay."""
        return Extension(output_position_m={label["channel"]: _position(evidence, label) + values["offset_m"]})


def _position(evidence: Evidence, label: Mapping[str, str]) -> float:
    return next(o.position_m for o in evidence.outputs if o.channel == label["channel"])
