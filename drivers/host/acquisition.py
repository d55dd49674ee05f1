"""Several devices as one acquisition on one time base, with every loss accounted for."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from drivers.host.can_client import CanClient
from drivers.host.daq import DaqClient
from drivers.host.device import Device, DeviceFailedError, Mailbox
from drivers.host.meter import MeterClient
from drivers.host.reassembly import Piece
from drivers.host.watch import ChannelWatch
from drivers.instruments import Instruments, read_instruments
from recordings.errors import InputError
from recordings.run import Channel, Event, Indicator, SampleBlock
from recordings.streams import Excitation

NUDGE_S = 0.25
CLOCK_OFFSET_S, CLOCK_DRIFT_PPM = 1e-3, 1.0
"""From here on a recording says by how much a device's clock was wrong, although its times are corrected."""


def open_instruments(source: Instruments | str | Path) -> RigAcquisition:
    """Connect to every device of an instruments file.

    Raises
    ------
    recordings.errors.InputError
        If the file is wrong or a device does not answer; those already open are closed again.
    """
    instruments = source if isinstance(source, Instruments) else read_instruments(source)
    return RigAcquisition(instruments)


class StreamEndedError(TimeoutError):
    """There are no more samples: a recorded run that was replayed has come to its end."""


class RigAcquisition:
    """An :class:`recordings.streams.Acquisition` on hardware, real or virtual.

    The device with the generator gives the time base and, where it can wait, is kept from running ahead by more than
    two blocks.  Blocks of all devices are handed out together: one block of each, from the same sample on.
    """

    def __init__(self, instruments: Instruments) -> None:
        self._instruments = instruments
        self._mailbox = Mailbox()
        self._devices: list[Device] = []
        self._meters: list[MeterClient] = []
        self._generator: DaqClient
        self._running = False
        self._consumed = 0
        self._block_length = 240
        self._rate_Hz = 0.0
        self._acknowledged = 0
        self._lost: dict[str, tuple[int, int, int]] = {}
        self._disorder: dict[str, tuple[int, int]] = {}
        self._heard: dict[str, tuple[int, float]] = {}
        self._silent: set[str] = set()
        self._warned: set[str] = set()
        options = {"timeout_s": instruments.timeout_s, "reconnect_s": instruments.reconnect_s}
        try:
            for settings in instruments.device:
                if settings.kind == "meter":
                    self._meters.append(MeterClient(settings, self._mailbox, timeout_s=instruments.timeout_s))
                    continue
                if settings.parsed_address.kind == "can":
                    can = CanClient(settings, self._mailbox, silence_s=instruments.silence_s, **options)
                    self._devices.append(can)
                    continue
                daq = DaqClient(settings, self._mailbox, **options)
                self._devices.append(daq)
                if settings.generator:
                    self._generator = daq
            slow = [channel for meter in self._meters for channel in meter.channels]
            names = [channel.name for channel in (*self.channels, *slow)]
            twice = {name for name in names if names.count(name) > 1}
            if twice:
                raise InputError("instruments", min(twice), "is the name of two channels", "rename one of them")
        except BaseException:
            self.close()
            raise
        self._watches = {channel.name: ChannelWatch(channel.name, self._mailbox) for channel in self.channels}
        self._rate_Hz = float(self._generator.query("ACQ:RATE?"))

    @property
    def identity(self) -> str:
        """What the device with the generator says it is: maker, model, serial number, version."""
        return self._generator.identity

    @property
    def channels(self) -> Sequence[Channel]:
        """All channels that stream, in the order of the devices; a meter's are none of them."""
        return [channel for device in self._devices for channel in device.channels]

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        """Choose the rate of every device; gives the one obtained.

        Raises
        ------
        InputError
            If the devices do not agree on one.
        """
        rates = {device.name: device.set_sample_rate(sample_rate_Hz) for device in self._devices}
        if len(set(rates.values())) > 1:
            given = ", ".join(f"{name} {rate:g} Hz" for name, rate in rates.items())
            raise InputError("instruments", "sample rate", f"the devices do not agree: {given}")
        self._rate_Hz = rates[self._generator.name]
        return self._rate_Hz

    def start(self) -> None:
        """Start streaming, the generator's device last: it triggers the others."""
        # About four blocks a second, and whole CAN frames: 30 times a power of two.
        self._block_length = int(30 * 2 ** min(8, max(0, round(math.log2(max(1.0, self._rate_Hz / 4 / 30))))))
        self._consumed = 0
        self._acknowledged = 0
        self._lost.clear()
        self._disorder.clear()
        self._heard.clear()
        self._silent.clear()
        self._warned.clear()
        self._mailbox.now_ns = 0
        self._running = True
        for meter in self._meters:
            meter.start()
        for device in sorted(self._devices, key=lambda device: device is self._generator):
            device.start(block_length=self._block_length)
            # A block has some samples of every device: as many as converter samples, or a power of two fewer.
            self._block_length = max(self._block_length, 30 * device.inbox.decimation)

    def stop(self) -> None:
        """Generator to zero, streaming off; never raises."""
        if not self._running:
            return
        self._running = False
        self._generator.stop()
        for meter in self._meters:
            meter.stop()
        for device in self._devices:
            if device is not self._generator:
                device.stop()
                self._report_clock(device)
            self._report_loss(device.name)

    def close(self) -> None:
        """Stop, and give all lines up."""
        if self._devices:
            self.stop()
        for device in self._devices:
            device.close()
        for meter in self._meters:
            meter.close()
        self._devices.clear()
        self._meters.clear()

    def __enter__(self) -> RigAcquisition:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def set_output(self, excitation: Excitation) -> int:
        """Change the generator's output; gives the device time (ns) from which it holds.

        Raises
        ------
        InputError
            If the instrument refuses the setting.
        TimeoutError
            If it does not answer.
        """
        return self._generator.set_output(excitation)[1]

    def take_events(self) -> Sequence[Event]:
        """What went wrong since the last call."""
        return self._mailbox.take_events()

    @property
    def meter_values(self) -> Mapping[str, tuple[float, str]]:
        """What the meters read when they were connected: value and quantity by channel."""
        return {
            channel.name: (meter.first[channel.name], channel.quantity)
            for meter in self._meters
            for channel in meter.channels
            if channel.name in meter.first
        }

    def take_indicators(self) -> Sequence[Indicator]:
        """What the meters have read since the last call, in the generator's clock."""
        return [indicator for meter in self._meters for indicator in meter.take()]

    def read(self, *, timeout_s: float = 2.0) -> Sequence[SampleBlock]:
        """One block of every device, from the same sample on; fewer where samples were lost.

        Raises
        ------
        StreamEndedError
            If the instrument has ended the stream and everything was handed out.
        DeviceFailedError
            If it did so because it can give no samples any more.
        TimeoutError
            If nothing came.
        """
        began = time.monotonic()
        progress = began
        patience_s = min(self._instruments.silence_s, 0.9 * timeout_s)
        while True:
            if self._consumed != self._acknowledged:
                # What was handed out before has been dealt with by now.
                self._acknowledged = self._consumed
                self._generator.acknowledge(self._consumed)
            target = self._consumed + self._block_length
            with self._mailbox.changed:
                self._mailbox.wanted = target
                complete = self._mailbox.changed.wait_for(lambda: self._is_complete(target), NUDGE_S)  # noqa: B023
                late = time.monotonic() - progress > patience_s
                quiet_s = {device.name: self._quiet_s(device) for device in self._devices}
                if complete or (late and self._give_up_silent(target, patience_s, quiet_s)):
                    blocks = self._take(target)
                    self._consumed = target
                    if blocks:
                        for meter in self._meters:
                            meter.pass_time(blocks[0].time_ns)
                        return blocks
                    progress = time.monotonic()
                    continue
            waited_s = min(time.monotonic() - began, *quiet_s.values())
            if waited_s >= timeout_s and not any(device.recovering for device in self._devices):
                raise TimeoutError(self._why_nothing(time.monotonic() - began))
            if self._generator.inbox.ended:
                return self._take_rest()
            limit = self._generator.waits_at()
            if limit:
                # Either the acknowledgement was lost or all samples of the window were: go on behind them.
                self._generator.acknowledge(limit - self._block_length)

    def _take_rest(self) -> list[SampleBlock]:
        """What is left of a stream that the instrument has ended."""
        with self._mailbox.changed:
            self._consumed = max(device.inbox.high for device in self._devices)
            blocks = self._take(self._consumed)
        if not blocks:
            reason = self._generator.why_ended()
            if reason:
                raise DeviceFailedError(f"{self._generator.name} has stopped: {reason}")
            raise StreamEndedError("the instrument has ended the stream")
        return blocks

    def _is_complete(self, target: int) -> bool:
        for device in self._devices:
            if device.inbox.ready >= target:
                self._silent.discard(device.name)
            elif device.name not in self._silent:
                return False
        return len(self._silent) < len(self._devices)

    def _quiet_s(self, device: Device) -> float:
        """How long ago the newest sample of a device was seen to come."""
        now = time.monotonic()
        high, since = self._heard.get(device.name, (-1, now))
        if device.inbox.high != high:
            self._heard[device.name] = device.inbox.high, now
            return 0.0
        return now - since

    def _give_up_silent(self, target: int, patience_s: float, quiet_s: Mapping[str, float]) -> bool:
        """Go on without devices that have sent nothing for a while; whether there is something to go on with."""
        waited_for = [
            device.name for device in self._devices if device.inbox.ready < target and device.name not in self._silent
        ]
        if any(quiet_s[name] < patience_s for name in waited_for):
            return False  # slow, but on its way
        for name in waited_for:
            self._silent.add(name)
            self._mailbox.report(name, "silent", f"no samples for {patience_s:g} s")
        return len(self._silent) < len(self._devices)

    def _why_nothing(self, waited_s: float) -> str:
        reasons = [f"{device.name} at {device.address}: {device.failure}" for device in self._devices if device.failure]
        return f"no samples for {waited_s:.1f} s" + (f" ({'; '.join(reasons)})" if reasons else "")

    def _take(self, target: int) -> list[SampleBlock]:
        """Blocks of all devices up to a sample."""
        blocks: list[SampleBlock] = []
        for device in self._devices:
            inbox = device.inbox
            rate_Hz = inbox.sample_rate_Hz or self._rate_Hz
            for piece, overload in inbox.take(target):
                time_ns = self._align(device, inbox.times.time_ns(piece.first_index * inbox.decimation, rate_Hz))
                if piece.values is None:
                    self._lose(device.name, piece, time_ns)
                    continue
                self._report_loss(device.name)
                own_rate_Hz = rate_Hz / inbox.decimation
                blocks.append(self._block(device, piece.first_index, piece.values, time_ns, own_rate_Hz, overload))
            inbox.times.forget_before(target)
            self._report_disorder(device)
        return blocks

    def _align(self, device: Device, time_ns: int) -> int:
        """A device's time in the generator's clock."""
        if device is self._generator:
            return time_ns
        if not device.inbox.clock.synchronised:
            if device.name not in self._warned:
                self._warned.add(device.name)
                self._mailbox.report(device.name, "unsynchronised", "no pulse was seen by both it and the generator")
            return time_ns
        return device.inbox.clock.to_reference(time_ns)

    def _lose(self, device: str, piece: Piece, time_ns: int) -> None:
        """Note lost samples; stretches that follow each other become one event."""
        first, count, since_ns = self._lost.get(device, (piece.first_index, 0, time_ns))
        if first + count != piece.first_index:
            self._report_loss(device)
            first, count, since_ns = piece.first_index, 0, time_ns
        self._lost[device] = first, count + piece.count, since_ns

    def _report_loss(self, device: str) -> None:
        if device in self._lost:
            first, count, since_ns = self._lost.pop(device)
            detail = f"{count} samples, {first} to {first + count - 1}"
            self._mailbox.report(device, "lost-samples", detail, time_ns=since_ns)

    def _report_disorder(self, device: Device) -> None:
        """Note samples that came twice or late since the last time; none of them was used twice, or out of place."""
        samples = device.inbox.samples
        repeated, late = self._disorder.get(device.name, (0, 0))
        self._disorder[device.name] = samples.repeated, samples.late
        if samples.repeated > repeated:
            detail = f"{samples.repeated - repeated} samples came again, or after they had been given up"
            self._mailbox.report(device.name, "duplicate", detail)
        if samples.late > late:
            detail = f"{samples.late - late} samples came after later ones, and were put in their place"
            self._mailbox.report(device.name, "reordered", detail)

    def _report_clock(self, device: Device) -> None:
        """Note a clock that was far from the generator's."""
        clock = device.inbox.clock
        if not clock.synchronised:
            return
        offset_s, drift_ppm = -clock.offset_ns * 1e-9, -clock.drift_ppm
        if abs(offset_s) > CLOCK_OFFSET_S or abs(drift_ppm) > CLOCK_DRIFT_PPM:
            detail = f"was {offset_s:.6f} s ahead and {drift_ppm:.2f} ppm fast; its times are corrected"
            self._mailbox.report(device.name, "clock", detail)

    def _block(
        self,
        device: Device,
        first_index: int,
        values: NDArray[np.float32],
        time_ns: int,
        rate_Hz: float,
        overload: NDArray[np.int64],
    ) -> SampleBlock:
        counts = {}
        for channel, row, count in zip(device.channels, values, overload, strict=True):
            self._watches[channel.name].look(row, int(count), time_ns, rate_Hz)
            if count:
                counts[channel.name] = int(count)
        return SampleBlock(
            device=device.name,
            time_ns=time_ns,
            first_index=first_index,
            sample_rate_Hz=rate_Hz,
            samples={channel.name: row for channel, row in zip(device.channels, values, strict=True)},
            overload=counts,
        )
