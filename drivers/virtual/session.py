"""One client of an instrument: its conversation and what waits to be sent to it."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import TYPE_CHECKING

from drivers.frames import Frame, FrameKind, encode
from drivers.scpi import Interpreter
from drivers.virtual.ports import Port

if TYPE_CHECKING:
    from drivers.virtual.conversing import Conversing

__all__ = ["Session"]


WRITE_BYTES = 8192


class Session:
    """Bytes of one port to the instrument and back.

    Replies overtake the samples that wait, as a client that wants to know something should not wait for those.
    """

    def __init__(self, instrument: Conversing, port: Port) -> None:
        self.port = port
        self._instrument = instrument
        self._present = False
        self._clear()

    def _clear(self) -> None:
        self._interpreter = Interpreter(self._instrument)
        self._queue: deque[bytes] = deque()
        self._sent_of_first = 0
        self._notice = b""
        self.queued_bytes = 0

    def send(self, chunks: Iterable[bytes]) -> None:
        """Queue behind everything."""
        for chunk in chunks:
            self._queue.append(chunk)
            self.queued_bytes += len(chunk)

    def reply(self, text: bytes) -> None:
        """Queue a reply: a line as it is or, while streaming, a frame ahead of the samples."""
        if not self._instrument.streams_to(self):
            self.send([text])
            return
        chunk = encode(Frame(kind=FrameKind.TEXT, sequence=0, payload=text))
        position = 1 if self._sent_of_first else 0
        self._queue.insert(position, chunk)
        self.queued_bytes += len(chunk)

    def notify(self, frame: bytes) -> None:
        """Send a frame ahead of the samples; if an earlier one still waits, this one takes its place."""
        self._notice = frame

    def hang_up(self) -> None:
        """The line is cut: what waits is not for whoever comes next."""
        self.port.reopen()
        if self._present:
            self._present = False
            self._instrument.client_left(self)
        self._clear()

    def service(self) -> bool:
        """Take what has come, answer, send what the line takes; whether anything moved."""
        self.port.poll()
        if self.port.connected != self._present:
            self._present = self.port.connected
            if not self._present:
                self._instrument.client_left(self)
            self._clear()
        if not self._present:
            return False
        moved = False
        if self._interpreter.room:
            data = self.port.read()
            if data:
                moved = True
                self._interpreter.feed(data)
        for reply in self._instrument.converse(self, self._interpreter):
            moved = True
            self.reply(reply)
        return self._flush() or moved

    def _flush(self) -> bool:
        moved = False
        while (self._queue or self._notice) and not self._instrument.stalled:
            if self._notice and not self._sent_of_first:
                self._queue.appendleft(self._notice)
                self.queued_bytes += len(self._notice)
                self._notice = b""
            if len(self._queue) > 1 and not self._sent_of_first:
                # One system call, and one waking of the client, for what is due together.
                chunks = [self._queue.popleft()]
                size = len(chunks[0])
                while self._queue and size + len(self._queue[0]) <= WRITE_BYTES:
                    chunks.append(self._queue.popleft())
                    size += len(chunks[-1])
                self._queue.appendleft(b"".join(chunks))
            first = self._queue[0]
            sent = self.port.write(memoryview(first)[self._sent_of_first :])
            if sent == 0:
                break
            moved = True
            self._sent_of_first += sent
            self.queued_bytes -= sent
            if self._sent_of_first < len(first):
                break
            self._queue.popleft()
            self._sent_of_first = 0
        return moved

    @property
    def wants_to_write(self) -> bool:
        """Whether something waits for room on the line."""
        return bool(self._queue or self._notice) and not self._instrument.stalled and not self.port.throttled
