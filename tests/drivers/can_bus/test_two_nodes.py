"""Two nodes on one bus, a force node and an acceleration node, beside a line with the generator."""

from __future__ import annotations

import time

import can
import cantools
import numpy as np
import pytest
from test_acquisition import SINE, channel, quantised, take
from virtual_rig import PATIENCE_S, FilteredSine, served

from drivers.can_protocol import read_dbc
from drivers.host import open_instruments
from drivers.instruments import Instruments
from recordings.errors import InputError

DATABASE = cantools.database.load_string(read_dbc(), "dbc")
NODES = {"can_channels": ("force",), "second_can_channels": ("acc2",)}


@pytest.mark.parametrize("frames", ["fd", "classic"])
@pytest.mark.parametrize("interface", ["unixbus", "virtual", "udp_multicast"])
def test_both_are_heard_apart_and_line_up(interface, frames, request, tmp_path):
    if interface == "udp_multicast":
        request.getfixturevalue("multicast_alone")
    where = {"virtual": f"two-{frames}", "udp_multicast": "239.74.163.17"}.get(interface, f"{tmp_path}/bus")
    address = f"{interface}:{where}"
    with served(FilteredSine(), tcp=True, can_bus=address, can_frames=frames, **NODES) as rig:
        devices = [
            {"name": "daq", "address": f"tcp:{rig.tcp}", "generator": True},
            {"name": "can", "address": f"can:{address}", "frames": frames},
            {"name": "can2", "address": f"can:{address}", "frames": frames, "node": 1},
        ]
        with open_instruments(Instruments.model_validate({"device": devices})) as acquisition:
            assert {each.name: each.device for each in acquisition.channels} == {
                "acc1": "daq", "force": "can", "acc2": "can2",
            }  # fmt: skip
            acquisition.start()
            acquisition.set_output(SINE)
            blocks = take(acquisition, 12)
            acquisition.stop()
            assert not acquisition.take_events()
    sent = rig.source.everything[:, : 12 * 240]
    assert np.array_equal(channel(blocks, "acc1"), sent[1])
    assert np.array_equal(channel(blocks, "force"), quantised(sent[0], 50.0))
    assert np.array_equal(channel(blocks, "acc2"), quantised(sent[2], 490.0))
    assert len({(block.first_index, block.time_ns) for block in blocks}) == 12


def test_each_obeys_its_own_commands_alone():
    with (
        served(FilteredSine(), tcp=True, can_bus="virtual:apart", speed=1.0, **NODES),
        can.Bus(interface="virtual", channel="apart", fd=True) as bus,
    ):
        data = DATABASE.encode_message("SecondCommand", {"Opcode": "START", "Value": 0.0})
        bus.send(can.Message(arbitration_id=0x210, data=data, is_extended_id=False, is_fd=True))
        expected = {"Heartbeat", "SecondHeartbeat", "SecondTimeSync", "SecondSamples0", "SecondReply"}
        names, until = set(), time.monotonic() + PATIENCE_S
        while time.monotonic() < until and not expected <= names:
            message = bus.recv(0.1)
            if message is not None:
                names.add(DATABASE.get_message_by_frame_id(message.arbitration_id).name)
    assert expected <= names
    assert not {"TimeSync", "Samples0", "Reply"} & names


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"can_bus": "virtual:x", **NODES, "second_can_channels": ("force",)}, "on both nodes"),
        ({"can_bus": "virtual:x", **NODES, "second_can_channels": ("acc9",)}, "no such channel"),
        ({"can_bus": "slcan:auto", **NODES}, "one node behind it"),
    ],
)
def test_what_cannot_be_is_refused(options, words):
    with pytest.raises(InputError, match=words), served(FilteredSine(), tcp=True, **options):
        pass
