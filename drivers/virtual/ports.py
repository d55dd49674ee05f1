"""The instrument's end of a line: a pseudo-terminal, a serial port, or a TCP socket, none of which ever blocks."""

from __future__ import annotations

import contextlib
import errno
import os
import pty
import select
import socket
import termios
import tty
from pathlib import Path
from typing import Protocol

import serial

from drivers.virtual.openings import Openings
from recordings.errors import InputError, reason_of

CHUNK_BYTES = 65536
DEFAULT_BAUD = 921600
BACKLOG = 128
"""Connections that the system keeps until the instrument's next turn."""
TERMINALS = "/dev/pts/"
DEVICES = "/dev"
_BUSY = (errno.EAGAIN, errno.EWOULDBLOCK)


class Port(Protocol):
    """A line to one client at a time."""

    @property
    def address(self) -> str:
        """What a client opens; of a connection, where its client is."""
        ...

    @property
    def client(self) -> int:
        """0 if nobody is there, else a number that no other client of this line has had."""
        ...

    @property
    def returns(self) -> bool:
        """Whether another client may come when this one has left."""
        ...

    @property
    def ended(self) -> bool:
        """Whether the client has said that it sends no more."""
        ...

    @property
    def throttled(self) -> bool:
        """Whether it takes nothing at the moment although its buffer has room."""
        ...

    def poll(self) -> None:
        """Notice a client that has come or gone."""
        ...

    def read(self, most: int = CHUNK_BYTES) -> bytes:
        """What the client has sent, at most so many bytes; nothing if it has not."""
        ...

    def write(self, data: memoryview) -> int:
        """Send what the line takes now; how many bytes."""
        ...

    def descriptors(self) -> list[int]:
        """What to wait for: first what carries the bytes, or -1 if nobody is there, then what tells of clients."""
        ...

    def reopen(self) -> None:
        """Hang up; the client may come again."""
        ...

    def close(self) -> None:
        """Give the line up."""
        ...


def _make_raw(descriptor: int) -> None:
    """No echo, no line editing: bytes as they are."""
    tty.setraw(descriptor, termios.TCSANOW)


class PtyPort:
    """A pseudo-terminal: to a client it is a serial port.

    Parameters
    ----------
    link
        Path of a symbolic link to make to it, for clients that want a name that stays; None for none.  A link that is
        there is replaced only if it leads to a terminal that has gone.

    Raises
    ------
    InputError
        If `link` is something else, another instrument's, or cannot be made.
    """

    throttled = ended = False
    returns = True

    def __init__(self, link: Path | None = None) -> None:
        self._link = link
        self._visits = 0
        self._open()

    @property
    def descriptor(self) -> int:
        """The master's, which also tells the client's settings."""
        return self._master

    def _open(self) -> None:
        self._master, slave = pty.openpty()
        _make_raw(slave)
        self._name = name = os.ttyname(slave)
        # Without a descriptor of its own at the far end the instrument sees the client come and go.
        os.close(slave)
        os.set_blocking(self._master, False)
        self._openings = Openings(name)
        self._open_files = 0
        self.client = 0
        self.address = name
        if self._link is not None:
            try:
                self._place_link(self._link, name)
            except OSError as error:
                self._hang_up()
                raise InputError(self._link, "", reason_of(error)) from error
            except InputError:
                self._hang_up()
                raise
            self.address = str(self._link)

    def _place_link(self, link: Path, name: str) -> None:
        if link.is_symlink():
            target = str(link.readlink())
            if not target.startswith(TERMINALS):
                raise InputError(link, "", "is a link to something else", "give a name that is free, or auto")
            if target != name and Path(target).exists():
                raise InputError(link, "", "leads to a terminal that is in use", "give a name that is free, or auto")
            link.unlink()
        link.symlink_to(name)

    def poll(self) -> None:
        """Look for a hang-up, which lasts until a client opens the line, and for one client after the other."""
        another = False
        for opened in self._openings.take():
            another = another or (opened and not self._open_files and self.client > 0)
            self._open_files = self._open_files + 1 if opened else max(0, self._open_files - 1)
        poller = select.poll()
        poller.register(self._master, select.POLLIN)
        events = poller.poll(0)
        hung_up = bool(events) and bool(events[0][1] & select.POLLHUP)
        unread = bool(events) and bool(events[0][1] & select.POLLIN)
        # What a client sent before it left is still to be read.
        if self.client and (another or (hung_up and not unread)):
            self._discard()
            self.client = 0
        # A whole visit may have passed unseen: it is told by what it sent.
        if not self.client and (unread or not hung_up):
            self._visits += 1
            self.client = self._visits
            self._open_files = max(int(not hung_up), self._open_files)

    def _discard(self) -> None:
        """What a client has not read is not for the next one.

        It is read, not flushed: a flush forgets what the terminal holds, but not what is still on its way there.
        """
        with contextlib.suppress(OSError):
            slave = os.open(self._name, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            try:
                _make_raw(slave)
                while os.read(slave, CHUNK_BYTES):
                    pass
            finally:
                os.close(slave)
        self._openings.take()  # one's own among them
        self._open_files = 0

    def read(self, most: int = CHUNK_BYTES) -> bytes:
        """What has come; a client that has gone gives nothing."""
        try:
            return os.read(self._master, most)
        except OSError:  # nothing there, or nobody: the next poll tells which
            return b""

    def write(self, data: memoryview) -> int:
        """Send what the line's buffer takes, unless its client has gone in this moment."""
        client = self.client
        self.poll()
        if self.client != client:
            return 0
        try:
            return os.write(self._master, data)
        except OSError:
            return 0

    def descriptors(self) -> list[int]:
        """The master's while a client is there, as a hung-up one is always ready; and what tells of openings."""
        return [self._master if self.client else -1, self._openings.descriptor]

    def _hang_up(self) -> None:
        os.close(self._master)
        self._openings.close()

    def reopen(self) -> None:
        """Hang up and come back as a new terminal, as an adapter does that was unplugged."""
        self._take_link_away()
        self._hang_up()
        self._open()

    def close(self) -> None:
        """Hang up."""
        self._take_link_away()
        self._hang_up()

    def _take_link_away(self) -> None:
        """Unless it is another's by now."""
        with contextlib.suppress(OSError):
            if self._link is not None and str(self._link.readlink()) == self._name:
                self._link.unlink()


class SerialPort:
    """A serial port of this machine, for a virtual instrument at the far end of a real cable."""

    throttled = ended = False
    returns = True

    def __init__(self, path: str, baud: int = DEFAULT_BAUD) -> None:
        try:
            self._serial = serial.Serial(path, baud, timeout=0, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise InputError(path, "", f"cannot be opened as a serial port ({error})") from error
        self._descriptor = self._serial.fileno()
        os.set_blocking(self._descriptor, False)
        self.client = 1
        self.address = path

    def poll(self) -> None:
        """A cable does not say whether somebody listens."""

    def read(self, most: int = CHUNK_BYTES) -> bytes:
        """What has come."""
        try:
            return os.read(self._descriptor, most)
        except OSError as error:
            if error.errno not in _BUSY:
                self.client = 0
            return b""

    def write(self, data: memoryview) -> int:
        """Send what the port's buffer takes."""
        try:
            return os.write(self._descriptor, data)
        except OSError as error:
            if error.errno not in _BUSY:
                self.client = 0
            return 0

    def descriptors(self) -> list[int]:
        """The port's descriptor."""
        return [self._descriptor if self.client else -1]

    def reopen(self) -> None:
        """Drop what the port holds; a cable cannot be pulled by software."""
        self._serial.reset_output_buffer()

    def close(self) -> None:
        """Close the port."""
        self._serial.close()


class TcpPort:
    """A TCP socket that listens; every client gets a line of its own.

    Parameters
    ----------
    host
        Address to listen at, of IPv4 or IPv6; who names another than loopback lets the network in.
    port
        0 for any that is free.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 5025) -> None:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            self._listener = socket.create_server((host, port), family=family, backlog=BACKLOG)
        except (OSError, OverflowError) as error:
            raise InputError(f"tcp:{host}:{port}", "", f"cannot listen there ({error})") from error
        self._listener.setblocking(False)
        self.address = _endpoint(host, self._listener.getsockname()[1])

    def accept(self) -> TcpLine | None:
        """The line of the next client, if one waits."""
        with contextlib.suppress(BlockingIOError, ConnectionError):
            return TcpLine(self._listener.accept()[0])
        return None

    def fileno(self) -> int:
        """The descriptor that is ready when a client waits."""
        return self._listener.fileno()

    def close(self) -> None:
        """Stop listening."""
        self._listener.close()


class TcpLine:
    """One client's connection; whose machine has died is noticed within a minute."""

    throttled = returns = False

    def __init__(self, link: socket.socket) -> None:
        self._link = link
        link.setblocking(False)
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        link.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for option, value in (("TCP_KEEPIDLE", 30), ("TCP_KEEPINTVL", 10), ("TCP_KEEPCNT", 3)):  # s, s, times
            if hasattr(socket, option):
                link.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)
        self.client = 1
        self.ended = False
        try:
            self.address = _endpoint(*link.getpeername()[:2])
        except OSError:  # gone already
            self.address = "?"

    def poll(self) -> None:
        """Reading and writing tell of an end."""

    def read(self, most: int = CHUNK_BYTES) -> bytes:
        """What has come."""
        if not self.client or self.ended:
            return b""
        try:
            data = self._link.recv(most)
        except BlockingIOError:
            return b""
        except OSError:
            self.close()
            return b""
        self.ended = not data
        return data

    def write(self, data: memoryview) -> int:
        """Send what the socket takes."""
        try:
            return self._link.send(data) if self.client else 0
        except BlockingIOError:
            return 0
        except OSError:
            self.close()
            return 0

    def descriptors(self) -> list[int]:
        """The socket's descriptor."""
        return [self._link.fileno()]

    def reopen(self) -> None:
        """Hang up."""
        self.close()

    def close(self) -> None:
        """Hang up."""
        self.client = 0
        self._link.close()


def _endpoint(host: str, port: int) -> str:
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
