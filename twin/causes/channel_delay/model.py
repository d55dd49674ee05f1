"""A channel is sampled late: a filter, a multiplexer, a second device not in step."""

import numpy as np

from twin.diagnose.cause import Cause, Label, MeasuredData, ModelModification, Parameter, Values, all_channels


class ChannelDelay(Cause):
    """Turns one channel's phase in proportion to frequency."""

    name = "channel-delay"
    summary = "a channel lags behind the others by a constant time"
    labels = staticmethod(all_channels)
    numbers = (Parameter(name="delay_s", scale=2e-4, lower=-0.01, upper=0.01, null=0.0, starts=(1e-5,)),)

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """exp(-j omega delay)."""
        return ModelModification(
            channel_factor={label["channel"]: lambda omega: np.exp(-1j * omega * values["delay_s"])}
        )
