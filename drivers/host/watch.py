"""What the samples of a channel tell about its sensor: stuck on a value, beyond the converter's limit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.host.device import Mailbox

__all__ = ["ChannelWatch"]

STUCK_S = 0.5
STUCK_SAMPLES = 256


class ChannelWatch:
    """Looks at every block of a channel, and reports the beginning and the end of what is wrong with it."""

    def __init__(self, channel: str, mailbox: Mailbox) -> None:
        self._channel = channel
        self._mailbox = mailbox
        self._value = np.float32(np.nan)
        self._same = 0
        self._stuck = False
        self._overloaded = False

    def look(self, samples: NDArray[np.float32], overload: int, time_ns: int, sample_rate_Hz: float) -> None:
        """Take the next samples, of which `overload` sit on the limit."""
        changes = np.flatnonzero(samples[1:] != samples[:-1])
        if len(changes):
            self._same = len(samples) - 1 - int(changes[-1])
        else:
            self._same = len(samples) + (self._same if samples[0] == self._value else 0)
        self._value = samples[-1]
        stuck = self._same >= max(STUCK_SAMPLES, STUCK_S * sample_rate_Hz)
        if stuck and not self._stuck:
            detail = f"has read {float(self._value):g} for {self._same / sample_rate_Hz:.3g} s"
            self._mailbox.report(self._channel, "stuck", detail, time_ns=time_ns)
        self._stuck = stuck
        if overload and not self._overloaded:
            detail = f"{overload} of {len(samples)} samples on the converter's limit"
            self._mailbox.report(self._channel, "overload", detail, time_ns=time_ns)
        self._overloaded = overload > 0
