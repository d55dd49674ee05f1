"""The bolt loses preload while the test runs."""

from twin.causes.joints import JointCause
from twin.diagnose.cause import (
    Label,
    MeasuredData,
    ModelModification,
    Parameter,
    Values,
    measured_duration_s,
)


class PreloadLoss(JointCause):
    """E' falls linearly with time."""

    name = "preload-loss"
    summary = "the joint softens while the test goes on, as a bolt that loses its preload does"
    tried_at_full_size = True

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Relative fall per second."""
        duration = measured_duration_s(evidence)
        return (
            Parameter(name="rate_per_s", scale=0.2 / duration, lower=-0.5 / duration, upper=0.95 / duration, null=0.0,
                      starts=(0.02 / duration,)),
        )  # fmt: skip

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """A drift of the layer's normal modulus."""
        return ModelModification(layer_drift_per_s={self.joint(evidence, label): values["rate_per_s"]})
