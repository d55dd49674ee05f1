"""A recorded run as a source of samples and of a meter's values: what was measured comes again, bit for bit."""

import re
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.instruments import CALLED
from recordings.errors import InputError
from recordings.quantities import known_quantities
from recordings.run import Channel, DeviceSamples, Indicator, Run, SampleBlock, Samples
from recordings.streams import Excitation

_LIMIT_TOLERANCE = 1e-6
"""A sample on a 16-bit converter's limit comes back from its counts a rounding below it."""
_NAMES_LIMIT = 64
"""As many as a meter has channels."""


class RecordedSource:
    """A :class:`recordings.streams.SampleSource` over a run.

    Samples of all devices are served as if one converter had taken them: each device is shifted by whole samples so
    that its times fit the first device's.  Lost samples are NaN.  What the generator is told is ignored.

    Attributes
    ----------
    slips
        By device, how many samples its clock has left the first one's by at the end, where it is more than half a
        one: so far its times are wrong in a replay.

    Raises
    ------
    InputError
        If the run holds no samples, devices of different rates, or channels that no instrument can call so.
    """

    def __init__(self, run: Run) -> None:
        devices = [device for device in run.devices.values() if len(device.block_start)]
        if not devices:
            raise InputError(run.path, "", "there are no samples in it to replay")
        for name in [name for device in devices for name in device.values]:
            if not re.fullmatch(CALLED, name):
                reason = "cannot be asked for over an instrument's line: up to 24 letters, digits, '_', '.' and '-' can"
                raise InputError(run.path, f"channel {name!r:.60}", reason, "view or diagnose the recording itself")
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
        self._placed: dict[str, tuple[int, Samples]] = {}
        for shift, device in zip(shifts, devices, strict=True):
            self._placed |= {name: (shift - start, samples) for name, samples in device.values.items()}
        self._channels = tuple(run.channels[name] for name in run.channels if name in self._placed)
        self._length = max(begin + len(samples) for begin, samples in self._placed.values())
        self.slips = {
            device.device: slip
            for shift, device in zip(shifts, devices, strict=True)
            if abs(slip := _slip(device, first, shift)) > 0.5
        }

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
        samples = {channel.name: self._cut(channel.name, start, stop) for channel in self._channels}
        overload = {
            channel.name: int(np.count_nonzero(np.abs(samples[channel.name]) >= channel.range * (1 - _LIMIT_TOLERANCE)))
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

    def _cut(self, channel: str, start: int, stop: int) -> NDArray[np.float32]:
        """A channel's samples; NaN where its device had not begun yet or had ended."""
        begin, samples = self._placed[channel]
        if begin <= start and stop <= begin + len(samples):
            return samples[start - begin : stop - begin]
        values = np.full(stop - start, np.nan, np.float32)
        inside = slice(max(start, begin), min(stop, begin + len(samples)))
        if inside.start < inside.stop:
            values[inside.start - start : inside.stop - start] = samples[inside.start - begin : inside.stop - begin]
        return values

    def _time_ns(self, index: int) -> int:
        """The time recorded for a sample, counted from the block before it."""
        at = index - self._lead
        block = max(0, int(np.searchsorted(self._first.block_start, at, side="right")) - 1)
        offset = at - int(self._first.block_start[block])
        return int(self._first.block_time_ns[block]) + round(offset * 1e9 / self._rate_Hz)


def _slip(device: DeviceSamples, first: DeviceSamples, shift: int) -> float:
    """Samples by which a device's times have left those of the first one, shifted as a whole, at its end."""
    elapsed_s = (device.end_ns - int(first.block_time_ns[0])) * 1e-9
    ahead = shift + len(device) - elapsed_s * device.sample_rate_Hz
    lasted_s = (first.end_ns - int(first.block_time_ns[0])) * 1e-9
    return ahead - (len(first) - lasted_s * first.sample_rate_Hz)


class RecordedMeter:
    """A :class:`recordings.streams.SlowSource` over the indicators of a run: each value holds until the next one."""

    def __init__(self, run: Run) -> None:
        found: dict[str, list[Indicator]] = {}
        for indicator in run.indicators:
            if indicator.name in found or len(found) < _NAMES_LIMIT:
                found.setdefault(indicator.name, []).append(indicator)
        self._times_ns = {name: [each.time_ns for each in series] for name, series in found.items()}
        self._values = {name: [each.value for each in series] for name, series in found.items()}
        self._channels = tuple(
            Channel(
                name=name,
                quantity=_slow_quantity(name, series[0].unit),
                unit=series[0].unit,
                device="meter",
            )
            for name, series in found.items()
        )

    @property
    def channels(self) -> Sequence[Channel]:
        """What was recorded, none with a range: that was not."""
        return self._channels

    def read(self, time_s: float) -> list[float]:
        """The latest recorded value of every channel; the first one before that."""
        values = []
        for channel in self._channels:
            at = bisect_right(self._times_ns[channel.name], round(time_s * 1e9)) - 1
            values.append(self._values[channel.name][max(0, at)])
        return values


def _slow_quantity(name: str, unit: str) -> str:
    """What an indicator of this name and unit tells of."""
    slow = {one.name: one.unit for one in known_quantities().values() if one.slow}
    return name if name in slow else next((each for each, its in slow.items() if its == unit), "unknown")
