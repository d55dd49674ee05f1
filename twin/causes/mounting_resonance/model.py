"""A sensor resonates on its mount: wax gone soft, a loose stud, a magnet base."""

import numpy as np

from twin.diagnose.cause import Cause, Label, MeasuredData, ModelModification, Parameter, Values, response_channels
from twin.identify.nominal_instruments import mount


def _compliance(frequency_Hz: float) -> float:
    """Displacement per acceleration of the base, s^2."""
    return float((2 * np.pi * frequency_Hz) ** -2)


class MountingResonance(Cause):
    """The sensor's own resonance amplifies one channel.

    Fitted by the compliance 1 / (2 pi f)^2, with which the effect grows from nothing; reported by its frequency.
    """

    name = "mounting-resonance"
    summary = "a sensor rides on a soft mount and resonates"
    labels = staticmethod(response_channels)
    numbers = (
        Parameter(
            name="compliance_s2", scale=_compliance(1000.0), lower=0.0, upper=_compliance(50.0), null=0.0,
            starts=(_compliance(3000.0),), tolerance=5e-5,
        ),
        Parameter(name="damping_ratio", scale=0.1, lower=1e-3, upper=0.7, starts=(0.02, 0.1)),
    )  # fmt: skip

    def reported(self, values: Values, std: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Frequency and damping ratio."""
        softness = max(values["compliance_s2"], _compliance(1e6))
        frequency = 1 / (2 * np.pi * np.sqrt(softness))
        errors = {name: std[name] for name in std if name == "damping_ratio"}
        if "compliance_s2" in std:
            errors["frequency_Hz"] = 0.5 * frequency * std["compliance_s2"] / softness
        return {"frequency_Hz": frequency, "damping_ratio": values["damping_ratio"]}, errors

    def from_reported(self, values: Values) -> dict[str, float]:
        """Return the compliance in place of the frequency."""
        return {"compliance_s2": _compliance(values["frequency_Hz"]), "damping_ratio": values["damping_ratio"]}

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """Base excitation of a single degree of freedom."""
        factor = mount(values["compliance_s2"], values["damping_ratio"])
        return ModelModification(channel_factor={label["channel"]: factor})
