"""Opening a CAN FD bus by name, any interface of python-can."""

from __future__ import annotations

import contextlib
import os
import socket
from typing import Any

import can

from drivers.addresses import Address
from recordings.errors import InputError

__all__ = ["open_bus"]

RECEIVE_BUFFER_BYTES = 8 << 20


def open_bus(address: Address, *, bitrate: int = 1_000_000, data_bitrate: int = 5_000_000) -> can.BusABC:
    """Open a bus for CAN FD.

    Raises
    ------
    InputError
        If the interface cannot be opened.
    """
    options: dict[str, Any] = {"fd": True}
    if address.interface not in ("virtual", "udp_multicast", "unixbus", "socketcan"):
        options |= {"bitrate": bitrate, "data_bitrate": data_bitrate}
    try:
        bus = can.Bus(channel=address.channel, interface=address.interface, **options)
    except (can.CanError, OSError, ValueError, TypeError, ImportError) as error:
        raise InputError(str(address), "", f"the bus cannot be opened ({error})") from error
    # A socket's usual buffer holds a few hundred frames: too few while another thread computes.
    with contextlib.suppress(OSError, NotImplementedError), socket.socket(fileno=os.dup(bus.fileno())) as sock:
        if sock.family != socket.AF_UNIX:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
    return bus
