"""The structure warms up while the test runs."""

from twin.diagnose.cause import Cause, Label, MeasuredData, ModelModification, Parameter, Values, measured_duration_s


class TemperatureDrift(Cause):
    """All moduli fall linearly with time."""

    name = "temperature-drift"
    summary = "all resonances sink slowly while the test goes on, as in a structure that warms up"
    tried_at_full_size = True

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Relative fall per second."""
        duration = measured_duration_s(evidence)
        return (
            Parameter(name="rate_per_s", scale=0.01 / duration, lower=-0.2 / duration, upper=0.2 / duration, null=0.0,
                      starts=(0.002 / duration,)),
        )  # fmt: skip

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """A drift of all moduli."""
        return ModelModification(beam_drift_per_s=values["rate_per_s"])
