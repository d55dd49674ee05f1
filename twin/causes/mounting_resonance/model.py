"""A sensor resonates on its mount: wax gone soft, a loose stud, a magnet base."""

import numpy as np

from twin.diagnose.cause import Cause, Label, MeasuredData, ModelModification, Parameter, Values, response_channels
from twin.identify.nominal_instruments import mount, mounted

USUAL, SOFTEST, BEGUN = mounted(1000.0, 0.1), mounted(50.0, 0.7), mounted(3000.0, 0.02)
"""Compliance and lag: the scale of their priors, the largest, and where a search begins."""
STIFFEST = mounted(1e6, 0.0)[0]
"""Least compliance that has a frequency to report."""


class MountingResonance(Cause):
    """The sensor's own resonance amplifies one channel.

    Fitted by the compliance 1 / (2 pi f)^2 and by the lag zeta / (pi f), in which the response is linear at first;
    reported by frequency and damping ratio.
    """

    name = "mounting-resonance"
    summary = "a sensor rides on a soft mount and resonates"
    labels = staticmethod(response_channels)
    numbers = (
        Parameter(
            name="compliance_s2", scale=USUAL[0], lower=0.0, upper=SOFTEST[0], null=0.0,
            starts=(BEGUN[0],), tolerance=5e-5,
        ),
        Parameter(
            name="lag_s", scale=USUAL[1], lower=0.0, upper=SOFTEST[1], null=0.0,
            starts=(BEGUN[1],), tolerance=5e-5,
        ),
    )  # fmt: skip

    def reported(self, values: Values, std: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Frequency and damping ratio."""
        softness = max(values["compliance_s2"], STIFFEST)
        frequency = 1 / (2 * np.pi * np.sqrt(softness))
        ratio, errors = values["lag_s"] * np.pi * frequency, {}
        if std:
            errors["frequency_Hz"] = 0.5 * frequency * std["compliance_s2"] / softness
            of_lag, of_frequency = std["lag_s"] * np.pi * frequency, ratio * errors["frequency_Hz"] / frequency
            errors["damping_ratio"] = float(np.hypot(of_lag, of_frequency))
        return {"frequency_Hz": frequency, "damping_ratio": ratio}, errors

    def from_reported(self, values: Values) -> dict[str, float]:
        """Return compliance and lag in place of frequency and damping ratio."""
        compliance, lag = mounted(values["frequency_Hz"], values["damping_ratio"])
        return {"compliance_s2": compliance, "lag_s": lag}

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """Base excitation of a single degree of freedom."""
        return ModelModification(channel_factor={label["channel"]: mount(values["compliance_s2"], values["lag_s"])})
