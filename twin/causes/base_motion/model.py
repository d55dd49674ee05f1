"""The clamp's foundation moves with the drive force."""

from collections.abc import Mapping

from twin.diagnose.cause import Cause, Parameter, Values
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification


class BaseMotion(Cause):
    """The clamp moves across the beam by a receptance times the drive force, and carries the beam along."""

    name = "base-motion"
    summary = "the clamp is not at rest: it moves with the drive force"
    numbers = (
        Parameter(
            name="receptance_m_per_N", scale=3e-7, lower=-1e-4, upper=1e-4, null=0.0, starts=(1e-8,), model_error=0.015
        ),
    )

    def modification(self, evidence: MeasuredData, label: Mapping[str, str], values: Values) -> ModelModification:
        """A moving clamp."""
        return ModelModification(base_receptance=values["receptance_m_per_N"])
