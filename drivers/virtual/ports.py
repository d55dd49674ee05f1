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

from recordings.errors import InputError

__all__ = ["Port", "PtyPort", "SerialPort", "TcpPort"]

CHUNK_BYTES = 65536
DEFAULT_BAUD = 921600
_BUSY = (errno.EAGAIN, errno.EWOULDBLOCK)


class Port(Protocol):
    """A line to one client at a time."""

    @property
    def address(self) -> str:
        """What a client opens."""
        ...

    @property
    def connected(self) -> bool:
        """Whether a client is there."""
        ...

    @property
    def throttled(self) -> bool:
        """Whether it takes nothing at the moment although its buffer has room."""
        ...

    def poll(self) -> None:
        """Notice a client that has come or gone."""
        ...

    def read(self) -> bytes:
        """What the client has sent; nothing if it has not."""
        ...

    def write(self, data: memoryview) -> int:
        """Send what the line takes now; how many bytes."""
        ...

    def fileno(self) -> int:
        """Descriptor to wait for, -1 if there is none now."""
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
        Path of a symbolic link to make to it, for clients that want a name that stays; None for none.
    """

    throttled = False

    def __init__(self, link: Path | None = None) -> None:
        self._link = link
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
        self.connected = False
        self.address = name
        if self._link is not None:
            with contextlib.suppress(FileNotFoundError):
                if self._link.is_symlink():
                    self._link.unlink()
            try:
                self._link.symlink_to(name)
            except OSError as error:
                os.close(self._master)
                raise InputError(self._link, "", error.strerror or str(error)) from error
            self.address = str(self._link)

    def poll(self) -> None:
        """Look for a hang-up, which lasts until a client opens the line."""
        poller = select.poll()
        poller.register(self._master, select.POLLIN)
        events = poller.poll(0)
        # What a client sent before it left is still to be read.
        connected = not events or not events[0][1] & select.POLLHUP or bool(events[0][1] & select.POLLIN)
        if self.connected and not connected:
            self._discard_unread()
        self.connected = connected

    def _discard_unread(self) -> None:
        """What the client has not read is not for the next one."""
        with contextlib.suppress(OSError):
            slave = os.open(self._name, os.O_RDWR | os.O_NOCTTY)
            termios.tcflush(slave, termios.TCIFLUSH)
            os.close(slave)

    def read(self) -> bytes:
        """What has come; a client that has gone gives nothing."""
        try:
            return os.read(self._master, CHUNK_BYTES)
        except OSError:  # nothing there, or nobody: the next poll tells which
            return b""

    def write(self, data: memoryview) -> int:
        """Send what the line's buffer takes."""
        try:
            return os.write(self._master, data)
        except OSError:
            return 0

    def fileno(self) -> int:
        """The master's descriptor while a client is there: a hung-up one is always ready."""
        return self._master if self.connected else -1

    def reopen(self) -> None:
        """Hang up and come back as a new terminal, as an adapter does that was unplugged."""
        os.close(self._master)
        self._open()

    def close(self) -> None:
        """Hang up."""
        os.close(self._master)
        if self._link is not None and self._link.is_symlink():
            self._link.unlink()


class SerialPort:
    """A serial port of this machine, for a virtual instrument at the far end of a real cable."""

    throttled = False

    def __init__(self, path: str, baud: int = DEFAULT_BAUD) -> None:
        try:
            self._serial = serial.Serial(path, baud, timeout=0, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise InputError(path, "", f"cannot be opened as a serial port ({error})") from error
        self._descriptor = self._serial.fileno()
        os.set_blocking(self._descriptor, False)
        self.connected = True
        self.address = path

    def poll(self) -> None:
        """A cable does not say whether somebody listens."""

    def read(self) -> bytes:
        """What has come."""
        try:
            return os.read(self._descriptor, CHUNK_BYTES)
        except OSError as error:
            if error.errno not in _BUSY:
                self.connected = False
            return b""

    def write(self, data: memoryview) -> int:
        """Send what the port's buffer takes."""
        try:
            return os.write(self._descriptor, data)
        except OSError as error:
            if error.errno not in _BUSY:
                self.connected = False
            return 0

    def fileno(self) -> int:
        """The port's descriptor."""
        return self._descriptor if self.connected else -1

    def reopen(self) -> None:
        """Drop what the port holds; a cable cannot be pulled by software."""
        self._serial.reset_output_buffer()

    def close(self) -> None:
        """Close the port."""
        self._serial.close()


class TcpPort:
    """A TCP socket, one client at a time; a further one waits until that has left.

    Parameters
    ----------
    host
        Address to listen at; who names another than loopback lets the network in.
    port
        0 for any that is free.
    """

    throttled = False

    def __init__(self, host: str = "127.0.0.1", port: int = 5025) -> None:
        try:
            self._listener = socket.create_server((host, port))
        except (OSError, OverflowError) as error:
            raise InputError(f"tcp:{host}:{port}", "", f"cannot listen there ({error})") from error
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self.address = f"{host}:{self._listener.getsockname()[1]}"

    @property
    def connected(self) -> bool:
        """Whether a client is there."""
        return self._client is not None

    def poll(self) -> None:
        """Accept a client if there is none."""
        if self._client is not None:
            return
        with contextlib.suppress(BlockingIOError, ConnectionError):
            client, _ = self._listener.accept()
            client.setblocking(False)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._client = client

    def read(self) -> bytes:
        """What has come; an end closes the connection."""
        if self._client is None:
            return b""
        try:
            data = self._client.recv(CHUNK_BYTES)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._hang_up()
        return data

    def write(self, data: memoryview) -> int:
        """Send what the socket takes."""
        if self._client is None:
            return 0
        try:
            return self._client.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            self._hang_up()
            return 0

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
        self._client = None

    def fileno(self) -> int:
        """The client's socket, or the one that waits for a client."""
        return (self._client or self._listener).fileno()

    def reopen(self) -> None:
        """Hang up."""
        self._hang_up()

    def close(self) -> None:
        """Hang up and stop listening."""
        self._hang_up()
        self._listener.close()
