"""The acquisition node on CAN FD or classic CAN: int16 samples, time sync, heartbeat, status, commands."""

import contextlib
import math
import struct
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import can
import numpy as np
from numpy.typing import NDArray

from drivers.can_dialect import Dialect, Message
from drivers.can_protocol import (
    CHANNELS_LIMIT,
    FULL_SCALE,
    LOAD_UNKNOWN,
    NO_PULSE,
    CanCommand,
    ChannelInfo,
    Heartbeat,
    NodeState,
    Opcode,
    Reply,
    Status,
    TimeSync,
)
from drivers.virtual.bus_time import BusTime
from drivers.virtual.decimation import Decimator
from drivers.virtual.error_state import ErrorCounter, ErrorState
from drivers.virtual.faults import ClockFault, LinkFaults
from drivers.virtual.feed import SampleFeed, SourceFailedError
from recordings.errors import InputError
from recordings.run import SampleBlock

QUEUE_FRAMES = 4096
"""Memory of the node for frames the bus has not taken; beyond it samples are lost and counted."""
URGENT_FRAMES = 64
HEARTBEAT_S = 1.0
_COMMANDS_A_TURN = 64
_BUSY = (NodeState.ARMED, NodeState.STREAMING)
_LOST = -FULL_SCALE - 1
"""Stands for a sample that the source does not have; it is not sent."""
FULL_LOAD = 0.7
"""The part of a classic bus that samples may take; what is more is decimated away."""


@dataclass(frozen=True, kw_only=True)
class CanLine:
    """The bus as a node meets it."""

    bus: can.BusABC
    """Any python-can bus that carries the frames."""
    bus_time: BusTime
    """How fast it is."""
    dialect: Dialect
    """The frames the node speaks in.  On a classic bus it decimates as far as is needed."""


class CanNode:
    """Some channels on a CAN bus.

    Parameters
    ----------
    feed
        Where samples come from.
    line
        The bus it is on.
    channels
        Names of the feed's channels this node carries, at most four; each needs a range.
    lossless
        Let the feed wait for the bus; otherwise a full queue is an overrun.
    """

    def __init__(
        self,
        feed: SampleFeed,
        line: CanLine,
        *,
        name: str,
        channels: Sequence[str],
        lossless: bool,
        faults: LinkFaults,
        clock: ClockFault,
    ) -> None:
        self.name = name
        known = {channel.name: channel for channel in feed.channels}
        self._channels = tuple(known[channel] for channel in channels)
        if not 0 < len(self._channels) <= CHANNELS_LIMIT:
            raise InputError(
                "CAN node", "channels", f"{len(self._channels)} channels, it carries 1 to {CHANNELS_LIMIT}"
            )
        for channel in self._channels:
            if not channel.range:
                raise InputError("CAN node", channel.name, "has no range, which scales its 16-bit samples")
        self._scale = np.array([[FULL_SCALE / float(channel.range or 1.0)] for channel in self._channels])
        self._feed = feed
        self._bus, self._bus_time, self._dialect = line.bus, line.bus_time, line.dialect
        self._lossless = lossless
        self._faults = faults
        self._clock = clock
        self._errors = ErrorCounter()
        self._state = NodeState.IDLE
        self._queue: deque[can.Message] = deque()
        self._urgent: deque[can.Message] = deque()
        self._born = time.monotonic()
        self._next_heartbeat = self._born
        self._begin()

    def _begin(self) -> None:
        self._origin = self._feed.index
        self._decimator = Decimator(len(self._channels), self._decimation)
        self._rest = np.empty((len(self._channels), 0), np.int16)
        self._sent = 0
        self._status = Status(0, (0,) * len(self._channels))
        self._reported = self._status
        self._announced = False

    @property
    def _decimation(self) -> int:
        """Of how many samples the bus gets one: a power of two, as the host's blocks are."""
        if self._dialect.is_fd:
            return 1
        a_frame = self._dialect.samples_per_frame
        frames_per_s = len(self._channels) * self._feed.sample_rate_Hz / a_frame
        load = frames_per_s * self._bus_time.frame_s(2 + 2 * a_frame) / FULL_LOAD
        return 1 << max(0, math.ceil(math.log2(load)))

    @property
    def listening(self) -> bool:
        """Whether it streams; a bus does not tell who reads it."""
        return self._state == NodeState.STREAMING

    @property
    def has_room(self) -> bool:
        """Whether the bus has taken what came before."""
        return not self._queue and not self._urgent

    def descriptors(self) -> list[tuple[int, bool, bool]]:
        """What to wait for; -1 where the bus must be asked again and again."""
        try:
            return [(self._bus.fileno(), True, False)]
        except NotImplementedError:
            return [(-1, True, not self.has_room)]

    def service(self) -> bool:
        """Obey commands, keep the heartbeat, send what the bus takes; whether anything moved."""
        moved = False
        for _ in range(_COMMANDS_A_TURN):
            message = self._receive()
            if message is None:
                break
            moved = True
            if self._errors.state == ErrorState.BUS_OFF or self._faults.away:
                continue  # off the bus it hears nothing either
            if message.is_error_frame or message.is_extended_id or message.is_remote_frame:
                continue
            with contextlib.suppress(struct.error, ValueError):  # too short: noise, as if it had not come
                command = self._dialect.decode(message.arbitration_id, bytes(message.data))
                if isinstance(command, CanCommand):
                    self._obey(command)
        now = time.monotonic()
        if now >= self._next_heartbeat and self._errors.state != ErrorState.BUS_OFF:
            self._beat(now)
        return self._flush() or moved

    def _beat(self, now: float) -> None:
        self._next_heartbeat = now + HEARTBEAT_S
        if self._state == NodeState.FAILED and not self._feed.failure:
            self._state = NodeState.IDLE  # it was made to work again by the start of another instrument
        load = self._bus_time.take_load()
        beat = Heartbeat(
            self._state, len(self._channels), int(1000 * (now - self._born)), self._errors.take_worst(),
            LOAD_UNKNOWN if load is None else round(100 * load),
        )  # fmt: skip
        self._tell(beat)

    def _receive(self) -> can.Message | None:
        try:
            message = self._bus.recv(0)
        except (can.CanOperationError, ValueError):
            return None  # a frame that cannot be read, or a bus whose hub has gone
        if message is not None and not message.is_error_frame:
            due = self._urgent or self._queue
            # The smaller identifier wins the arbitration.
            waits = not due or message.arbitration_id < due[0].arbitration_id
            self._bus_time.hear(len(message.data), is_fd=message.is_fd, waits=waits)
        return message

    def _obey(self, command: CanCommand) -> None:
        try:
            refused = self._try(command)
        except SourceFailedError:
            self._state = NodeState.FAILED
            refused = True
        if command.opcode != Opcode.DESCRIBE or refused:
            self._tell(Reply(command.opcode, int(refused), self._feed.sample_rate_Hz, self._decimation))

    def _try(self, command: CanCommand) -> bool:
        """Do what a command asks for; whether it is refused."""
        if command.opcode == Opcode.START and self._state != NodeState.STREAMING:
            self._feed.recover()
            self._feed.disarm(self._start)
            self._start()
            self._beat(time.monotonic())  # from now on a shorter uptime is a restart
        elif command.opcode == Opcode.ARM and self._state != NodeState.STREAMING:
            self._feed.recover()
            self._feed.arm(self._start)
            self._state = NodeState.ARMED
            self._beat(time.monotonic())
        elif command.opcode == Opcode.STOP:
            self._stop()
        elif command.opcode == Opcode.HALT:
            self._feed.halt("emergency stop by CAN", latched=True)
        elif command.opcode == Opcode.SET_RATE and self._state not in _BUSY and 1.0 <= command.value <= 1e6:
            self._feed.set_sample_rate(command.value)
        elif command.opcode == Opcode.DESCRIBE and 0 <= command.value < len(self._channels):
            index = int(command.value)
            self._tell(ChannelInfo(index, len(self._channels), self._channels[index]))
        else:
            return True
        return False

    def _start(self) -> None:
        self._begin()
        self._state = NodeState.STREAMING

    def _stop(self) -> None:
        self._feed.disarm(self._start)
        if self._state == NodeState.STREAMING:
            values = np.concatenate((self._rest, self._quantise(self._decimator.flush())), axis=1)
            position = 0
            for size in self._dialect.frame_sizes(values.shape[1]):
                self._put_samples(values[:, position : position + size])
                position += size
            for message in self._faults.flush():
                self._queue.append(message)
        self._state = NodeState.IDLE

    def accept(self, block: SampleBlock) -> None:
        """Take a block of the feed, and queue its frames."""
        if self._state != NodeState.STREAMING:
            return
        if not self._announced:
            # Samples need a time before the first pulse comes.
            self._announced = True
            self._put_sync(block, block.first_index, NO_PULSE)
        for number, index in self._feed.pulses(block):
            self._put_sync(block, index, number)
        taken = self._decimator.take(np.stack([block.samples[channel.name] for channel in self._channels]))
        values = np.concatenate((self._rest, self._quantise(taken, block.overload)), axis=1)
        a_frame = self._dialect.samples_per_frame
        whole = values.shape[1] // a_frame * a_frame
        for start in range(0, whole, a_frame):
            self._put_samples(values[:, start : start + a_frame])
        self._rest = values[:, whole:]
        if self._status != self._reported:
            self._reported = self._status
            self._tell(self._status)
        if self._faults.advance(1e-9 * block.time_ns + len(block) / block.sample_rate_Hz) == "restart":
            # The node loses its power: it comes back idle, and says nothing of what it had.
            self._queue.clear()
            self._urgent.clear()
            self._state = NodeState.IDLE
            self._born = self._next_heartbeat = time.monotonic()  # a node that boots says so

    def _quantise(
        self, values: NDArray[np.floating], overload_counts: Mapping[str, int] = MappingProxyType({})
    ) -> NDArray[np.int16]:
        steps = np.rint(values * self._scale)
        lost = np.isnan(steps)
        within = lost | (np.abs(steps) < FULL_SCALE)
        if within.all() and not lost.any() and not any(overload_counts.values()):
            return steps.astype(np.int16)
        overload = tuple(
            total + max(len(row) - int(np.count_nonzero(row)), overload_counts.get(channel.name, 0))
            for total, row, channel in zip(self._status.overload, within, self._channels, strict=True)
        )
        if overload != self._status.overload:
            self._status = Status(self._status.overrun, overload)
        return np.where(lost, _LOST, np.clip(steps, -FULL_SCALE, FULL_SCALE)).astype(np.int16)

    def _put_samples(self, values: NDArray[np.int16]) -> None:
        """One frame a channel, of the next samples; more where some in between are lost."""
        first, self._sent = self._sent, self._sent + values.shape[1]
        if not self._lossless and len(self._queue) >= QUEUE_FRAMES:
            self._status = Status(self._status.overrun + values.shape[1], self._status.overload)
            return
        for k, samples in enumerate(values):
            for start, stop in self._stretches(samples):
                frame = self._message(*self._dialect.encode_samples(k, first + start, samples[start:stop]))
                self._queue.extend(self._faults.pass_on(frame))

    def _stretches(self, samples: NDArray[np.int16]) -> list[tuple[int, int]]:
        """Where the samples of a frame go: all in one unless some are lost, else in pieces as long as frames can be."""
        have = samples != _LOST
        if have.all():
            return [(0, len(samples))]
        edges = np.flatnonzero(np.diff(have, prepend=False, append=False)).tolist()
        found = []
        for start, stop in zip(edges[::2], edges[1::2], strict=True):
            for size in self._dialect.frame_sizes(stop - start):
                found.append((start, start + size))
                start += size
        return found

    def _message(self, identifier: int, data: bytes) -> can.Message:
        fd = self._dialect.is_fd
        return can.Message(arbitration_id=identifier, data=data, is_extended_id=False, is_fd=fd, bitrate_switch=fd)

    def _put_sync(self, block: SampleBlock, index: int, pulse: int) -> None:
        shown = self._clock.show(block.time_at(index - block.first_index))
        sync = TimeSync(index - self._origin, shown, pulse, block.sample_rate_Hz)
        self._queue.extend(self._message(*frame) for frame in self._dialect.encode(sync))

    def _tell(self, message: Message) -> None:
        """Send ahead of the samples that wait; dropped if the bus takes nothing at all."""
        if len(self._urgent) < URGENT_FRAMES:
            self._urgent.extend(self._message(*frame) for frame in self._dialect.encode(message))

    def _flush(self) -> bool:
        moved = False
        while self._may_send():
            queue = self._urgent or self._queue
            if not self._bus_time.is_free:
                break
            if self._faults.noisy:
                self._bus_time.take(len(queue[0].data))
                self._errors.fail()  # the frame stays, to be sent again
                with contextlib.suppress(can.CanError):
                    self._bus.send(can.Message(is_error_frame=True, is_extended_id=False, dlc=0), timeout=0)
                moved = True
                continue
            try:
                self._bus.send(queue[0], timeout=0)
            except can.CanError:
                break  # the bus is full, off, or its hub has gone: frames wait, then overrun
            self._errors.succeed()
            self._bus_time.take(len(queue.popleft().data))
            moved = True
        if not self._may_send():
            self._bus_time.idle()
        return moved

    def _may_send(self) -> bool:
        return not self.has_room and not self._faults.stalled and self._errors.state != ErrorState.BUS_OFF

    def end(self) -> None:
        """The source has ended."""
        self._stop()

    def fail(self, reason: str) -> None:
        """The source has failed: say so at once; a frame has no room for why."""
        self._stop()
        self._state = NodeState.FAILED
        self._beat(time.monotonic())

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()
