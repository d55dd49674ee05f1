"""The node behind a serial CAN adapter: python-can's own slcan driver is the client, raw bytes try the rest."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager

import can
import cantools
import numpy as np
import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st
from virtual_rig import PATIENCE_S, FilteredSine, Served, served, wait_until

from drivers.addresses import parse_can
from drivers.bus import open_bus
from drivers.can_protocol import read_dbc
from drivers.host import open_instruments
from drivers.instruments import Instruments
from drivers.virtual.ports import PtyPort
from drivers.virtual.slcan import INPUT_FRAMES, OUTPUT_LIMIT, SlcanAdapter
from recordings.errors import InputError

DATABASE = cantools.database.load_string(read_dbc(), "dbc")
START = DATABASE.encode_message("Command", {"Opcode": "START", "Value": 0.0})


def node_command(data: bytes) -> can.Message:
    return can.Message(arbitration_id=0x200, data=data, is_extended_id=False, is_fd=True, bitrate_switch=True)


@contextmanager
def python_can(address: str, *, bitrate: int = 1_000_000, data_bitrate: int | None = 5_000_000) -> Iterator[can.BusABC]:
    with can.Bus(interface="slcan", channel=address.partition(":")[2], sleep_after_open=0, bitrate=bitrate) as bus:
        if data_bitrate is not None:
            bus.set_bitrate(bitrate, data_bitrate)
        yield bus


def hear(bus: can.BusABC, seconds: float) -> list[can.Message]:
    heard, until = [], time.monotonic() + seconds
    while time.monotonic() < until:
        message = bus.recv(0.05)
        if message is not None:
            heard.append(message)
    return heard


@pytest.mark.parametrize("data_bitrate", [5_000_000, None], ids=["set", "never-set"])
def test_python_can_and_cantools_run_the_node_through_the_adapter(data_bitrate: int | None) -> None:
    source = FilteredSine()
    with (
        served(source, can_bus="slcan:auto", can_channels=("force",), speed=2.0) as rig,
        python_can(str(rig.can), data_bitrate=data_bitrate) as bus,
    ):
        bus.send(node_command(START))
        values: dict[int, float] = {}

        def hear_one() -> None:
            message = bus.recv(PATIENCE_S)
            assert message is not None
            fields = DATABASE.decode_message(message.arbitration_id, bytes(message.data), allow_truncated=True)
            if message.arbitration_id == 0x100:
                assert message.is_fd
                assert message.bitrate_switch
                values.update({fields["Counter"] + k: 50.0 * fields[f"S{k:02d}"] for k in range(30)})

        wait_until(lambda: len(values) > 1000, step=hear_one)
    numbers = np.array(sorted(values))
    assert np.array_equal(numbers, np.arange(len(numbers)))
    sent = source.everything[0, : len(numbers)]
    assert np.abs(np.array([values[n] for n in numbers]) - sent).max() <= 50.0 / 32767 / 2 * 1.001


@pytest.mark.parametrize(
    ("bitrate", "data_bitrate"), [(500_000, 5_000_000), (1_000_000, 2_000_000)], ids=["arbitration", "data"]
)
def test_at_a_wrong_rate_nothing_comes_through_and_the_adapter_says_so(bitrate: int, data_bitrate: int) -> None:
    with served(FilteredSine(), can_bus="slcan:auto", speed=1.0) as rig:
        path = str(rig.can).partition(":")[2]
        with python_can(str(rig.can), bitrate=bitrate, data_bitrate=data_bitrate) as bus:
            bus.send(node_command(START))
            assert hear(bus, 0.5) == []
        with serial.Serial(path, timeout=PATIENCE_S) as line:
            line.write(b"S6\rO\rt2000\rF\rF\r")
            assert line.read_until(b"F00\r").endswith(b"F80\rF00\r")
        with pytest.raises(InputError, match="bit rate right"):
            open_instruments(instruments_of(rig, bitrate, data_bitrate))


def instruments_of(rig: Served, bitrate: int, data_bitrate: int) -> Instruments:
    node = {"name": "can", "address": f"can:{rig.can}", "bitrate": bitrate, "data_bitrate": data_bitrate}
    nowhere = {"name": "daq", "address": "tcp:127.0.0.1:9", "generator": True}  # not asked before the node
    return Instruments.model_validate({"device": [node, nowhere]})


def test_a_rate_that_the_adapter_does_not_have_is_an_input_error() -> None:
    port = PtyPort()
    try:
        with pytest.raises(InputError, match="bitrate"):
            open_bus(parse_can(f"slcan:{port.address}"), bitrate=333_333)
    finally:
        port.close()


@contextmanager
def adapter() -> Iterator[tuple[SlcanAdapter, serial.Serial]]:
    device = SlcanAdapter(PtyPort(), bitrate=1e6, data_bitrate=5e6)
    with serial.Serial(device.address, timeout=1) as line:
        try:
            yield device, line
        finally:
            device.shutdown()


def ask(device: SlcanAdapter, line: serial.Serial, text: bytes, size: int) -> bytes:
    """The answer, of so many bytes; a terminal passes them on when the system gets round to it."""
    line.write(text)
    answer = b""

    def serve() -> None:
        nonlocal answer
        device._serve()
        answer += line.read(line.in_waiting)
        time.sleep(0.002)

    wait_until(lambda: len(answer) >= size, step=serve)
    return answer


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        (b"V\rN\r", b"V1010\rNVIRT\r"),
        (b"t1230\r", b"\a"),  # not on the bus yet
        (b"S8\rO\rt1232AABB\r", b"\r\r\r"),
        (b"S8\rO\rS6\r", b"\r\r\a"),  # rates change while off the bus
        (b"S8\rL\rt1230\r", b"\r\r\a"),  # listen only
        (b"O\rt1239000000000000000000\r", b"\r\a"),  # nine bytes in a classic frame
        (b"O\rt1232AA\r", b"\r\a"),  # fewer bytes than told
        (b"O\rt9232AABB\r", b"\r\a"),  # more than 11 bits
        (b"O\rbXYZ0\r", b"\r\a"),
        (b"P\r", b"\a"),
        (b"x" * 5000 + b"\rV\r", b"\aV1010\r"),
        (b"\r", b"\r"),
    ],
)
def test_answers_to_raw_lines(text: bytes, answer: bytes) -> None:
    with adapter() as (device, line):
        assert ask(device, line, text, len(answer)) == answer


def test_frames_of_every_kind_reach_the_bus() -> None:
    with adapter() as (device, line):
        ask(
            device,
            line,
            b"S8\rO\rt7FF3010203\rT1FFFFFFF10A\rr1000\rd1009" + b"0A" * 12 + b"\rB00000100F" + b"0B" * 64 + b"\r",
            7,
        )
        frames = [device.recv(0) for _ in range(5)]
        assert device.recv(0) is None
    seen = [
        (f.arbitration_id, f.is_extended_id, f.is_remote_frame, f.is_fd, f.bitrate_switch, len(f.data))
        for f in frames
        if f
    ]
    assert seen == [
        (0x7FF, False, False, False, False, 3), (0x1FFFFFFF, True, False, False, False, 1),
        (0x100, False, True, False, False, 0), (0x100, False, False, True, False, 12),
        (0x100, True, False, True, True, 64),
    ]  # fmt: skip


def test_a_client_that_does_not_read_costs_bounded_memory_and_is_told_to_the_node() -> None:
    with adapter() as (device, line):
        ask(device, line, b"S8\rO\r", 2)
        message = can.Message(
            arbitration_id=0x100, data=bytes(64), is_extended_id=False, is_fd=True, bitrate_switch=True
        )
        sent = 0
        with contextlib.suppress(can.CanOperationError):
            for sent in range(10_000):  # noqa: B007
                device.send(message)
        assert 100 < sent < 1000
        assert len(device._out) < OUTPUT_LIMIT + 200
        line.write(b"V\r" * 2000)
        for _ in range(100):
            device._serve()
        assert len(device._out) < OUTPUT_LIMIT + 20_000


def test_after_a_client_has_left_the_next_one_finds_the_adapter_fresh() -> None:
    device = SlcanAdapter(PtyPort(), bitrate=1e6, data_bitrate=5e6)
    with serial.Serial(device.address, timeout=1) as line:
        assert ask(device, line, b"S8\rO\rt100", 2) == b"\r\r"

    def told() -> bool:
        """Whether the adapter knows that nobody is there."""
        device._serve()
        return not device._port.client

    wait_until(told)
    with serial.Serial(device.address, timeout=1) as line:
        assert ask(device, line, b"0\rt1000\r", 2) == b"\a\a"
    device.shutdown()


@given(
    st.lists(
        st.one_of(st.binary(max_size=60), st.sampled_from([b"S8\r", b"O\r", b"C\r", b"b10", b"t12", b"\r"])),
        max_size=30,
    )
)
def test_rubbish_lines_are_refused_never_worse(pieces: list[bytes]) -> None:
    device = SlcanAdapter(PtyPort(), bitrate=1e6, data_bitrate=5e6)
    descriptor = os.open(device.address, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        for piece in pieces:
            os.write(descriptor, piece)
            device._serve()
            assert len(device._line) <= 160
            assert len(device._received) <= INPUT_FRAMES
    finally:
        os.close(descriptor)
        device.shutdown()
