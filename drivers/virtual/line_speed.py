"""A pseudo-terminal that behaves like a wire: so many bytes a second, and rubbish at the wrong baud rate."""

import termios
import time

import numpy as np

from drivers.virtual.ports import CHUNK_BYTES, PtyPort

_BITS_A_BYTE = 10  # start, eight of data, stop
_SPEEDS = {getattr(termios, name): int(name[1:]) for name in dir(termios) if name[0] == "B" and name[1:].isdigit()}


class WirePort:
    """A :class:`drivers.virtual.ports.Port` with the limits of a serial line.

    Parameters
    ----------
    port
        The pseudo-terminal, from whose settings the client's baud rate is read.
    baud
        The instrument's.
    multiple
        Of real time; None for no limit of the speed.
    """

    BURST_S = 0.05
    ended = False
    returns = True

    def __init__(self, port: PtyPort, *, baud: int, multiple: float | None) -> None:
        self._port = port
        self._baud = baud
        self._bytes_per_s = baud / _BITS_A_BYTE * multiple if multiple is not None else None
        self._credit = 0.0
        self._since = time.monotonic()
        self._noise = np.random.default_rng(baud)

    @property
    def address(self) -> str:
        """Name of the terminal."""
        return self._port.address

    @property
    def client(self) -> int:
        """Number of the client that is there, or 0."""
        return self._port.client

    @property
    def throttled(self) -> bool:
        """Whether the wire is still busy with what was sent."""
        self._earn()
        return self._bytes_per_s is not None and self._credit < 1

    def _earn(self) -> None:
        now = time.monotonic()
        if self._bytes_per_s is not None:
            earned = self._credit + (now - self._since) * self._bytes_per_s
            self._credit = min(earned, self.BURST_S * self._bytes_per_s)
        self._since = now

    @property
    def _understood(self) -> bool:
        """Whether the client listens at the instrument's rate."""
        speed = _SPEEDS.get(termios.tcgetattr(self._port.descriptor)[5])
        return speed is None or speed == self._baud  # a rate without a constant cannot be told apart

    def poll(self) -> None:
        """Notice a client that has come or gone."""
        self._port.poll()

    def read(self, most: int = CHUNK_BYTES) -> bytes:
        """What the client has sent, as it looks from here."""
        data = self._port.read(most)
        return data if not data or self._understood else self._garbled(data)

    def write(self, data: memoryview) -> int:
        """Send what the wire takes now."""
        self._earn()
        if self._bytes_per_s is not None:
            data = data[: int(self._credit)]
        if not data:
            return 0
        sent = self._port.write(data if self._understood else memoryview(self._garbled(bytes(data))))
        self._credit -= sent
        return sent

    def _garbled(self, data: bytes) -> bytes:
        """Bits sampled at the wrong moments: as many bytes, none of them as sent."""
        wrong = self._noise.integers(1, 256, len(data), dtype=np.uint8)
        return (np.frombuffer(data, np.uint8) ^ wrong).tobytes()

    def descriptors(self) -> list[int]:
        """Descriptors to wait for."""
        return self._port.descriptors()

    def reopen(self) -> None:
        """Hang up."""
        self._port.reopen()

    def close(self) -> None:
        """Hang up for good."""
        self._port.close()
