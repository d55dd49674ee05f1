"""A channel has a high-pass that nobody entered: AC coupling, a charge amplifier's time constant."""

from twin.diagnose.cause import Cause, Label, MeasuredData, ModelModification, Parameter, Values, all_channels
from twin.identify.nominal_instruments import high_pass


class AcCoupling(Cause):
    """A first-order high-pass in one channel."""

    name = "ac-coupling"
    summary = "a channel loses its low frequencies through a high-pass nobody entered"
    labels = staticmethod(all_channels)
    numbers = (Parameter(name="corner_Hz", scale=2.0, lower=0.0, upper=50.0, null=0.0, starts=(0.2,)),)

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """J omega / (j omega + omega_c)."""
        return ModelModification(channel_factor={label["channel"]: high_pass(values["corner_Hz"])})
