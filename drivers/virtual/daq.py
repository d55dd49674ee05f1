"""The acquisition-and-generator instrument: SCPI for control, frames for samples."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.frames import MAX_PAYLOAD, Frame, FrameKind, encode, encode_samples
from drivers.scpi import MEASURING, SAMPLES_LOST, Integer, Number, ScpiError, command, quoted
from drivers.virtual.catalogue import Catalogue
from drivers.virtual.control import Control, Protection
from drivers.virtual.faults import LinkFaults
from drivers.virtual.feed import SampleFeed, SourceFailedError
from drivers.virtual.ports import Port, TcpPort
from drivers.virtual.session import Session
from recordings.run import SampleBlock

MAKER = "Virtual Test Rig"
FIFO_BYTES = 1 << 20
"""Memory of the instrument for samples the line has not taken; beyond it they are lost and counted."""
_BLOCK_LIMIT = 8192


@dataclass
class _Stream:
    """A client's stream: where it started, what has been sent."""

    session: Session | None
    origin: int
    sequence: int = 0
    overrun: int = 0


class AcquisitionInstrument(Catalogue, Control):
    """A generator and some channels behind one or more ports.

    Parameters
    ----------
    feed
        Where samples come from.
    channels
        Names of the feed's channels this instrument carries.
    ports
        Lines it listens on.
    lossless
        Let the feed wait for the line; otherwise a full buffer is an overrun, as on a UART.
    protection
        What guards it against its clients.
    """

    def __init__(
        self,
        feed: SampleFeed,
        *,
        channels: Sequence[str],
        ports: Sequence[Port | TcpPort],
        lossless: bool,
        origin: str = "simulated",
        faults: LinkFaults | None = None,
        protection: Protection | None = None,
    ) -> None:
        super().__init__(feed, ports=ports, faults=faults, protection=protection)
        self.identity = (MAKER, "DAQ-GEN", origin, "1.0")
        self.name = "daq"
        known = {channel.name: channel for channel in feed.channels}
        self._channels = tuple(known[channel] for channel in channels)
        self._lossless = lossless
        self._stream: _Stream | None = None
        self._window = 0

    # --- what the server asks -------------------------------------------------------------------------------------

    @property
    def listening(self) -> bool:
        """Whether a client waits for samples."""
        return self.reading or (self._stream is not None and self._stream.session is not None)

    @property
    def has_room(self) -> bool:
        """Whether the line has taken what came before."""
        stream = self._stream
        return stream is None or stream.session is None or stream.session.queued_bytes < FIFO_BYTES // 16

    def streams_to(self, session: Session) -> bool:
        """Whether a session's line carries frames."""
        return self._stream is not None and self._stream.session is session

    def interrupt_stream(self) -> bool:
        """A client that hangs up may come back and continue; what is due meanwhile is lost."""
        if self._stream is None:
            return False
        self._stream.session = None
        # Where nothing may be lost the rig waits for the client to come back.
        self._feed.limit = self._feed.index if self._feed.limit is None else self._feed.limit
        return True

    def refresh_status(self) -> None:
        """Whether it measures, and whether samples of the stream were lost."""
        lost = self._stream is not None and self._stream.overrun > 0
        for session in self._sessions:
            session.registers.operation.put(MEASURING, self.listening)
            session.registers.questionable.put(SAMPLES_LOST, lost)

    def accept(self, block: SampleBlock) -> None:
        """Take a block of the feed and send it to who listens."""
        self.refresh_status()
        values = np.stack([block.samples[channel.name] for channel in self._channels]).astype(np.float32, copy=False)
        self.take_readings(values)
        if self._stream is None:
            return
        self._send_pulses(self._stream, block)  # first, so that the block's time can be aligned when it is there
        overload = np.array([block.overload.get(channel.name, 0) for channel in self._channels], np.uint32)
        most = (MAX_PAYLOAD - overload.nbytes) // (4 * len(values))
        for begin, end in _known(values):
            for start in range(begin, end, most):
                part = values[:, start : min(start + most, end)]
                self._send_samples(self._stream, block, part, overload, start)
                overload = np.zeros_like(overload)
        self.pass_time(1e-9 * block.time_ns + len(block) / block.sample_rate_Hz)

    def end(self) -> None:
        """The source has ended: so does the stream, and a READ? that still waits fails."""
        self.abandon_reading(ScpiError(-200, "the source has ended"))
        self.end_stream()

    def fail(self, reason: str) -> None:
        """The source has failed: so has what waits for samples, and the generator is off."""
        error = ScpiError(-300, reason)
        if not self.abandon_reading(error):
            for session in self._sessions:
                session.registers.report(error)
        self.end_stream()
        self.switch_off()

    @property
    def stream_origin(self) -> int:
        """The sample that the stream counts as 0."""
        return self._stream.origin if self._stream else 0

    # --- streaming ------------------------------------------------------------------------------------------------

    def _emit(self, stream: _Stream, frame: bytes) -> None:
        assert stream.session is not None
        stream.sequence += 1
        stream.session.send(self._faults.pass_on(frame))

    def _send_samples(
        self,
        stream: _Stream,
        block: SampleBlock,
        values: NDArray[np.float32],
        overload: NDArray[np.uint32],
        start: int,
    ) -> None:
        session = stream.session
        if session is None or (not self._lossless and session.queued_bytes + values.nbytes > FIFO_BYTES):
            stream.overrun += values.shape[1]
            self._send_counters(stream)
            return
        frame = encode_samples(
            values,
            overload=overload,
            first_index=block.first_index + start - stream.origin,
            time_ns=block.time_at(start),
            sample_rate_Hz=block.sample_rate_Hz,
            sequence=stream.sequence,
        )
        self._emit(stream, frame)

    def _send_pulses(self, stream: _Stream, block: SampleBlock) -> None:
        if stream.session is None:
            return
        for number, index in self._feed.pulses(block):
            self._emit(
                stream,
                encode(
                    Frame(
                        kind=FrameKind.PULSE,
                        sequence=stream.sequence,
                        first_index=index - stream.origin,
                        time_ns=block.time_at(index - block.first_index),
                        sample_rate_Hz=block.sample_rate_Hz,
                        payload=number.to_bytes(4, "little"),
                    )
                ),
            )

    def _send_counters(self, stream: _Stream) -> None:
        if stream.session is not None:
            payload = stream.overrun.to_bytes(8, "little")
            stream.session.notify(encode(Frame(kind=FrameKind.COUNTERS, sequence=0, payload=payload)))

    def reset(self) -> None:
        """Generator off, defaults, stream off."""
        super().reset()
        self.end_stream()
        self._window = 0
        self._feed.block_length = 240

    # --- settings and samples -------------------------------------------------------------------------------------

    @command("ACQuire:RATE", Number(minimum=1.0, maximum=1e6, unit="Hz"))
    def _set_rate(self, rate_Hz: float) -> None:
        """Samples a second; the converter takes the nearest it has."""
        self._refuse_while_streaming()
        try:
            self._feed.set_sample_rate(rate_Hz)
        except SourceFailedError as error:
            raise ScpiError(-300, str(error)) from error

    @command("ACQuire:RATE?")
    def _get_rate(self) -> float:
        """The rate in force, in Hz."""
        return float(self._feed.sample_rate_Hz)

    @command("ACQuire:BLOCk", Integer(minimum=1, maximum=_BLOCK_LIMIT))
    def _set_block(self, samples: int) -> None:
        """Samples in a frame, at most."""
        self._refuse_while_streaming()
        self._feed.block_length = samples

    @command("ACQuire:BLOCk?")
    def _get_block(self) -> int:
        """Samples in a frame, at most."""
        return self._feed.block_length

    @command("ACQuire:WINDow", Integer(maximum=1 << 24))
    def _set_window(self, samples: int) -> None:
        """How far to run ahead of the acknowledged sample; 0 is free running, and so is an instrument in real time."""
        self._refuse_while_streaming()
        self._window = samples

    @command("ACQuire:WINDow?")
    def _get_window(self) -> int:
        """The window in samples."""
        return self._window

    @command("ACQuire:ACKNowledge", Integer())
    def _acknowledge(self, index: int) -> None:
        """The client is done with the samples before this one."""
        stream = self._stream
        if stream is not None and self._window and self._feed.limit is not None:
            self._feed.limit = max(self._feed.limit, stream.origin + index + self._window)

    @command("ACQuire:STARt")
    def _start(self) -> None:
        """Stream from sample 0, and start what waits for the trigger; from here on the line carries frames."""
        if self.listening:
            raise ScpiError(-213, "already acquiring")
        self.begin()
        self._feed.trigger()
        self._stream = _Stream(self._speaking, self._feed.index)
        self._faults.start(self._feed.index)
        self._continue()

    @command("ACQuire:CONTinue", controls=False)
    def _continue(self) -> None:
        """Go on with a stream whose client had left; its samples count on."""
        stream = self._stream
        if stream is None or stream.session not in (None, self._speaking):
            raise ScpiError(-221, "no interrupted stream")
        self.resume()
        stream.session = self._speaking
        self._feed.limit = self._feed.index + self._window if self._window else None

    @command("ACQuire:STOP")
    def _stop(self) -> None:
        """Send what is left, an end frame, then plain text again."""
        self.end_stream()

    @command("ACQuire:STATe?")
    def _state(self) -> str:
        """IDLE, RUN, INTERRUPTED (its client has left) or FAILED (what it measures gives nothing)."""
        if self._stream is None:
            return "FAILED" if self._feed.failure else "IDLE"
        return "RUN" if self._stream.session is not None else "INTERRUPTED"

    @command("ACQuire:FAILure?")
    def _failure(self) -> str:
        """Why what it measures gives nothing, in quotes; empty if all is well.  The next start tries again."""
        return quoted(self._feed.failure)

    @command("ACQuire:POSition?")
    def _position(self) -> tuple[int, int]:
        """Samples of this stream made so far, and where the window ends."""
        if self._stream is None:
            return 0, 0
        limit = self._feed.index if self._feed.limit is None else self._feed.limit
        return self._feed.index - self._stream.origin, limit - self._stream.origin

    @command("ACQuire:OVERrun?")
    def _overrun(self) -> int:
        """Samples of this stream that were lost because the line did not keep up."""
        return self._stream.overrun if self._stream else 0

    def _refuse_while_streaming(self) -> None:
        if self._stream is not None and self._stream.session is not None:
            raise ScpiError(-221, "not while streaming")

    def end_stream(self) -> None:
        """Send what is left, and an end frame."""
        stream = self._stream
        if stream is not None and stream.session is not None:
            session = stream.session
            end = encode(Frame(kind=FrameKind.END, sequence=stream.sequence))
            session.send([*self._faults.flush(), end])
            session.settle_order()
        self._stream = None
        self._feed.limit = None


def _known(values: NDArray[np.float32]) -> list[tuple[int, int]]:
    """Stretches of samples of which there is at least one channel: the others were lost, and are not made up."""
    have = ~np.isnan(values).all(axis=0)
    if have.all():
        return [(0, values.shape[1])]
    edges = np.flatnonzero(np.diff(have, prepend=False, append=False)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))
