"""The bolt loses preload while the test runs."""

from twin.causes.joints import JointCause
from twin.diagnose.cause import Label, MeasuredData, ModelModification, Parameter, Values, fall_per_second


class PreloadLoss(JointCause):
    """E' falls linearly with time."""

    name = "preload-loss"
    summary = "the joint softens while the test goes on, as a bolt that loses its preload does"
    tried_at_full_size = True

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Relative fall per second."""
        return (fall_per_second(evidence, scale=0.2, least=-0.5, most=0.95, start=0.02),)

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """A drift of the layer's normal modulus."""
        return ModelModification(layer_drift_per_s={self.joint(evidence, label): values["rate_per_s"]})
