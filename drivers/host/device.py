"""What the acquisition needs of every device, and what the devices tell it through one mailbox."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.host.clock import ClockFit, TimeLine
from drivers.host.reassembly import Piece, Reassembler
from drivers.instruments import ChannelSettings
from recordings.errors import InputError
from recordings.run import Channel, Event


class DeviceFailedError(TimeoutError):
    """A device says that it cannot give samples any more, and why: there will be none."""


class Mailbox:
    """Shared by the readers of all devices: a condition that is notified when something came, and events."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self._events: list[Event] = []
        self._clocks: dict[str, ClockFit] = {}
        self.now_ns = 0
        self.wanted = 0
        """The sample up to which the acquisition waits."""

    def announce(self, inbox: DeviceInbox) -> None:
        """Wake the acquisition if a device has what it waits for: not for every frame, which would cost more."""
        if inbox.ended or inbox.ready >= self.wanted:
            self.changed.notify_all()

    def register_clock(self, device: str, clock: ClockFit) -> None:
        """A device's clock is to be compared with the reference."""
        self._clocks[device] = clock

    def reference_pulse(self, pulse: int, time_ns: int) -> None:
        """The reference saw a pulse."""
        for clock in self._clocks.values():
            clock.add_reference(pulse, time_ns)

    def report(self, source: str, kind: str, detail: str = "", *, time_ns: int | None = None) -> None:
        """Note an event; at the latest device time if none is given."""
        with self.changed:
            at = self.now_ns if time_ns is None else time_ns
            self._events.append(Event(time_ns=at, source=source, kind=kind, detail=detail))

    def take_events(self) -> list[Event]:
        """Events since the last call."""
        with self.changed:
            events, self._events = self._events, []
        return events


class Wiring(NamedTuple):
    """Which of a device's channels are wanted, and factors from its unit to theirs (None: samples as they are)."""

    rows: list[int]
    factors: NDArray[np.float32] | None


class DeviceInbox:
    """What a device has sent of the running stream; guarded by the mailbox's condition.

    Samples on the converter's limit are those that the device counts, see :meth:`note_overload`, or those that reach
    `limits`, by channel, where it does not count.
    """

    def __init__(
        self, channels: int, wiring: Wiring, *, tolerance: int, limits: NDArray[np.float32] | None = None
    ) -> None:
        self._wiring = wiring
        self.samples = Reassembler(channels, tolerance=tolerance)
        self.times = TimeLine()
        self.clock = ClockFit()
        self.sample_rate_Hz = 0.0
        self._channels = channels
        self._limits = limits
        self._overload: list[tuple[int, NDArray[np.int64]]] = []
        self.ended = False
        self.decimation = 1
        """Samples of the converter to one that comes; those of the converter are counted alike on all devices."""

    @property
    def ready(self) -> int:
        """Everything before this sample of the converter has come or is given up."""
        return self.samples.ready * self.decimation

    @property
    def high(self) -> int:
        """One past the newest sample of the converter."""
        return self.samples.high * self.decimation

    def note_overload(self, first_index: int, counts: NDArray[Any]) -> None:
        """So many of the samples that came from `first_index` on sit on the converter's limit, by channel."""
        if counts.any():
            self._overload.append((first_index, counts.astype(np.int64)))

    def take(self, stop: int) -> list[tuple[Piece, NDArray[np.int64]]]:
        """The wanted channels before sample `stop` of the converter, and how many of each are on its limit."""
        rows, factors = self._wiring
        taken = []
        for piece in self.samples.take(-(-stop // self.decimation)):
            overload = np.zeros(self._channels, np.int64)
            if piece.values is not None:
                overload = self._overload_of(piece, piece.values)
                values = piece.values[rows]
                piece = Piece(piece.first_index, piece.count, values if factors is None else values * factors)
            taken.append((piece, overload[rows]))
        return taken

    def _overload_of(self, piece: Piece, values: NDArray[np.float32]) -> NDArray[np.int64]:
        """What was told of samples up to the end of a piece; what cannot be in it is kept for the next one."""
        if self._limits is not None:
            return np.count_nonzero(np.abs(values) >= self._limits[:, None], axis=1)
        end = piece.first_index + piece.count
        total = np.zeros(self._channels, np.int64)
        later = []
        for first_index, counts in self._overload:
            if first_index < end:
                total += counts
            else:
                later.append((first_index, counts))
        mine = np.minimum(total, piece.count)
        self._overload = later
        self.note_overload(end, total - mine)
        return mine


class Device(Protocol):
    """A connected device."""

    name: str
    address: str
    channels: Sequence[Channel]
    inbox: DeviceInbox
    failure: str
    """Why it is not there at the moment; empty if it is."""

    @property
    def recovering(self) -> bool:
        """Whether it was lost and is being looked for."""
        ...

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        """Choose the rate; gives the one obtained."""
        ...

    def start(self, *, block_length: int) -> None:
        """Stream from sample 0, or arm."""
        ...

    def stop(self) -> None:
        """End the stream; never raises."""
        ...

    def close(self) -> None:
        """Give the line up."""
        ...


def configure_channels(
    found: Sequence[Channel], wanted: Sequence[ChannelSettings], *, device: str, source: str
) -> tuple[list[Channel], Wiring]:
    """Join what a device says of its channels with what the instruments file says.

    Returns
    -------
    tuple
        Channels in the wanted order, and how they come about.

    Raises
    ------
    InputError
        If the file names a channel that the device does not have.
    """
    names = [channel.name for channel in found]
    if not wanted:
        wanted = [ChannelSettings(source=name) for name in names]
    channels, numbers, factors = [], [], []
    for settings in wanted:
        if settings.source not in names:
            raise InputError(
                source, f"device {device}", f"has no channel {settings.source!r}", "it has " + ", ".join(names)
            )
        numbers.append(names.index(settings.source))
        original = found[numbers[-1]]
        factor = 1.0 if settings.sensitivity is None else 1.0 / settings.sensitivity
        factors.append(factor)
        limit = settings.range or (original.range * abs(factor) if original.range else None)
        channels.append(
            Channel(
                name=settings.name or original.name,
                quantity=settings.quantity or original.quantity,
                unit=settings.unit or original.unit,
                position_m=original.position_m if settings.position_m is None else settings.position_m,
                direction=settings.direction or original.direction,
                range=limit,
                device=device,
            )
        )
    scaled = any(factor != 1.0 for factor in factors)
    return channels, Wiring(numbers, np.array(factors, np.float32)[:, None] if scaled else None)
