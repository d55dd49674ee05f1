"""A sensor resonates on its mount: wax gone soft, a loose stud, a magnet base."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from twin.diagnose.cause import Cause, Parameter, Values, response_channels
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension

__all__ = ["MountingResonance"]


class MountingResonance(Cause):
    """The sensor's own resonance amplifies one channel."""

    name = "mounting-resonance"
    summary = "a sensor rides on a soft mount and resonates"

    def labels(self, evidence: Evidence) -> Sequence[Mapping[str, str]]:
        """Any response channel."""
        return response_channels(evidence)

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """Frequency and damping; far above the band there is no effect."""
        return (
            Parameter(name="frequency_Hz", scale=5e3, lower=50.0, upper=1e5, null=1e5,
                      starts=(3000.0, 1500.0, 800.0, 6000.0)),
            Parameter(name="damping_ratio", scale=0.1, lower=1e-3, upper=0.7, starts=(0.02, 0.1)),
        )  # fmt: skip

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """Base excitation of a single degree of freedom."""
        w, z = 2 * np.pi * values["frequency_Hz"], values["damping_ratio"]

        def factor(omega: Any) -> Any:
            r = omega / w
            return 1 / (1 - r**2 + 2j * z * r)

        return Extension(channel_factor={label["channel"]: factor})
