"""A recorded run as a source of samples: what was measured comes again, bit for bit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from recordings.errors import InputError
from recordings.run import Channel, DeviceSamples, Run, SampleBlock
from recordings.streams import Excitation

__all__ = ["RecordedSource"]


class RecordedSource:
    """A :class:`recordings.streams.SampleSource` over a run.

    Samples of all devices are served as if one converter had taken them: each device is shifted by whole samples so
    that its times fit the first device's.  Lost samples are NaN.  What the generator is told is ignored.

    Raises
    ------
    InputError
        If the run holds no samples, or devices of different rates.
    """

    def __init__(self, run: Run) -> None:
        devices = [device for device in run.devices.values() if len(device.block_start)]
        if not devices:
            raise InputError(run.path, "", "there are no samples in it to replay")
        first = devices[0]
        for device in devices:
            if device.sample_rate_Hz != first.sample_rate_Hz:
                raise InputError(
                    run.path,
                    f"device {device.device}",
                    f"runs at {device.sample_rate_Hz:g} Hz, {first.device} at {first.sample_rate_Hz:g} Hz",
                    "a replay has one rate",
                )
        self._rate_Hz = first.sample_rate_Hz
        self._first = first
        self._index = 0
        shifts = [round((d.block_time_ns[0] - first.block_time_ns[0]) * 1e-9 * self._rate_Hz) for d in devices]
        start = min(shifts)
        self._lead = -start
        ends = [shift + _length(device) for shift, device in zip(shifts, devices, strict=True)]
        self._values = {}
        for shift, device in zip(shifts, devices, strict=True):
            for name, samples in device.values.items():
                values = np.full(max(ends) - start, np.nan, np.float32)
                values[shift - start : shift - start + len(samples)] = samples
                self._values[name] = values
        self._channels = tuple(run.channels[name] for name in run.channels if name in self._values)
        self._length = max(ends) - start

    @property
    def channels(self) -> Sequence[Channel]:
        """Channels that have samples."""
        return self._channels

    @property
    def sample_rate_Hz(self) -> float:
        """Rate of the recording."""
        return self._rate_Hz

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        """There is one rate."""
        return self._rate_Hz

    def set_output(self, excitation: Excitation) -> None:
        """What was recorded was driven by its own generator."""

    def read(self, count: int) -> SampleBlock:
        """The next samples of the recording; fewer at its end."""
        start = self._index
        stop = min(start + count, self._length)
        self._index = stop
        samples = {channel.name: self._values[channel.name][start:stop] for channel in self._channels}
        overload = {
            channel.name: int(np.count_nonzero(np.abs(samples[channel.name]) >= channel.range))
            for channel in self._channels
            if channel.range
        }
        return SampleBlock(
            device=self._first.device,
            time_ns=self._time_ns(start),
            first_index=start,
            sample_rate_Hz=self._rate_Hz,
            samples=samples,
            overload=overload,
        )

    def _time_ns(self, index: int) -> int:
        """The time recorded for a sample, counted from the block before it."""
        at = index - self._lead
        block = max(0, int(np.searchsorted(self._first.block_start, at, side="right")) - 1)
        offset = at - int(self._first.block_start[block])
        return int(self._first.block_time_ns[block]) + round(offset * 1e9 / self._rate_Hz)


def _length(device: DeviceSamples) -> int:
    return max(len(samples) for samples in device.values.values())
