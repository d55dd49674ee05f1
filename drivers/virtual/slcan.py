r"""A serial CAN adapter: the device's end of the slcan protocol, with the node on the bus behind it.

Commands are lines that end with ``\r``; each is answered with ``\r``, or ``\a`` if it is refused.

====== ===================================================================================================
line   does
====== ===================================================================================================
Sn Yn  arbitration rate 10k 20k 50k 100k 125k 250k 500k 750k 1M 83.3k, data rate n Mbit/s; while closed
O L C  go on the bus, listen only, leave it
t r    frame with an 11-bit identifier: ``tiiildd...``, remote frame ``riiil``; ``T``, ``R`` with 29 bits
d b    FD frame without and with the faster data phase: ``biiildd...``; ``D``, ``B`` with 29 bits
V N F  version, serial number, error flags (``80``: bus error, the rates do not fit)
====== ===================================================================================================

Frames from the bus come in the same notation.  With a rate that is not the bus's nothing comes through, either way;
a data rate that was never set follows the bus.
"""

import re
from collections import deque

import can
from can.util import CAN_FD_DLC, len2dlc

from drivers.virtual.ports import Port

BITRATES = (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 750_000, 1_000_000, 83_300)
LINE_LIMIT = 160
OUTPUT_LIMIT = 1 << 14
INPUT_FRAMES = 256
_OK, _REFUSED = b"\r", b"\a"
_FRAME = re.compile(
    rb"(?:([trdb])([0-7][0-9A-Fa-f]{2})|([TRDB])([01][0-9A-Fa-f]{7}))([0-9A-Fa-f])((?:[0-9A-Fa-f]{2})*)"
)
_IGNORED = b"ZMmWXsQ"
"""Time stamps, filters, bus timing by registers: accepted, and without effect."""


class SlcanAdapter(can.BusABC):
    """To the node a bus, to the client at the far end of `port` a serial adapter.

    Parameters
    ----------
    port
        The line to the client.
    bitrate, data_bitrate
        Of the bus, bit/s.
    """

    def __init__(self, port: Port, *, bitrate: float, data_bitrate: float) -> None:
        super().__init__(channel=port.address)
        self._port = port
        self._bus_rates = bitrate, data_bitrate
        self._forget()

    @property
    def address(self) -> str:
        """What a client opens."""
        return self._port.address

    def _forget(self) -> None:
        """As after power-up."""
        self._line = bytearray()
        self._overlong = False
        self._out = bytearray()
        self._received: deque[can.Message] = deque()
        self._is_open = self._silent = self._failing = False
        self._client = self._port.client
        self._rates: tuple[float | None, float | None] = (None, None)

    def _fits(self, message: can.Message) -> bool:
        """Whether a frame gets from the bus to the adapter or back: both must run at the same rates."""
        nominal, data = self._rates
        fits = nominal == self._bus_rates[0] and (not message.bitrate_switch or data in (None, self._bus_rates[1]))
        self._failing = self._failing or not fits
        return fits

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """A frame of the node on its way to the client; lost if the adapter is not on the bus.

        Raises
        ------
        can.CanOperationError
            If the line is full.
        """
        self._serve()
        if msg.is_error_frame:  # there is no line for it, but a flag
            self._failing = True
            return
        if not self._client or not self._is_open or not self._fits(msg):
            return
        if len(self._out) > OUTPUT_LIMIT:
            raise can.CanOperationError("the adapter's buffer is full")
        kind = ("b" if msg.bitrate_switch else "d") if msg.is_fd else "r" if msg.is_remote_frame else "t"
        length = len2dlc(len(msg.data)) if msg.is_fd else msg.dlc
        identifier = (
            f"{kind.upper()}{msg.arbitration_id:08X}" if msg.is_extended_id else f"{kind}{msg.arbitration_id:03X}"
        )
        self._out += f"{identifier}{length:X}{bytes(msg.data).hex().upper()}\r".encode()
        self._flush()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        """The next frame of the client; never waits."""
        self._serve()
        return (self._received.popleft() if self._received else None), False

    def _serve(self) -> None:
        """Talk to the client."""
        self._port.poll()
        if self._port.client != self._client:
            self._forget()
        if not self._client:
            return
        self._flush()
        if len(self._out) > OUTPUT_LIMIT:
            return  # a client that does not read its answers is not heard
        for byte in self._port.read():
            if byte != 0x0D:
                self._overlong = self._overlong or len(self._line) >= LINE_LIMIT
                if not self._overlong:
                    self._line.append(byte)
                continue
            line, overlong = bytes(self._line), self._overlong
            self._line.clear()
            self._overlong = False
            self._out += _REFUSED if overlong else self._obey(line)
        self._flush()

    def _flush(self) -> None:
        if self._out:
            del self._out[: self._port.write(memoryview(bytes(self._out)))]

    def _obey(self, line: bytes) -> bytes:
        """Do what a line asks for; the answer."""
        head, rest = line[:1], line[1:]
        if head in (b"S", b"Y") and not self._is_open and len(rest) == 1 and rest.isdigit():
            nominal, data = self._rates
            self._rates = (BITRATES[int(rest)], data) if head == b"S" else (nominal, int(rest) * 1e6)
        elif line in (b"O", b"L"):
            self._is_open, self._silent = True, line == b"L"
        elif line == b"C":
            self._is_open = False
        elif line == b"F":
            flags, self._failing = (0x80 if self._failing else 0), False
            return b"F%02X\r" % flags
        elif line in (b"V", b"v"):
            return line + b"1010\r"
        elif line == b"N":
            return b"NVIRT\r"
        elif head in b"trdbTRDB" and head:
            return self._transmit(line)
        elif line and head not in _IGNORED:
            return _REFUSED
        return _OK

    def _transmit(self, line: bytes) -> bytes:
        match = _FRAME.fullmatch(line)
        if match is None or not self._is_open or self._silent or len(self._received) >= INPUT_FRAMES:
            return _REFUSED
        kind = (match[1] or match[3]).lower()
        is_fd = kind in b"db"
        code, data = int(match[5], 16), bytes.fromhex(match[6].decode())
        length = CAN_FD_DLC[code] if is_fd else code
        if length > (64 if is_fd else 8) or len(data) != (0 if kind == b"r" else length):
            return _REFUSED
        message = can.Message(
            arbitration_id=int(match[2] or match[4], 16), is_extended_id=match[3] is not None, data=data, dlc=length,
            is_remote_frame=kind == b"r", is_fd=is_fd, bitrate_switch=kind == b"b",
        )  # fmt: skip
        if self._fits(message):
            self._received.append(message)
        return _OK

    def fileno(self) -> int:
        """The line's descriptor, -1 while there is no client."""
        return self._port.descriptors()[0]

    def shutdown(self) -> None:
        """Hang up."""
        super().shutdown()
        self._port.close()
