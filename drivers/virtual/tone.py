"""A source whose samples can be computed again from their numbers: what a wire did to them is seen exactly."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from recordings.run import Channel, SampleBlock
from recordings.streams import Excitation

RATES_Hz = (1024.0, 5120.0, 25600.0)
_MIX = 2654435761
"""Knuth's multiplicative hash: neighbouring numbers scatter over all 32 bits."""


class Tone:
    """A :class:`recordings.streams.SampleSource` of sines with a little scatter; deaf to the generator.

    Channel k gives 0.6 of its range times sin(2 pi f t + k), plus a part that depends on the sample's number alone
    and differs from sample to sample, so that no sample passes for another one, not even a period later.

    Parameters
    ----------
    channels
        Names of the channels: the first a force, the others accelerations.
    sample_rate_Hz
        To begin with.
    frequency_Hz
        Of the sine.

    Attributes
    ----------
    index
        Samples given so far.
    """

    def __init__(
        self, channels: Sequence[str], *, sample_rate_Hz: float = RATES_Hz[0], frequency_Hz: float = 97.0
    ) -> None:
        self.channels = tuple(
            Channel(name=name, quantity="acceleration", unit="m/s^2", position_m=0.1 * k, range=490.0)
            if k
            else Channel(name=name, quantity="force", unit="N", position_m=0.05, range=50.0)
            for k, name in enumerate(channels)
        )
        self.sample_rate_Hz = sample_rate_Hz
        self._frequency_Hz = frequency_Hz
        self.index = 0

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        """The nearest of :data:`RATES_Hz`."""
        self.sample_rate_Hz = min(RATES_Hz, key=lambda rate: abs(rate - sample_rate_Hz))
        return self.sample_rate_Hz

    def set_output(self, excitation: Excitation) -> None:
        """There is nothing to drive."""

    def values(self, channel: str, first_index: int, count: int) -> NDArray[np.float32]:
        """Samples `first_index` to `first_index + count - 1` of a channel, in its unit."""
        k = next(k for k, each in enumerate(self.channels) if each.name == channel)
        number = np.arange(first_index, first_index + count, dtype=np.int64)
        scatter = (((number * 8 + k) * _MIX) % (1 << 32)) / (1 << 32) - 0.5
        # Whole turns are taken off in integers and exactly, so that samples repeat however the blocks are cut.
        turns = (number * round(1000 * self._frequency_Hz)) % round(1000 * self.sample_rate_Hz)
        sine = np.sin(2 * np.pi * turns / (1000 * self.sample_rate_Hz) + k)
        limit = self.channels[k].range or 1.0
        return np.asarray(limit * (0.6 * sine + 0.02 * scatter), np.float32)

    def read(self, count: int) -> SampleBlock:
        """The next samples."""
        first = self.index
        self.index += count
        return SampleBlock(
            device="tone",
            time_ns=round(first * 1e9 / self.sample_rate_Hz),
            first_index=first,
            sample_rate_Hz=self.sample_rate_Hz,
            samples={channel.name: self.values(channel.name, first, count) for channel in self.channels},
        )
