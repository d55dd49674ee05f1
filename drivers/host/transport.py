"""Bytes to and from an instrument: a serial port or a TCP socket, read in chunks as large as they come."""

import contextlib
import os
import select
import socket
import time
from typing import Protocol

import serial

from drivers.addresses import Address
from recordings.errors import InputError

CHUNK_BYTES = 1 << 18
WRITE_TIMEOUT_S = 2.0


class LineLostError(ConnectionError):
    """The far end has gone, or the adapter was unplugged."""


class Transport(Protocol):
    """A line that was opened."""

    def read(self, timeout_s: float) -> bytes:
        """What has come, waiting for something; nothing after the timeout.  Raises LineLostError."""
        ...

    def write(self, data: bytes) -> None:
        """Send all of it.  Raises LineLostError."""
        ...

    def close(self) -> None:
        """Give the line up."""
        ...


def open_transport(address: Address, *, baud: int = 921600, timeout_s: float = 2.0) -> Transport:
    """Open the line to an instrument.

    Raises
    ------
    InputError
        If there is nothing at the address or it is in use.
    """
    try:
        if address.kind == "tcp":
            return _TcpLine(socket.create_connection((address.host, address.port), timeout=timeout_s))
        return _SerialLine(serial.Serial(address.path, baud, timeout=0, exclusive=True))
    except ConnectionRefusedError as error:
        raise InputError(str(address), "", "nothing listens there", "is the instrument on, the port right?") from error
    except TimeoutError as error:
        raise InputError(str(address), "", f"no answer within {timeout_s:g} s", "is the host right?") from error
    except (serial.SerialException, OSError, ValueError) as error:
        reason = os.strerror(error.errno) if isinstance(error, OSError) and error.errno else str(error)
        raise InputError(str(address), "", f"cannot be opened ({reason})", "is the cable in, the port free?") from error


class _DescriptorLine:
    """What serial lines and sockets have in common: a descriptor that can be waited for."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        os.set_blocking(descriptor, False)
        self._readable = select.poll()
        self._readable.register(descriptor, select.POLLIN)
        self._writable = select.poll()
        self._writable.register(descriptor, select.POLLOUT)

    def read(self, timeout_s: float) -> bytes:
        try:
            if not self._readable.poll(1000 * timeout_s):
                return b""
            data = os.read(self._descriptor, CHUNK_BYTES)
        except BlockingIOError:
            return b""
        except OSError as error:  # a vanished pty or adapter: EIO
            raise LineLostError(error.strerror or str(error)) from error
        if not data:
            raise LineLostError("the far end has hung up")
        return data

    def write(self, data: bytes) -> None:
        deadline = time.monotonic() + WRITE_TIMEOUT_S
        view = memoryview(data)
        while view:
            try:
                view = view[os.write(self._descriptor, view) :]
            except BlockingIOError:
                if time.monotonic() > deadline:
                    raise LineLostError(f"takes no bytes for {WRITE_TIMEOUT_S:g} s") from None
                self._writable.poll(100)
            except OSError as error:
                raise LineLostError(error.strerror or str(error)) from error

    def _forget(self) -> None:
        """The number of a closed descriptor may soon be another file's, such as the recording's: never use it again."""
        self._descriptor = -1


class _SerialLine(_DescriptorLine):
    def __init__(self, port: serial.Serial) -> None:
        self._port = port
        super().__init__(port.fileno())

    def close(self) -> None:
        self._forget()
        with contextlib.suppress(OSError, serial.SerialException):
            self._port.close()


class _TcpLine(_DescriptorLine):
    def __init__(self, link: socket.socket) -> None:
        self._link = link
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        super().__init__(link.fileno())

    def close(self) -> None:
        self._forget()
        self._link.close()
