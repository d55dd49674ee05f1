"""The converter's clock is off, so that every frequency is."""

from twin.diagnose.cause import Cause, Label, MeasuredData, ModelModification, Parameter, Values


class SampleClock(Cause):
    """Scales the frequency axis."""

    name = "sample-clock"
    summary = "the sampling clock runs fast or slow, so that all frequencies are off by one factor"
    numbers = (Parameter(name="error_ppm", scale=1000.0, lower=-5e4, upper=5e4, null=0.0, starts=(100.0,)),)

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """True over apparent frequency."""
        return ModelModification(frequency_factor=1 + values["error_ppm"] * 1e-6)
