"""One client of an instrument: its conversation and what waits to be sent to it."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Iterable

from drivers.frames import Frame, FrameKind, encode
from drivers.scpi import Instrument, Interpreter, Registers
from drivers.virtual.ports import Port

WRITE_BYTES = 8192
READ_BYTES = 4096
"""Taken from a client in one turn: commands are short, and thousands of them must not be parsed at once."""
MESSAGES_A_TURN = 16
REPLY_BYTES = 1 << 20
"""Replies that may wait; with more, the client's next commands wait until it reads."""
DEADLOCK_S = 2.0
"""How long a client may send without reading when neither side has room any more (IEEE 488.2, 6.3.1.7)."""

_log = logging.getLogger(__name__)


class Speaker(Instrument):
    """What a session asks of its instrument."""

    _speaking: Session | None = None

    @property
    def stalled(self) -> bool:
        """Whether a fault keeps it from sending."""
        return False

    def streams_to(self, session: Session) -> bool:
        """Whether a session's line carries frames instead of text."""
        return False

    def client_left(self, session: Session) -> None:
        """A client has hung up."""

    def converse(self, session: Session, interpreter: Interpreter, *, messages: int, room: int) -> list[bytes]:
        """Run a client's commands."""
        self._speaking = session
        return interpreter.run(messages=messages, room=room)


class Session:
    """Bytes of one port to the instrument and back.

    Replies overtake the samples that wait, as a client that wants to know something should not wait for those, but
    never each other.
    """

    def __init__(self, instrument: Speaker, port: Port) -> None:
        self.port = port
        self._instrument = instrument
        self._client = 0
        self._clear()

    def _clear(self) -> None:
        self._interpreter = Interpreter(self._instrument)
        self._first: deque[bytes] = deque()
        """Replies, and what they must not overtake."""
        self._samples: deque[bytes] = deque()
        self._under_way = memoryview(b"")
        self._notice = b""
        self._first_bytes = self._sample_bytes = 0
        self.spoke = False
        """Whether its client has ever said anything."""
        self._moved_at = time.monotonic()

    @property
    def name(self) -> str:
        """What other clients know it by."""
        return self.port.address

    @property
    def registers(self) -> Registers:
        """Those of its client."""
        return self._interpreter.registers

    @property
    def over(self) -> bool:
        """Whether nobody will ever come to it again."""
        return not self.port.returns and not self.port.client and not self._client

    @property
    def silent_s(self) -> float:
        """How long no byte has gone either way."""
        return time.monotonic() - self._moved_at

    @property
    def queued_bytes(self) -> int:
        """What waits to be sent."""
        return self._first_bytes + self._sample_bytes + len(self._under_way)

    def send(self, chunks: Iterable[bytes]) -> None:
        """Queue behind everything; replies may overtake it."""
        for chunk in chunks:
            self._samples.append(chunk)
            self._sample_bytes += len(chunk)

    def settle_order(self) -> None:
        """Nothing overtakes what is queued by now."""
        self._first.extend(self._samples)
        self._samples.clear()
        self._first_bytes += self._sample_bytes
        self._sample_bytes = 0

    def reply(self, text: bytes) -> None:
        """Queue a reply: a line as it is or, while streaming, a frame ahead of the samples."""
        if self._instrument.streams_to(self):
            text = encode(Frame(kind=FrameKind.TEXT, sequence=0, payload=text))
        else:
            self.settle_order()
        self._first.append(text)
        self._first_bytes += len(text)

    def notify(self, frame: bytes) -> None:
        """Send a frame ahead of the samples; if an earlier one still waits, this one takes its place."""
        self._notice = frame

    def hang_up(self) -> None:
        """The line is cut: what waits is not for whoever comes next."""
        self.port.reopen()
        self.forget()

    def forget(self) -> None:
        """Begin as for a new client: nothing that was said before counts."""
        if self._client:
            self._client = 0
            self._instrument.client_left(self)
        self._clear()

    def service(self) -> bool:
        """Take what has come, answer, send what the line takes; whether anything moved."""
        self.port.poll()
        if self.port.client != self._client:
            self.forget()
            self._client = self.port.client
        if not self._client:
            return False
        moved = False
        if self._reads:
            data = self.port.read(READ_BYTES)
            if data:
                moved = True
                self.spoke = True
                self._interpreter.feed(data)
        room = REPLY_BYTES - self._first_bytes
        for reply in self._instrument.converse(self, self._interpreter, messages=MESSAGES_A_TURN, room=room):
            moved = True
            self.reply(reply)
        moved = self._flush() or moved
        if moved:
            self._moved_at = time.monotonic()
        elif not self._interpreter.room and self._first_bytes >= REPLY_BYTES and self.silent_s > DEADLOCK_S:
            _log.warning("%s sends without reading, -430 Query DEADLOCKED: hung up", self.name)
            self.hang_up()
        if self.port.ended and (self._instrument.streams_to(self) or not (self._interpreter.busy or self._queued)):
            self.hang_up()
        return moved

    @property
    def _reads(self) -> bool:
        return self._interpreter.room and not self.port.ended

    @property
    def _queued(self) -> bool:
        return bool(self._under_way or self._notice or self._first or self._samples)

    def _next(self) -> bytes:
        """One system call, and one waking of the client, for what is due together."""
        chunks, size = [], 0
        if self._notice:
            chunks, size, self._notice = [self._notice], len(self._notice), b""
        for queue in (self._first, self._samples):
            while queue and (not chunks or size + len(queue[0]) <= WRITE_BYTES):
                chunks.append(queue.popleft())
                size += len(chunks[-1])
                if queue is self._first:
                    self._first_bytes -= len(chunks[-1])
                else:
                    self._sample_bytes -= len(chunks[-1])
            if queue:
                break
        return b"".join(chunks)

    def _flush(self) -> bool:
        moved = False
        while self._queued and not self._instrument.stalled:
            if not self._under_way:
                self._under_way = memoryview(self._next())
            sent = self.port.write(self._under_way)
            moved = moved or sent > 0
            self._under_way = self._under_way[sent:]
            if self._under_way:
                break
        return moved

    def descriptors(self) -> list[tuple[int, bool, bool]]:
        """What to wait for: descriptor, whether for input, whether for room."""
        line, *others = self.port.descriptors()
        writes = self._queued and not self._instrument.stalled and not self.port.throttled
        waits = [] if line < 0 else [(line, self._reads, writes)]
        return waits + [(other, True, False) for other in others if other >= 0]
