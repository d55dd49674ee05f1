"""A sensor resonates on its mount: wax gone soft, a loose stud, a magnet base."""

import numpy as np

from twin.diagnose.cause import Cause, Label, MeasuredData, ModelModification, Parameter, Values, response_channels
from twin.identify.nominal_instruments import mount


def _compliance(frequency_Hz: float) -> float:
    """Displacement per acceleration of the base, s^2."""
    return float((2 * np.pi * frequency_Hz) ** -2)


def _lag(frequency_Hz: float, damping_ratio: float) -> float:
    """Time by which the damping delays the channel well below resonance, s."""
    return damping_ratio / (np.pi * frequency_Hz)


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
            name="compliance_s2", scale=_compliance(1000.0), lower=0.0, upper=_compliance(50.0), null=0.0,
            starts=(_compliance(3000.0),), tolerance=5e-5,
        ),
        Parameter(
            name="lag_s", scale=_lag(1000.0, 0.1), lower=0.0, upper=_lag(50.0, 0.7), null=0.0,
            starts=(_lag(3000.0, 0.02),), tolerance=5e-5,
        ),
    )  # fmt: skip

    def reported(self, values: Values, std: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Frequency and damping ratio."""
        softness = max(values["compliance_s2"], _compliance(1e6))
        frequency = 1 / (2 * np.pi * np.sqrt(softness))
        ratio, errors = values["lag_s"] * np.pi * frequency, {}
        if std:
            errors["frequency_Hz"] = 0.5 * frequency * std["compliance_s2"] / softness
            of_lag, of_frequency = std["lag_s"] * np.pi * frequency, ratio * errors["frequency_Hz"] / frequency
            errors["damping_ratio"] = float(np.hypot(of_lag, of_frequency))
        return {"frequency_Hz": frequency, "damping_ratio": ratio}, errors

    def from_reported(self, values: Values) -> dict[str, float]:
        """Return compliance and lag in place of frequency and damping ratio."""
        frequency = values["frequency_Hz"]
        return {"compliance_s2": _compliance(frequency), "lag_s": _lag(frequency, values["damping_ratio"])}

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """Base excitation of a single degree of freedom."""
        return ModelModification(channel_factor={label["channel"]: mount(values["compliance_s2"], values["lag_s"])})
