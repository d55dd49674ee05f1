"""The structure warms up while the test runs."""

from twin.diagnose.cause import Cause, Label, MeasuredData, ModelModification, Parameter, Values, fall_per_second


class TemperatureDrift(Cause):
    """All moduli fall linearly with time."""

    name = "temperature-drift"
    summary = "all resonances sink slowly while the test goes on, as in a structure that warms up"
    tried_at_full_size = True

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Relative fall per second."""
        return (fall_per_second(evidence, scale=0.01, least=-0.2, most=0.2, start=0.002),)

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """A drift of all moduli."""
        return ModelModification(beam_drift_per_s=values["rate_per_s"])
