"""Host side of the acquisition node on CAN FD or classic CAN, over any interface of python-can."""

import contextlib
import struct
import threading
import time
from collections.abc import Sequence

import can
import numpy as np
from numpy.typing import NDArray

from drivers.bus import open_bus
from drivers.can_dialect import make_dialect, unwrap
from drivers.can_protocol import (
    CHANNELS_LIMIT,
    FULL_SCALE,
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
from drivers.host.device import DeviceInbox, Mailbox, Wiring, configure_channels
from drivers.instruments import DeviceSettings
from recordings.errors import InputError
from recordings.run import Channel

ATTEMPTS = 4
BATCH_FRAMES = 512
LATE_SAMPLES = 60
"""How late a frame may come; the samples of two FD frames."""
LOST_TRACK_S = 1.0
"""A count of 16 bits tells where it belongs if the pause before it was no longer."""
FULL_BUS_PERCENT = 95
ERRORS_TOLD_S = 1.0
_ERROR_STATES = {
    1: ("error-passive", "many of the node's frames were destroyed on the bus"),
    2: ("bus-off", "so many of the node's frames were destroyed that it left the bus for a while"),
}


class CanClient:
    """Commands the node and takes its frames in a thread of its own.

    Parameters are those of :class:`drivers.host.daq.DaqClient`, and `silence_s`, after which a node that sends neither
    samples nor heartbeats counts as lost: three heartbeats.

    Raises
    ------
    InputError
        If the bus cannot be opened or no node answers.
    """

    def __init__(
        self,
        settings: DeviceSettings,
        mailbox: Mailbox,
        *,
        timeout_s: float = 2.0,
        reconnect_s: float = 10.0,
        silence_s: float = 3.0,
    ) -> None:
        self.name = settings.name
        self.address = str(settings.parsed_address)
        self._frames, self._node = settings.frames, settings.node
        self._dialect = make_dialect(settings.frames, settings.node)
        self._start_opcode = Opcode.ARM if settings.start == "trigger" else Opcode.START
        self._mailbox = mailbox
        self._timeout_s = timeout_s
        self._silence_s = silence_s
        self.failure = ""
        self._answer: tuple[int, object] | None = None
        self._answered = threading.Condition()
        self._streaming = False
        self._started_s = 0.0
        self._restarted = False
        self._failed = False
        self._error_frames = 0
        self._errors_told_s = 0.0
        self._error_state = 0
        self._full = False
        self._highest = 0
        self._overrun = 0
        self._heard_s = time.monotonic()
        self._stopping = threading.Event()
        self.channels: Sequence[Channel] = ()
        self.recovering = False
        self.inbox = DeviceInbox(CHANNELS_LIMIT, Wiring([], None), tolerance=0)
        self._lost_track = False
        self._on_track_s = 0.0
        self._uptime_ms = 0
        self._bus = open_bus(
            settings.parsed_address,
            bitrate=settings.bitrate,
            data_bitrate=settings.data_bitrate,
            is_fd=self._dialect.is_fd,
        )
        self._thread = threading.Thread(target=self._receive, name=f"reader of {self.name}", daemon=True)
        self._thread.start()
        try:
            self._command(Opcode.STOP)
            found = self._read_catalogue()
            self.channels, self._wiring = configure_channels(
                found, settings.channel, device=self.name, source=self.address
            )
        except (TimeoutError, InputError) as error:
            self.close()
            if isinstance(error, InputError):
                raise
            raise InputError(
                self.address, "", str(error), "is the node on, the bus terminated, the bit rate right?"
            ) from error
        self._node_channels = len(found)
        self._scale = [np.float32(channel.range / FULL_SCALE) for channel in found if channel.range]

    # --- commands -----------------------------------------------------------------------------------------------

    def _command(self, opcode: Opcode, value: float = 0.0) -> object:
        """Send a command until it is answered; commands may be repeated without harm."""
        fd = self._dialect.is_fd
        identifier, data = self._dialect.encode(CanCommand(opcode, value))[0]
        message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False, is_fd=fd, bitrate_switch=fd)
        with self._answered:
            for _ in range(ATTEMPTS):
                self._answer = None
                with contextlib.suppress(can.CanError):
                    self._bus.send(message, timeout=self._timeout_s / ATTEMPTS)
                done = self._answered.wait_for(
                    lambda: self._answer is not None and self._answer[0] == opcode, self._timeout_s / ATTEMPTS
                )
                if done and self._answer is not None:
                    return self._answer[1]
        reason = f" ({self.failure})" if self.failure else ""
        raise TimeoutError(f"no answer from the node within {self._timeout_s:g} s{reason}")

    def _read_catalogue(self) -> list[Channel]:
        found: list[Channel] = []
        count = 1
        while len(found) < count:
            answer = self._command(Opcode.DESCRIBE, len(found))
            if not isinstance(answer, ChannelInfo) or answer.index != len(found):
                raise InputError(self.address, f"channel {len(found)}", "the node does not describe it")
            count = answer.channels
            found.append(answer.channel)
        return found

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        """Choose the rate; gives the one obtained."""
        answer = self._command(Opcode.SET_RATE, sample_rate_Hz)
        if not isinstance(answer, Reply) or answer.result:
            raise InputError(self.address, "sample rate", f"the node refuses {sample_rate_Hz:g} Hz")
        return answer.sample_rate_Hz

    def start(self, *, block_length: int) -> None:
        """Stream from sample 0, at once or at the trigger."""
        with self._mailbox.changed:
            self._dialect = make_dialect(self._frames, self._node)
            limits = np.array(self._scale) * np.float32(FULL_SCALE)
            self.inbox = DeviceInbox(self._node_channels, self._wiring, tolerance=LATE_SAMPLES, limits=limits)
            self._mailbox.register_clock(self.name, self.inbox.clock)
            self._highest = 0
            self._overrun = 0
            self._error_state, self._full = 0, False
            self._lost_track = False
            self._streaming = True
        self._heard_s = self._started_s = self._on_track_s = time.monotonic()
        self._restarted = False
        self._failed = False
        answer = self._command(self._start_opcode)
        if not isinstance(answer, Reply) or answer.result:
            raise InputError(self.address, "", "the node refuses to start")

    def stop(self) -> None:
        """End the stream; never raises."""
        if self._streaming:
            self._restarted = True  # from here on an idle node is what was asked for
            with contextlib.suppress(TimeoutError):
                self._command(Opcode.STOP)
            self._tell_errors(now=True)
        self._streaming = False

    def close(self) -> None:
        """Leave the bus."""
        self._stopping.set()
        self._thread.join(self._timeout_s)
        self._bus.shutdown()

    # --- frames -------------------------------------------------------------------------------------------------

    def _receive(self) -> None:
        """Body of the thread: frames from the bus to the inbox."""
        while not self._stopping.is_set():
            pending: list[list[bytes]] = [[] for _ in range(CHANNELS_LIMIT)]
            control: list[tuple[int, bytes]] = []
            lost = ""
            wait_s = 0.05
            try:
                for _ in range(BATCH_FRAMES):
                    message = self._bus.recv(wait_s)
                    wait_s = 0.0
                    if message is None:
                        break
                    channel = self._dialect.channel_of(message.arbitration_id)
                    if message.is_error_frame or message.is_extended_id or message.is_remote_frame:
                        self._error_frames += 1
                    elif channel is not None:
                        pending[channel].append(bytes(message.data))
                    else:
                        control.append((message.arbitration_id, bytes(message.data)))
            except (can.CanError, OSError, ValueError) as error:
                lost = str(error) or repr(error)
            heard = bool(control) or any(pending)
            self._watch(heard)
            self._tell_errors()
            if heard:
                self._digest(control, pending)
            if lost and not self._lose(lost):
                return

    def _tell_errors(self, *, now: bool = False) -> None:
        """Error frames come in bursts: one event a second has their number."""
        if self._error_frames and (now or time.monotonic() - self._errors_told_s > ERRORS_TOLD_S):
            self._errors_told_s = time.monotonic()
            count, self._error_frames = self._error_frames, 0
            self._mailbox.report(self.name, "bus-error", f"{count} error frame(s) on the bus")

    def _lose(self, reason: str) -> bool:
        """The bus has failed; whether to go on listening."""
        if not self.failure:
            self.failure = f"disconnected: {reason}"
            self._mailbox.report(self.name, "disconnected", reason)
        return not self._stopping.wait(0.1)

    def _watch(self, heard: bool) -> None:
        """Notice a node that has fallen silent, or speaks again."""
        now = time.monotonic()
        if heard:
            if self.failure:
                self.failure = ""
                self._mailbox.report(self.name, "reconnected")
            self._heard_s = now
        elif self._streaming and not self.failure and now - self._heard_s > self._silence_s:
            self.failure = f"silent for {self._silence_s:g} s"
            self._mailbox.report(self.name, "disconnected", f"neither samples nor heartbeats for {self._silence_s:g} s")

    def _digest(self, control: list[tuple[int, bytes]], pending: list[list[bytes]]) -> None:
        with self._mailbox.changed:
            for identifier, data in control:
                try:
                    self._take_control(identifier, data)
                except (struct.error, ValueError) as error:
                    self._mailbox.report(self.name, "protocol", f"frame {identifier:#x}: {error}")
            if self._streaming:
                self._take_samples(pending[: self._node_channels])
                self._mailbox.announce(self.inbox)

    def _take_control(self, identifier: int, data: bytes) -> None:
        message = self._dialect.decode(identifier, data)
        if isinstance(message, TimeSync):
            if self._streaming:
                self._take_sync(message)
        elif isinstance(message, (Reply, ChannelInfo)):
            opcode = message.opcode if isinstance(message, Reply) else Opcode.DESCRIBE
            if isinstance(message, Reply) and opcode in (Opcode.START, Opcode.ARM):
                self.inbox.decimation = message.decimation
            with self._answered:
                self._answer = opcode, message
                self._answered.notify_all()
        elif isinstance(message, Heartbeat):
            self._hear_beat(message)
        elif isinstance(message, Status):
            if message.overrun > self._overrun:
                self._mailbox.report(self.name, "overrun", f"{message.overrun} samples lost in the node so far")
            self._overrun = message.overrun

    def _take_sync(self, sync: TimeSync) -> None:
        """A sample's time, and with it where the node's count has got to."""
        inbox = self.inbox
        index = unwrap(sync.counter, 1 << 32, self._highest * inbox.decimation)
        if index < 0:
            raise ValueError(f"sample number {sync.counter} before the start")
        inbox.sample_rate_Hz = sync.sample_rate_Hz
        inbox.times.add(index, sync.time_ns)
        if sync.pulse != NO_PULSE:
            inbox.clock.add_local(sync.pulse, sync.time_ns)
        self._highest = max(self._highest, index // inbox.decimation)
        self._on_track_s = time.monotonic()
        self._lost_track = False

    def _hear_beat(self, beat: Heartbeat) -> None:
        """Note what a node says of itself and of its bus, when it gets worse."""
        running_s = time.monotonic() - self._started_s
        # A beat may come late, but not before an earlier one.
        younger = beat.uptime_ms < self._uptime_ms or beat.uptime_ms * 1e-3 < running_s - self._silence_s
        self._uptime_ms = beat.uptime_ms
        if not self._streaming:
            return
        if not self._failed and beat.state == NodeState.FAILED:
            self._failed = True
            self._mailbox.report(self.name, "device-error", "the node has nothing to measure any more")
        if not self._restarted and beat.state == NodeState.IDLE and younger:
            self._restarted = True
            self._mailbox.report(self.name, "device-restart", "it is idle, and on for less time than the stream")
        if beat.error_state > self._error_state and beat.error_state in _ERROR_STATES:
            kind, detail = _ERROR_STATES[beat.error_state]
            self._mailbox.report(self.name, kind, detail)
        self._error_state = beat.error_state
        full = FULL_BUS_PERCENT <= beat.bus_load_percent <= 100
        if full and not self._full:
            self._mailbox.report(self.name, "bus-load", f"the bus is busy {beat.bus_load_percent} % of the time")
        self._full = full

    def _take_samples(self, pending: list[list[bytes]]) -> None:
        """Frames by channel; they are lost where nothing has told for too long where a short count belongs."""
        if not any(pending):
            return
        now = time.monotonic()
        self._lost_track = self._lost_track or now - self._on_track_s > LOST_TRACK_S
        if self._lost_track and not self._dialect.is_fd:
            return
        self._on_track_s = now
        for channel, frames in enumerate(pending):
            for counter, samples in self._dialect.decode_samples(frames):
                self._put(channel, counter, samples)

    def _put(self, channel: int, counter: int, raw: NDArray[np.int16]) -> None:
        first = unwrap(counter, self._dialect.counters, self._highest)
        if first < 0:
            self._mailbox.report(self.name, "protocol", f"sample number {counter} before the start")
            return
        values = raw.astype(np.float32) * self._scale[channel]
        self.inbox.samples.put(slice(channel, channel + 1), first, values[None])
        self._highest = max(self._highest, first)
