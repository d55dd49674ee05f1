"""A channel is wired or mounted the wrong way round."""

import numpy as np

from twin.diagnose.cause import Cause, Label, MeasuredData, ModelModification, Values, all_channels


class ChannelPolarity(Cause):
    """Changes the sign of one channel; there is nothing to estimate."""

    name = "channel-polarity"
    summary = "a channel reads with the wrong sign"
    labels = staticmethod(all_channels)

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """The factor -1."""
        return ModelModification(channel_factor={label["channel"]: lambda omega: np.full(len(omega), -1 + 0j)})
