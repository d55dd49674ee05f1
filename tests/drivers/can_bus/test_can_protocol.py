"""The node's layouts against the shipped database, read by cantools."""

import struct

import cantools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.can_protocol import (
    SAMPLE_FRAME,
    CanCommand,
    ChannelInfo,
    Heartbeat,
    MessageId,
    Reply,
    Status,
    TimeSync,
    frame_sizes,
    read_dbc,
)
from recordings.quantities import QUANTITIES, quantity_of_code
from recordings.run import Channel

DATABASE = cantools.database.load_string(read_dbc(), "dbc")
U32 = st.integers(0, 2**32 - 1)


def decode(identifier: int, data: bytes) -> dict:
    return DATABASE.decode_message(identifier, data, decode_choices=False)


def test_every_message_is_known_and_in_its_kind_of_frame():
    every_fd = {message.frame_id for message in DATABASE.messages if message.is_fd}
    classic = {message.frame_id for message in DATABASE.messages if not message.is_fd}
    fd = {*MessageId, 0x101, 0x102, 0x103}
    assert every_fd == fd | {16 + identifier for identifier in fd}
    first = {8 + identifier for identifier in fd} | {0x089}
    assert classic == first | {16 + identifier for identifier in first}
    assert max(message.length for message in DATABASE.messages if not message.is_fd) == 8


def test_a_second_nodes_messages_are_the_first_ones_moved():
    for message in DATABASE.messages:
        if message.name.startswith("Second"):
            first = DATABASE.get_message_by_frame_id(message.frame_id - 16)
            assert message.name == f"Second{first.name}"
            for one, other in zip(first.signals, message.signals, strict=True):
                for what in ("name", "start", "length", "is_float", "is_signed", "scale", "choices", "unit"):
                    assert getattr(one, what) == getattr(other, what)


@given(U32, st.integers(-(2**63), 2**63 - 1), U32, st.floats(1, 1e6))
def test_time_sync(counter, time_ns, pulse, rate):
    sync = TimeSync(counter, time_ns, pulse, rate)
    assert decode(0x080, sync.pack()) == {"Counter": counter, "TimeNs": time_ns, "Pulse": pulse, "SampleRate": rate}
    assert TimeSync.unpack(sync.pack()) == sync


@given(U32, st.tuples(U32, U32, U32, U32))
def test_status(overrun, overload):
    fields = decode(0x181, Status(overrun, overload).pack())
    assert fields == {"Overrun": overrun} | {f"Overload{k}": count for k, count in enumerate(overload)}


def test_heartbeat_command_and_reply():
    assert decode(0x180, Heartbeat(2, 3, 70_000, 1, 42).pack()) == {
        "State": 2, "Channels": 3, "UptimeMs": 70_000, "ErrorState": 1, "BusLoad": 42,
    }  # fmt: skip
    assert Heartbeat.unpack(Heartbeat(2, 3, 70_000, 1, 42).pack()) == Heartbeat(2, 3, 70_000, 1, 42)
    assert decode(0x200, CanCommand(4, 1024.5).pack()) == {"Opcode": 4, "Value": 1024.5}
    assert decode(0x201, Reply(4, 1, 512.0).pack()) == {
        "Opcode": 4, "Result": 1, "Decimation": 1, "SampleRate": 512.0,
    }  # fmt: skip


def test_channel_info():
    channel = Channel(
        name="acceleration-at-the-tip",
        quantity="acceleration",
        unit="m/s^2",
        position_m=0.42,
        direction="-y",
        range=490.0,
    )
    data = ChannelInfo(1, 2, channel).pack()
    fields = decode(0x182, data)
    assert (fields["Channel"], fields["Channels"], fields["Direction"]) == (1, 2, -1)
    assert quantity_of_code(fields["Quantity"]) == "acceleration"
    assert fields["Range"] == 490.0
    assert fields["Position"] == pytest.approx(0.42)
    name = b"".join(fields[f"Name{k}"].to_bytes(8, "little") for k in range(3))
    assert name.rstrip(b"\0") == b"acceleration-at-the-tip"
    assert ChannelInfo.unpack(data).channel == channel


@pytest.mark.parametrize(
    ("direction", "code", "across"),
    [
        ("+y", 1, (0, 0)), ("-x", -2, (0, 0)), ("+z", 3, (0, 0)), ("0.6,-0.8,0", -1, (0.6, 0)),
        ("0.6,0,0.8", 3, (0.6, 0)), ("-0.7071,0.7071,0", -2, (0.7071, 0)),
    ],
)  # fmt: skip
def test_a_direction_goes_over_the_bus(direction, code, across):
    data = ChannelInfo(0, 1, Channel(name="acc", quantity="acceleration", unit="m/s^2", direction=direction, range=1.0))
    fields = decode(0x182, data.pack())
    assert fields["Direction"] == code
    assert np.frombuffer(data.pack()[44:], "<i2") / 30000 == pytest.approx(across, abs=2e-5)
    assert ChannelInfo.unpack(data.pack()).channel.direction == direction


def test_the_database_names_every_quantity_of_the_table():
    signal = DATABASE.get_message_by_frame_id(MessageId.CHANNEL_INFO).get_signal_by_name("Quantity")
    assert {code: str(name) for code, name in signal.choices.items() if code < 255} == {
        one.code: one.name for one in QUANTITIES
    }


@pytest.mark.parametrize("channel", range(4))
def test_samples_are_fractions_of_the_range(channel):
    frame = np.zeros(1, SAMPLE_FRAME)
    frame["counter"] = 2**32 - 30
    frame["samples"] = np.linspace(-32767, 32767, 30).astype(np.int16)
    fields = decode(MessageId.SAMPLES + channel, frame.tobytes())
    assert fields["Counter"] == 2**32 - 30
    assert [fields[f"S{k:02d}"] for k in range(30)] == pytest.approx(list(frame["samples"][0] / 32767))


@given(st.integers(0, 500))
def test_any_rest_fits_into_lengths_that_can_fd_has(count):
    sizes = frame_sizes(count)
    assert sum(sizes) == count
    assert all(4 + 2 * size in (6, 8, 12, 16, 20, 24, 32, 48, 64) for size in sizes)


@given(st.binary(max_size=64))
def test_rubbish_is_refused_by_its_length_or_its_sense(data):
    for message in (TimeSync, Heartbeat, Status, CanCommand, Reply, ChannelInfo):
        try:
            message.unpack(data)
        except (ValueError, struct.error):
            continue
