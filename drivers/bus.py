"""Opening a CAN bus by name, any interface of python-can."""

import contextlib
import os
import socket
import stat
import sys
from typing import Any

import can
from can.interfaces.slcan import slcanBus

from drivers.addresses import Address
from recordings.errors import InputError

RECEIVE_BUFFER_BYTES = 8 << 20
IP_MULTICAST_ALL, IPV6_MULTICAST_ALL = 49, 29
"""Linux's options of these names, which Python does not list."""


def open_bus(
    address: Address, *, bitrate: int = 1_000_000, data_bitrate: int = 5_000_000, is_fd: bool = True
) -> can.BusABC:
    """Open a bus for CAN FD, or for classic frames alone.

    Raises
    ------
    InputError
        If the interface cannot be opened.
    """
    options: dict[str, Any] = {"fd": is_fd}
    if address.interface == "slcan":
        # Adapters for CAN FD are USB devices: unlike serial ones they do not restart when their port is opened.
        options |= {"sleep_after_open": 0.1}
    elif address.interface not in ("virtual", "udp_multicast", "unixbus", "socketcan"):
        options |= {"bitrate": bitrate, "data_bitrate": data_bitrate} if is_fd else {"bitrate": bitrate}
    try:
        bus = can.Bus(channel=address.channel, interface=address.interface, **options)
        if isinstance(bus, slcanBus):
            try:
                bus.set_bitrate(bitrate, data_bitrate if is_fd else None)
            except BaseException:
                bus.shutdown()
                raise
    except (can.CanError, OSError, ValueError, TypeError, ImportError) as error:
        remedy = "is the adapter in, the interface up?"
        raise InputError(str(address), "", f"the bus cannot be opened ({error})", remedy) from error
    _widen(bus, address.interface)
    return bus


def _widen(bus: can.BusABC, interface: str) -> None:
    """Room in a socket for what comes while the program is busy, and nothing from other programs' groups."""
    # A socket's usual buffer holds a few hundred frames: too few while another thread computes.
    with contextlib.suppress(OSError, NotImplementedError):
        if not stat.S_ISSOCK(os.fstat(bus.fileno()).st_mode):
            return
    with contextlib.suppress(OSError, NotImplementedError), socket.socket(fileno=os.dup(bus.fileno())) as sock:
        if sock.family != socket.AF_UNIX:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        if interface == "udp_multicast" and sys.platform == "linux":
            # Or else this socket hears every group that any program of the machine has joined.
            if sock.family == socket.AF_INET6:
                sock.setsockopt(socket.IPPROTO_IPV6, IPV6_MULTICAST_ALL, 0)
            else:
                sock.setsockopt(socket.IPPROTO_IP, IP_MULTICAST_ALL, 0)
