"""A channel has a high-pass that nobody entered: AC coupling, a charge amplifier's time constant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from twin.diagnose.cause import Cause, Parameter, Values, all_channels
from twin.identify.believed_instruments import high_pass
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension

__all__ = ["AcCoupling"]


class AcCoupling(Cause):
    """A first-order high-pass in one channel."""

    name = "ac-coupling"
    summary = "a channel loses its low frequencies through a high-pass nobody entered"

    def labels(self, evidence: Evidence) -> Sequence[Mapping[str, str]]:
        """Any channel."""
        return all_channels(evidence)

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """The corner frequency."""
        return (
            Parameter(name="corner_Hz", scale=2.0, lower=0.0, upper=50.0, null=0.0, starts=(0.2,), model_error=0.0025),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """J omega / (j omega + omega_c)."""
        return Extension(channel_factor={label["channel"]: high_pass(values["corner_Hz"])})
