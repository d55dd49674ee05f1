"""Where an instrument is: ``serial:/dev/ttyUSB0``, ``tcp:192.168.0.5:5025``, ``can:socketcan:can0``."""

from dataclasses import dataclass
from typing import Literal

import can


@dataclass(frozen=True)
class Address:
    """A parsed address; `host` and `port` for TCP, `interface` and `channel` for CAN, `path` for serial."""

    kind: Literal["serial", "tcp", "can"]
    path: str = ""
    host: str = ""
    port: int = 0
    interface: str = ""
    channel: str = ""

    def __str__(self) -> str:
        if self.kind == "serial":
            return f"serial:{self.path}"
        if self.kind == "tcp":
            return f"tcp:{self.host}:{self.port}"
        return f"can:{self.interface}:{self.channel}"


def parse_address(text: str) -> Address:
    """Read an address; raises ValueError with what is wrong."""
    kind, separator, rest = text.partition(":")
    if kind == "serial" and rest:
        return Address("serial", path=rest)
    if kind == "tcp" and rest:
        return parse_tcp(rest)
    if kind == "can" and rest:
        return parse_can(rest)
    if text.startswith("/") or (text.upper().startswith("COM") and not separator):
        return Address("serial", path=text)
    raise ValueError(
        f"not an address: {text[:60]!r}; write serial:/dev/ttyUSB0, tcp:HOST:PORT or can:INTERFACE:CHANNEL"
    )


def parse_tcp(text: str) -> Address:
    """Read ``HOST:PORT``."""
    host, _, port = text.rpartition(":")
    if not host or not port.isascii() or not port.isdigit() or int(port) > 65535:
        raise ValueError(f"not HOST:PORT: {text[:60]!r}")
    return Address("tcp", host=host.strip("[]"), port=int(port))


def parse_can(text: str) -> Address:
    """Read ``INTERFACE:CHANNEL``, any interface of python-can."""
    interface, _, channel = text.partition(":")
    if interface not in can.VALID_INTERFACES:
        raise ValueError(f"no CAN interface {interface[:30]!r}; one of {', '.join(sorted(can.VALID_INTERFACES))}")
    if not channel:
        raise ValueError(f"not INTERFACE:CHANNEL: {text[:60]!r}")
    return Address("can", interface=interface, channel=channel)
