"""A python-can interface for processes of one machine: lossless, ordered, with back-pressure.

``can.Bus(interface="unixbus", channel="/path/of/socket")``.  The first to open the path becomes the hub of the bus and
passes frames on between the others whenever it receives; AF_UNIX SEQPACKET keeps frames whole.  A participant that
does not read stops the others once its socket is full, as nothing may be lost: leave the bus, or read it.
"""

import contextlib
import errno
import select
import socket
import struct
import threading
import time
from collections import deque
from pathlib import Path
from typing import Any

import can

LAST_WORDS_S = 10.0
"""How long a participant that leaves waits for others to read; one that never reads must not hold it for ever."""
_HEAD = struct.Struct("<IBB2x")
_FD, _RATE_SWITCH, _ERROR_STATE, _REMOTE, _EXTENDED, _ERROR = 1, 2, 4, 8, 16, 32
_FULL = (errno.EAGAIN, errno.EWOULDBLOCK, errno.ENOBUFS)


class UnixBus(can.BusABC):
    """A bus over one socket path.

    Parameters
    ----------
    channel
        Path of the socket; made with access for its owner only.

    Raises
    ------
    can.CanInitializationError
        If the path cannot be used.
    """

    def __init__(self, channel: str, can_filters: Any = None, **kwargs: Any) -> None:
        self._path = Path(str(channel))
        self._peers: dict[int, socket.socket] = {}
        self._pending: dict[int, deque[bytes]] = {}
        self._received: deque[bytes] = deque()
        self._poll = select.epoll()
        self._lock = threading.RLock()  # one thread may send while another receives
        self._listener: socket.socket | None = None
        try:
            self._open()
        except OSError as error:
            self._poll.close()
            raise can.CanInitializationError(f"{self._path}: {error.strerror or error}") from error
        self._can_protocol = can.CanProtocol.CAN_FD
        self.channel_info = f"unixbus {self._path}"
        super().__init__(channel=channel, can_filters=can_filters, **kwargs)

    def _open(self) -> None:
        """Join the bus of the path, or start it."""
        link = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            link.connect(str(self._path))
        except (FileNotFoundError, ConnectionRefusedError):
            link.close()
            with contextlib.suppress(FileNotFoundError):
                if self._path.exists() and not self._path.is_socket():
                    raise OSError(errno.EEXIST, "exists and is not a socket") from None
                self._path.unlink()  # nobody listens: its hub was killed
            listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            try:
                listener.bind(str(self._path))
                self._path.chmod(0o600)
                listener.listen(16)
            except OSError:
                listener.close()
                raise
            listener.setblocking(False)
            self._listener = listener
            self._poll.register(listener, select.EPOLLIN)
        except OSError:
            link.close()
            raise
        else:
            self._add(link)

    def _add(self, link: socket.socket) -> None:
        link.setblocking(False)
        self._peers[link.fileno()] = link
        self._pending[link.fileno()] = deque()
        self._poll.register(link, select.EPOLLIN)

    def _drop(self, descriptor: int) -> None:
        """A participant has gone; if it was the hub, so is the bus."""
        link = self._peers.pop(descriptor)
        del self._pending[descriptor]
        self._poll.unregister(link)
        link.close()

    def _flush(self) -> bool:
        """Send what waits; whether nothing waits any more."""
        if not any(self._pending.values()):
            return True
        empty = True
        for descriptor in list(self._pending):
            pending = self._pending[descriptor]
            while pending and self._try_send(descriptor, pending[0]):
                if descriptor not in self._pending:
                    break
                pending.popleft()
            empty &= descriptor not in self._pending or not pending
        return empty

    def _try_send(self, descriptor: int, packet: bytes) -> bool:
        """Whether the packet needs no further attempt: it was sent, or its receiver has gone."""
        try:
            self._peers[descriptor].send(packet)
        except OSError as error:
            if error.errno in _FULL:
                return False
            self._drop(descriptor)
        return True

    def _broadcast(self, packet: bytes, origin: int = -1) -> None:
        for descriptor in list(self._peers):
            if descriptor == origin:
                continue
            if not self._try_send(descriptor, packet):
                self._pending[descriptor].append(packet)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send to every participant; waits for a slow one for up to `timeout` seconds (None: as long as it takes).

        Raises
        ------
        can.CanTimeoutError
            If a participant's socket stayed full; the frame was sent to nobody.
        can.CanOperationError
            If the hub has gone.
        """
        flags = (
            _FD * msg.is_fd
            + _RATE_SWITCH * msg.bitrate_switch
            + _ERROR_STATE * msg.error_state_indicator
            + _REMOTE * msg.is_remote_frame
            + _EXTENDED * msg.is_extended_id
            + _ERROR * msg.is_error_frame
        )
        packet = _HEAD.pack(msg.arbitration_id, flags, msg.dlc) + bytes(msg.data)
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            with self._lock:
                if self._flush():
                    if self._listener is None and not self._peers:
                        raise can.CanOperationError("the hub of the bus has gone")
                    self._broadcast(packet)
                    return
            left = None if deadline is None else deadline - time.monotonic()
            if left is not None and left <= 0:
                raise can.CanTimeoutError("a participant of the bus does not read")
            self._wait_for_room(left)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self._received:
            with self._lock:
                clear = self._flush()
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            # A hub that cannot pass frames on stops taking them, so that its queue stays short.
            ready = self._poll.poll(left) if clear else self._wait_for_room(left)
            with self._lock:
                for descriptor, _ in ready:
                    if self._listener is not None and descriptor == self._listener.fileno():
                        self._accept()
                    elif descriptor in self._peers:
                        self._take(descriptor)
            if self._listener is None and not self._peers:
                raise can.CanOperationError("the hub of the bus has gone")
            if not self._received and deadline is not None and time.monotonic() >= deadline:
                return None, False
        return _message(self._received.popleft(), str(self._path)), False

    def _wait_for_room(self, timeout: float | None) -> list[tuple[int, int]]:
        full = select.poll()
        with self._lock:
            for descriptor, pending in self._pending.items():
                if pending:
                    full.register(descriptor, select.POLLOUT)
        full.poll(None if timeout is None else 1000 * timeout)
        return []

    def _accept(self) -> None:
        assert self._listener is not None
        with contextlib.suppress(BlockingIOError, ConnectionError):
            self._add(self._listener.accept()[0])

    def _take(self, descriptor: int) -> None:
        """Receive what one participant has sent, a bounded number of frames at a time."""
        for _ in range(64):
            try:
                packet = self._peers[descriptor].recv(256)
            except BlockingIOError:
                return
            except ConnectionResetError:
                continue  # it left without having read everything; what it sent before that is still to come
            except OSError:
                packet = b""
            if not packet:
                self._drop(descriptor)
                return
            if self._listener is not None:
                self._broadcast(packet, origin=descriptor)
            self._received.append(packet)

    def fileno(self) -> int:
        """A descriptor that is readable when a frame may have come."""
        return self._poll.fileno()

    def shutdown(self) -> None:
        """Leave the bus when the others have taken what was sent, or after ten seconds; the hub takes it down."""
        super().shutdown()
        deadline = time.monotonic() + LAST_WORDS_S
        while True:
            with self._lock:
                left = deadline - time.monotonic()
                if left <= 0 or self._flush():
                    break
            self._wait_for_room(left)
        for descriptor in list(self._peers):
            self._drop(descriptor)
        if self._listener is not None:
            self._listener.close()
            self._listener = None
            self._path.unlink(missing_ok=True)
        if not self._poll.closed:
            self._poll.close()


def _message(packet: bytes, channel: str) -> can.Message:
    """The frame in a packet; what is too short or inconsistent becomes an error frame, as noise on a wire does."""
    arbitration_id = flags = dlc = 0
    valid = len(packet) >= _HEAD.size
    if valid:
        arbitration_id, flags, dlc = _HEAD.unpack_from(packet)
        valid = arbitration_id < 1 << 29 and len(packet) - _HEAD.size == (0 if flags & _REMOTE else dlc) <= 64
    if not valid:
        return can.Message(timestamp=time.time(), is_error_frame=True, channel=channel)
    return can.Message(
        timestamp=time.time(),
        arbitration_id=arbitration_id,
        is_extended_id=bool(flags & _EXTENDED),
        is_remote_frame=bool(flags & _REMOTE),
        is_error_frame=bool(flags & _ERROR),
        channel=channel,
        dlc=dlc,
        data=packet[_HEAD.size :],
        is_fd=bool(flags & _FD),
        bitrate_switch=bool(flags & _RATE_SWITCH),
        error_state_indicator=bool(flags & _ERROR_STATE),
    )
