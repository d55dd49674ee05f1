"""Host side of the acquisition-and-generator instrument, over a serial port or TCP."""

import contextlib
import queue
import re
import threading
import time
from collections.abc import Sequence

from drivers.frames import Decoder, Frame, FrameKind, unpack_samples
from drivers.host.catalogue import read_catalogue, read_identity
from drivers.host.device import DeviceFailedError, DeviceInbox, Mailbox, configure_channels
from drivers.host.text_line import ask_line, drain
from drivers.host.transport import LineLostError, Transport, open_transport
from drivers.instruments import DeviceSettings
from recordings.errors import InputError
from recordings.run import Channel
from recordings.streams import Excitation

DEVICE_ERROR = -300
"""SCPI's number for what is wrong with the device itself, not with what it was asked."""
RETRY_S = 0.25
_STREAM_ENDED = b""
_WITH_ERROR = re.compile(r'(.*);(-?\d+),"[^"]*"')


class DaqClient:
    """Talks SCPI to the instrument and takes its frames in a thread of its own while it streams.

    Parameters
    ----------
    settings
        Of the device, from the instruments file.
    mailbox
        Where samples and events are announced.
    timeout_s
        Longest wait for an answer.
    reconnect_s
        How long to look for the device again when the line is lost.

    Raises
    ------
    InputError
        If nothing answers at the address, or what does is no such instrument.
    """

    def __init__(
        self, settings: DeviceSettings, mailbox: Mailbox, *, timeout_s: float = 2.0, reconnect_s: float = 10.0
    ) -> None:
        self.name = settings.name
        self.address = str(settings.parsed_address)
        self._settings = settings
        self._mailbox = mailbox
        self._timeout_s = timeout_s
        self._reconnect_s = reconnect_s
        self._line: Transport = self._open()
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()
        self._replies: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self.failure = ""
        self.recovering = False
        self._end_reason: str | None = None
        try:
            self._silence()
            self.identity = read_identity(self._query_line)
            found = read_catalogue(self._query_line, device=self.name)
            self.channels: Sequence[Channel]
            self._device_channels = len(found)
            self.channels, self._wiring = configure_channels(
                found, settings.channel, device=self.name, source=self.address
            )
        except (LineLostError, TimeoutError, ValueError) as error:
            self._line.close()
            raise self._no_instrument(str(error)) from error
        except InputError:
            self._line.close()
            raise
        self.inbox = DeviceInbox(self._device_channels, self._wiring, tolerance=0)

    def _open(self) -> Transport:
        return open_transport(self._settings.parsed_address, baud=self._settings.baud, timeout_s=self._timeout_s)

    def _no_instrument(self, reason: str) -> InputError:
        return InputError(self.address, "", reason, "is it the right port, the right baud rate, the instrument on?")

    # --- text ---------------------------------------------------------------------------------------------------

    def _silence(self) -> None:
        """End what an earlier client may have left running, and throw away what still comes."""
        self._line.write(b"\n:ACQ:STOP;*CLS\n")
        drain(self._line, timeout_s=self._timeout_s)

    def _query_line(self, text: str) -> str:
        """Ask while the line carries plain text."""
        return ask_line(self._line, text, timeout_s=self._timeout_s)

    def query(self, text: str) -> str:
        """Ask, streaming or not.

        Raises
        ------
        TimeoutError
            If no answer came, although it was asked twice.
        DeviceFailedError
            If the device has ended its stream because it failed.
        """
        if self._thread is None or self.inbox.ended:
            return self._query_ended(text)
        deadline = time.monotonic() + self._timeout_s
        while not self._replies.empty():
            self._replies.get_nowait()
        while time.monotonic() < deadline:
            self._write(text)
            try:
                reply = self._replies.get(timeout=max(RETRY_S, self._timeout_s / 2))
            except queue.Empty:
                if self.failure:
                    break
                continue
            if reply == _STREAM_ENDED:
                return self._query_ended(text)
            return reply.decode("latin-1").strip()
        raise TimeoutError(f"{self.name} at {self.address}: no answer to {text!r}" + self._because())

    def _query_ended(self, text: str) -> str:
        """Ask on a line that carries plain text, because it always did or because the device has ended its stream."""
        if self._thread is not None:
            reason = self.why_ended()
            if reason:
                raise DeviceFailedError(f"{self.name} at {self.address} has stopped: {reason}")
        return self._query_line(text)

    def why_ended(self) -> str:
        """Why the device ended its stream unasked, in its words; empty if it says nothing, or was asked."""
        thread = self._thread
        if thread is None or not self.inbox.ended:
            return ""
        if self._end_reason is None:
            thread.join(self._timeout_s)
            self._end_reason = ""
            with contextlib.suppress(TimeoutError, LineLostError):
                drain(self._line, timeout_s=self._timeout_s)  # answers to what was asked before
                self._end_reason = self._failure_told()
            if self._end_reason:
                self._mailbox.report(self.name, "device-error", self._end_reason)
        return self._end_reason

    def _failure_told(self) -> str:
        """What a device that carries plain text says of its failure; empty if there is none."""
        return ask_line(self._line, "*CLS;:ACQ:FAIL?", timeout_s=self._timeout_s).strip('"')

    def _because(self) -> str:
        return f" ({self.failure})" if self.failure else ""

    def _write(self, text: str) -> None:
        if self.recovering:
            return
        with contextlib.suppress(LineLostError):  # the reader notices it, reports it and reconnects
            self._line.write(text.encode() + b"\n")

    # --- control ------------------------------------------------------------------------------------------------

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        """Choose the rate; gives the one obtained."""
        return float(self._checked(f"ACQ:RATE {sample_rate_Hz!r};RATE?"))

    def _checked(self, text: str) -> str:
        """Ask, and raise InputError if the instrument refuses."""
        answer = self.query(text + ";:SYST:ERR?")
        match = _WITH_ERROR.fullmatch(answer)
        if match is None or match[2] != "0":
            self.query("*CLS;*OPC?")
            if match is not None and match[2] == str(DEVICE_ERROR):
                raise DeviceFailedError(f"{self.name} at {self.address}: {answer[len(match[1]) + 1 :]}")
            raise InputError(f"{self.name} at {self.address}", text, f"refused with {answer[-100:]}")
        return match[1]

    def set_output(self, excitation: Excitation) -> tuple[int, int]:
        """Change the generator; gives the sample and the device time from which it holds."""
        if excitation.kind == "off":
            text = "OUTP OFF"
        elif excitation.kind == "sine":
            text = f"SOUR:FUNC SIN;FREQ {excitation.frequency_Hz!r};VOLT {excitation.amplitude_V!r};:OUTP ON"
        else:
            low, high = excitation.band_Hz
            shape = "RAND" if excitation.kind == "random" else f"MULT;:SOUR:MULT:PER {excitation.period_s!r}"
            text = (
                f"SOUR:FUNC {shape};:SOUR:NOIS:BAND {low!r},{high!r};:SOUR:NOIS:SEED {excitation.seed};"
                f":SOUR:VOLT {excitation.amplitude_V!r};:OUTP ON"
            )
        answer = self._checked(text + ";:OUTP:EFF?")
        index, _, time_ns = answer.partition(",")
        return int(index), int(time_ns)

    def acknowledge(self, index: int) -> None:
        """Samples before this one have been dealt with: the instrument may run on, where it waits at all."""
        self._write(f":ACQ:ACKN {index}")

    def waits_at(self) -> int | None:
        """The sample at which its window ends, if the instrument has come to it and waits; else None."""
        try:
            position, _, limit = self.query(":ACQ:POS?").partition(",")
        except TimeoutError:
            return None
        return int(limit) if position == limit and limit.isdigit() else None

    def start(self, *, block_length: int) -> None:
        """Stream from sample 0, and trigger the others.

        Raises
        ------
        DeviceFailedError
            If it has nothing to measure.
        """
        with self._mailbox.changed:
            self.inbox = DeviceInbox(self._device_channels, self._wiring, tolerance=block_length)
            if not self._settings.generator:
                self._mailbox.register_clock(self.name, self.inbox.clock)
        self.failure = ""
        self._end_reason = None
        if self.query("*TST?") != "0":
            raise DeviceFailedError(f"{self.name} at {self.address} fails its self-test: {self._failure_told()}")
        self._checked(f"ACQ:BLOC {block_length};WIND {2 * block_length};BLOC?")
        self._stopping.clear()
        self._line.write(b":ACQ:STAR\n")
        self._thread = threading.Thread(target=self._receive, name=f"reader of {self.name}", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Generator to zero, end of the stream; never raises."""
        thread, self._thread = self._thread, None
        self._write(":OUTP OFF;:ACQ:STOP")
        if thread is not None:
            thread.join(self._timeout_s if not self.failure else 0)
            self._stopping.set()
            thread.join(self._timeout_s)
            if not self.failure:
                try:
                    self._silence()
                except LineLostError as error:
                    self.failure = str(error)

    def close(self) -> None:
        """Give the line up."""
        self._line.close()

    # --- samples ------------------------------------------------------------------------------------------------

    def _receive(self) -> None:
        """Body of the thread: frames from the line to the inbox, until the end frame."""
        decoder = Decoder()
        seen = (0, 0, 0)
        while not self._stopping.is_set() and not self.inbox.ended:
            try:
                data = self._line.read(0.1)
            except LineLostError as error:
                if self._stopping.is_set() or not self._reconnect(str(error)):
                    return
                decoder = Decoder()
                seen = (0, 0, 0)
                continue
            if not data:
                continue
            frames = decoder.feed(data)
            with self._mailbox.changed:
                for frame in frames:
                    self._take(frame)
                self._mailbox.announce(self.inbox)
            counts = (decoder.bad_headers + decoder.bad_payloads, decoder.lost_frames, decoder.late_frames)
            if counts != seen:
                if counts[0] > seen[0]:
                    self._mailbox.report(self.name, "checksum", f"{counts[0] - seen[0]} frame(s) refused")
                if counts[1] > seen[1]:
                    self._mailbox.report(self.name, "lost-frames", f"{counts[1] - seen[1]} frame(s) missing")
                if counts[2] > seen[2]:
                    self._mailbox.report(self.name, "reordered", f"{counts[2] - seen[2]} frame(s) came late")
                seen = counts

    def _take(self, frame: Frame) -> None:
        inbox = self.inbox
        if frame.kind == FrameKind.SAMPLES:
            try:
                values, overload = unpack_samples(frame)
            except ValueError as error:
                self._mailbox.report(self.name, "protocol", str(error))
                return
            if len(values) != self._device_channels:
                self._mailbox.report(self.name, "protocol", f"a frame with {len(values)} channels")
                return
            inbox.sample_rate_Hz = frame.sample_rate_Hz
            inbox.times.add(frame.first_index, frame.time_ns)
            if self._settings.generator:
                self._mailbox.now_ns = frame.time_ns
            if inbox.samples.put(slice(None), frame.first_index, values):
                inbox.note_overload(frame.first_index, overload)
        elif frame.kind == FrameKind.TEXT:
            self._replies.put(frame.payload)
        elif frame.kind == FrameKind.PULSE and len(frame.payload) == 4:
            pulse = int.from_bytes(frame.payload, "little")
            if self._settings.generator:
                self._mailbox.reference_pulse(pulse, frame.time_ns)
            else:
                inbox.clock.add_local(pulse, frame.time_ns)
        elif frame.kind == FrameKind.COUNTERS and len(frame.payload) == 8:
            lost = int.from_bytes(frame.payload, "little")
            self._mailbox.report(self.name, "overrun", f"{lost} samples lost in the instrument so far")
        elif frame.kind == FrameKind.END:
            inbox.ended = True
            self._replies.put(_STREAM_ENDED)  # who waits for an answer shall not wait in vain

    def _reconnect(self, reason: str) -> bool:
        """Look for the instrument again, and go on with its stream; whether that was possible."""
        self._mailbox.report(self.name, "disconnected", reason)
        self.failure = f"disconnected: {reason}"
        self.recovering = True
        self._line.close()
        try:
            return self._find_again()
        finally:
            self.recovering = False

    def _find_again(self) -> bool:
        deadline = time.monotonic() + self._reconnect_s
        while time.monotonic() < deadline and not self._stopping.is_set():
            time.sleep(0.1)
            line: Transport | None = None
            try:
                # Nobody else may speak on the new line before it is known to go on: answers would be taken for others.
                line = self._open()
                line.write(b"\n")
                state = ask_line(line, "*CLS;:ACQ:STAT?", timeout_s=self._timeout_s)
                if state == "INTERRUPTED":
                    line.write(b":ACQ:CONT\n")
                    reason = ""
                else:
                    reason = ask_line(line, ":ACQ:FAIL?", timeout_s=self._timeout_s).strip('"')
            except (InputError, LineLostError, TimeoutError):
                if line is not None:
                    line.close()
                continue
            if state != "INTERRUPTED":
                line.close()
                self.failure = reason or "the instrument has restarted"
                kind, detail = ("device-error", reason) if reason else ("device-restart", f"it is {state}")
                self._mailbox.report(self.name, kind, f"{detail} and has forgotten the stream")
                return False
            self._line = line
            self.failure = ""
            self._mailbox.report(self.name, "reconnected")
            return True
        return False
