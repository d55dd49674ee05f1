"""A channel's sensitivity is wrong: a mistyped calibration, a gain switch."""

import numpy as np

from twin.diagnose.cause import Cause, Label, MeasuredData, ModelModification, Parameter, Values, all_channels


class ChannelGain(Cause):
    """Multiplies one channel."""

    name = "channel-gain"
    summary = "a channel's sensitivity is not what was entered"
    labels = staticmethod(all_channels)
    numbers = (Parameter(name="factor", scale=0.1, lower=0.01, upper=100.0, null=1.0, starts=(1.01,)),)

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """A constant factor."""
        return ModelModification(
            channel_factor={label["channel"]: lambda omega: np.full(len(omega), values["factor"] + 0j)}
        )
