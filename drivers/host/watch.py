"""What the samples of a channel tell about its sensor: stuck on a value, beyond the converter's limit."""

import numpy as np
from numpy.typing import NDArray

from drivers.host.device import Mailbox

STUCK_S = 0.5
STUCK_SAMPLES = 256


class ChannelWatch:
    """Looks at every block of a channel, and reports when something goes wrong with it, and when that has ended.

    A sensor is taken to be stuck after half a second (and 256 samples) of one value; the event has the time at which
    that began.  The samples are kept: they are what the sensor gave.
    """

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
        moves = samples[0] != self._value or len(changes) > 0
        if moves and self._stuck:
            first = 0 if samples[0] != self._value else int(changes[0]) + 1
            at_ns = time_ns + round(first * 1e9 / sample_rate_Hz)
            self._mailbox.report(self._channel, "moves-again", "the sensor is not stuck any more", time_ns=at_ns)
            self._stuck = False
        if len(changes):
            self._same = len(samples) - 1 - int(changes[-1])
        else:
            self._same = len(samples) + (0 if moves else self._same)
        self._value = samples[-1]
        if not self._stuck and self._same >= max(STUCK_SAMPLES, STUCK_S * sample_rate_Hz):
            since_ns = time_ns + round((len(samples) - self._same) * 1e9 / sample_rate_Hz)
            detail = f"has read {float(self._value):g} for {self._same / sample_rate_Hz:.3g} s"
            self._mailbox.report(self._channel, "stuck", detail, time_ns=max(0, since_ns))
            self._stuck = True
        if overload and not self._overloaded:
            detail = f"{overload} of {len(samples)} samples on the converter's limit"
            self._mailbox.report(self._channel, "overload", detail, time_ns=time_ns)
        elif self._overloaded and not overload:
            detail = "no more samples on the converter's limit"
            self._mailbox.report(self._channel, "overload-ended", detail, time_ns=time_ns)
        self._overloaded = overload > 0
