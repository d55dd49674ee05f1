"""A CAN bus that destroys frames: sent again, counted, and too many of them drive the node off the bus for a while."""

from __future__ import annotations

import time
from types import SimpleNamespace

import can
import cantools
import numpy as np
import pytest
from test_acquisition import SINE, channel, quantised, take
from virtual_rig import PATIENCE_S, FilteredSine, served

from drivers.can_protocol import read_dbc
from drivers.host import open_instruments
from drivers.virtual import error_state
from drivers.virtual.bus_time import frame_seconds
from drivers.virtual.error_state import RESTART_S, ErrorCounter, ErrorState
from recordings.errors import InputError
from recordings.run import SampleBlock

DATABASE = cantools.database.load_string(read_dbc(), "dbc")


def test_error_counts_are_those_of_the_standard(monkeypatch):
    """Eight up, one down; passive beyond 127, off the bus beyond 255, and back with a count of zero."""
    now_s = 5.0
    monkeypatch.setattr(error_state, "time", SimpleNamespace(monotonic=lambda: now_s))
    counter = ErrorCounter()
    for _ in range(15):
        counter.fail()
    assert counter.state == ErrorState.ACTIVE
    counter.fail()
    assert counter.state == ErrorState.PASSIVE
    counter.succeed()
    assert counter.state == ErrorState.ACTIVE
    for _ in range(16):
        counter.fail()
    assert counter.state == ErrorState.PASSIVE  # 255
    counter.fail()
    assert counter.state == ErrorState.BUS_OFF
    now_s += RESTART_S
    assert counter.state == ErrorState.ACTIVE
    assert counter.take_worst() == ErrorState.BUS_OFF  # what nobody could be told meanwhile
    assert counter.take_worst() == ErrorState.ACTIVE


def right(blocks: list[SampleBlock], source: FilteredSine) -> bool:
    sent = quantised(source.everything[2], 490.0)
    return all(
        np.array_equal(block.samples["acc2"], sent[block.first_index : block.first_index + len(block)])
        for block in blocks
        if block.device == "can"
    )


def test_a_little_noise_costs_no_sample_and_is_told(tmp_path):
    faults = ["noise:device=can,probability=0.05,at_s=0"]
    with (
        served(FilteredSine(), serial=True, can_bus=f"unixbus:{tmp_path}/bus", faults=faults) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        acquisition.set_output(SINE)
        blocks = take(acquisition, 40)
        acquisition.stop()
        events = list(acquisition.take_events())
    assert {event.kind for event in events} == {"bus-error"}
    assert sum(int(event.detail.split()[0]) for event in events) > 5
    assert len(channel(blocks, "acc2")) == 40 * 240
    assert right(blocks, rig.source)


def test_heavy_noise_drives_the_node_off_the_bus_and_it_comes_back(tmp_path):
    """What was lost meanwhile is counted, what came is right, and after the noise all is well again."""
    faults = ["noise:device=can,probability=0.9,at_s=1,seconds=2"]
    with (
        served(FilteredSine(), serial=True, can_bus=f"unixbus:{tmp_path}/bus", faults=faults, speed=1.0) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        blocks: list[SampleBlock] = []
        events: list = []
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until and not (
            "bus-off" in {event.kind for event in events} and blocks[-1].time_ns > 5_000_000_000
        ):
            blocks += acquisition.read(timeout_s=PATIENCE_S)
            events += acquisition.take_events()
        late = take(acquisition, 4)
        acquisition.stop()
        events += acquisition.take_events()
    kinds = {event.kind for event in events}
    assert {"bus-error", "bus-off"} <= kinds
    blocks += late
    assert right(blocks, rig.source)
    assert [block.device for block in late].count("can") == 4
    tip = [block for block in blocks if block.device == "can"]
    lost = sum(int(e.detail.split()[0]) for e in events if e.kind == "lost-samples" and e.source == "can")
    assert sum(len(block) for block in tip) + lost == tip[-1].first_index + len(tip[-1])


def test_the_heartbeat_tells_the_load_of_the_bus():
    rates = {"bitrate": 500e3, "data_bitrate": 1e6}
    with (
        served(FilteredSine(rate_Hz=25600.0), can_bus="virtual:loaded", speed=1.0, **rates),
        can.Bus(interface="virtual", channel="loaded", fd=True) as bus,
    ):

        def next_load() -> float:
            message = bus.recv(PATIENCE_S)
            while message is not None and message.arbitration_id != 0x180:
                message = bus.recv(PATIENCE_S)
            assert message is not None
            return DATABASE.decode_message(0x180, bytes(message.data))["BusLoad"]

        assert next_load() < 5
        data = DATABASE.encode_message("Command", {"Opcode": "START", "Value": 0.0})
        bus.send(can.Message(arbitration_id=0x200, data=data, is_extended_id=False, is_fd=True))
        next_load()  # which has a part from before the start
        assert next_load() > 50


@pytest.mark.nightly
@pytest.mark.parametrize(("identifier", "waits"), [(0x010, True), (0x7F0, False)], ids=["urgent", "not-urgent"])
def test_frames_of_others_load_the_bus_and_the_smaller_identifier_goes_first(identifier, waits):
    """Another participant takes seven tenths of a bus of which the node needs half."""
    rates = {"bitrate": 125e3, "data_bitrate": 250e3}
    foreign_s = frame_seconds(64, bitrate=125e3, data_bitrate=250e3)
    with (
        served(FilteredSine(rate_Hz=2048.0), can_bus="virtual:shared", speed=1.0, **rates),
        can.Bus(interface="virtual", channel="shared", fd=True) as bus,
    ):
        data = DATABASE.encode_message("Command", {"Opcode": "START", "Value": 0.0})
        bus.send(can.Message(arbitration_id=0x200, data=data, is_extended_id=False, is_fd=True))
        other = can.Message(arbitration_id=identifier, data=bytes(64), is_extended_id=False, is_fd=True)
        began, sent, samples, loads = time.monotonic(), 0, 0, []
        while (elapsed := time.monotonic() - began) < 4.5:
            while sent * foreign_s < 0.7 * elapsed:
                bus.send(other)
                sent += 1
            message = bus.recv(0.005)
            if message is not None and elapsed > 2 and 0x100 <= message.arbitration_id < 0x104:
                samples += 1
            if message is not None and message.arbitration_id == 0x180:
                loads.append(DATABASE.decode_message(0x180, bytes(message.data))["BusLoad"])
    assert loads[-1] > 90
    of_its_own = samples * foreign_s / (elapsed - 2)
    assert of_its_own == pytest.approx(0.3 if waits else 3 * 2048 / 30 * foreign_s, rel=0.25)


def test_a_bus_that_cannot_carry_it_is_told_by_its_load(tmp_path):
    rates = {"bitrate": 125e3, "data_bitrate": 250e3}
    with (
        served(FilteredSine(rate_Hz=25600.0), tcp=True, can_bus=f"unixbus:{tmp_path}/bus", speed=1.0, **rates) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        events: list = []
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until and "bus-load" not in {event.kind for event in events}:
            acquisition.read(timeout_s=PATIENCE_S)
            events += acquisition.take_events()
        acquisition.stop()
    assert "bus-load" in {event.kind for event in events}


def test_noise_is_of_a_bus_alone():
    with (
        pytest.raises(InputError, match="only a CAN bus"),
        served(FilteredSine(), tcp=True, faults=["noise:device=daq"]),
    ):
        pass
