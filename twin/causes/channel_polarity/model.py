"""A channel is wired or mounted the wrong way round."""

from collections.abc import Mapping

import numpy as np

from twin.diagnose.cause import Cause, Values, all_channels
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification


class ChannelPolarity(Cause):
    """Changes the sign of one channel; there is nothing to estimate."""

    name = "channel-polarity"
    summary = "a channel reads with the wrong sign"
    labels = staticmethod(all_channels)

    def modification(self, evidence: MeasuredData, label: Mapping[str, str], values: Values) -> ModelModification:
        """The factor -1."""
        return ModelModification(channel_factor={label["channel"]: lambda omega: np.full(len(omega), -1 + 0j)})
