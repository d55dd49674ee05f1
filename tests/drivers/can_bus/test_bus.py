"""Buses that share a machine."""

from __future__ import annotations

import can
import pytest

from drivers.addresses import parse_can
from drivers.bus import open_bus


@pytest.mark.usefixtures("multicast_alone")
def test_two_multicast_groups_do_not_hear_each_other():
    with (
        open_bus(parse_can("udp_multicast:239.74.163.21")) as one,
        open_bus(parse_can("udp_multicast:239.74.163.22")) as two,
    ):
        two.send(can.Message(arbitration_id=0x22, is_extended_id=False, is_fd=True, data=b"two"))
        one.send(can.Message(arbitration_id=0x21, is_extended_id=False, is_fd=True, data=b"one"))
        heard = [message.arbitration_id for message in iter(lambda: one.recv(0.3), None)]
        assert 0x22 not in heard
