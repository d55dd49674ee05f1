"""A virtual line and a virtual bus are as slow as real ones, and as deaf at the wrong rate."""

import os
import pty
import re
import subprocess
import threading
import time

import can
import numpy as np
import pytest
import serial
from needed import needs, program
from virtual_rig import PATIENCE_S, FilteredSine, served, wait_until

from drivers.can_protocol import SAMPLES_PER_FRAME, CanCommand, MessageId, Opcode
from drivers.host import open_instruments
from drivers.instruments import Instruments
from drivers.virtual import Addresses, VirtualRig, bus_time, line_speed
from drivers.virtual.bus_time import BusTime, frame_seconds
from recordings.errors import InputError


class Clock:
    """Stands for a module's `time`, and goes on when it is told to."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s


@pytest.fixture
def clock(monkeypatch):
    stopped = Clock()
    for module in (bus_time, line_speed):
        monkeypatch.setattr(module, "time", stopped)
    return stopped


class Endless:
    """A terminal that takes everything."""

    def __init__(self) -> None:
        self.descriptor, self._slave = pty.openpty()
        self.taken = 0

    def write(self, data):
        self.taken += len(data)
        return len(data)

    def close(self):
        os.close(self.descriptor)
        os.close(self._slave)


def test_a_line_takes_as_many_bytes_as_its_rate_allows(clock):
    """Ten bits each; after a rest no more at once than its buffer holds."""
    terminal = Endless()
    line = line_speed.WirePort(terminal, baud=19200, multiple=2.0)
    data = memoryview(bytes(100_000))
    for _ in range(1000):
        clock.now_s += 0.003
        line.write(data)
    assert terminal.taken == pytest.approx(3.0 * 2 * 19200 / 10, abs=2)
    assert line.throttled
    clock.now_s += 60.0
    assert line.write(data) == pytest.approx(line.BURST_S * 2 * 19200 / 10, abs=1)
    terminal.close()


def test_an_answer_takes_the_time_of_its_bits():
    """Not less than that, whatever the machine is busy with."""
    with served(FilteredSine(), serial=True, speed=1.0, baud=57600) as rig:
        assert rig.serial is not None
        with serial.Serial(rig.serial, 57600, timeout=PATIENCE_S) as line:
            line.write(b"SYST:HELP:HEAD?\n")
            began = time.monotonic()
            digits = int(line.read(2)[1:])
            size = int(line.read(digits))
            assert len(line.read(size + 1)) == size + 1
            elapsed = time.monotonic() - began
    assert elapsed > 10 * (size + 4) / 57600 - line_speed.WirePort.BURST_S


def test_at_the_wrong_rate_nobody_understands_and_the_client_says_what_to_check():
    with served(FilteredSine(), serial=True, speed=1.0, baud=115200) as rig:
        device = {"name": "daq", "address": f"serial:{rig.serial}", "generator": True}
        for baud, fits in ((9600, False), (115200, True)):
            patience = {"timeout_s": PATIENCE_S if fits else 1.0}
            instruments = Instruments.model_validate({"device": [device | {"baud": baud}], **patience})
            if fits:
                open_instruments(instruments).close()
            else:
                with pytest.raises(InputError, match="the right baud rate"):
                    open_instruments(instruments)


def test_a_stream_too_fast_for_its_line_overruns_and_says_so():
    with served(FilteredSine(rate_Hz=5120.0), serial=True, speed=40.0, baud=230400) as rig:
        device = {"name": "daq", "address": f"serial:{rig.serial}", "generator": True, "baud": 230400}
        with open_instruments(Instruments.model_validate({"device": [device]})) as acquisition:
            acquisition.start()
            kinds: set[str] = set()

            def read() -> None:
                acquisition.read(timeout_s=PATIENCE_S)
                kinds.update(event.kind for event in acquisition.take_events())

            wait_until(lambda: {"overrun", "lost-samples"} <= kinds, step=read)


def test_capacity_of_a_bus_at_1_and_5_megabits():
    samples = SAMPLES_PER_FRAME / frame_seconds(64, bitrate=1e6, data_bitrate=5e6)
    assert samples / 4 == pytest.approx(49.6e3, rel=0.02)  # four channels, as computed independently for hardware
    classic = frame_seconds(8, bitrate=1e6, data_bitrate=1e6)
    assert 64e-6 * 1.5 < classic < 64e-6 * 2.5


def test_a_limited_bus_lets_through_what_its_bit_rates_allow(clock):
    bus = BusTime(multiple=2.0)
    frames = 0
    for _ in range(100_000):
        clock.now_s += 3e-6
        if bus.is_free:
            bus.take(64)
            frames += 1
    assert frames == pytest.approx(0.6 / frame_seconds(64, bitrate=1e6, data_bitrate=5e6), abs=1)
    assert bus.take_load() == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("idle", [False, True])
def test_a_process_kept_waiting_makes_up_for_it_and_an_idle_bus_does_not(idle, clock):
    a_frame = frame_seconds(64, bitrate=1e6, data_bitrate=5e6)
    bus = BusTime(multiple=1.0)
    clock.now_s += 0.2
    if idle:
        bus.idle()
    frames = 0
    while bus.is_free:
        bus.take(64)
        frames += 1
    assert frames == pytest.approx(1 if idle else 0.2 / a_frame, abs=1)


@pytest.mark.parametrize("waits", [True, False])
def test_frames_of_others_load_the_bus_and_those_that_go_first_are_waited_for(waits, clock):
    """Another participant takes half of the bus, and this one what it gets of the rest."""
    bus = BusTime(multiple=1.0)
    a_frame = bus.frame_s(64)
    frames = 0
    for number in range(10_000):
        clock.now_s += a_frame / 10
        if number % 20 == 0:
            bus.hear(64, is_fd=True, waits=waits)
        if bus.is_free:
            bus.take(64)
            frames += 1
    assert frames == pytest.approx(500 if waits else 1000, abs=2)
    assert bus.take_load() == pytest.approx(1.0, abs=0.01)


def test_a_node_beyond_the_capacity_of_its_bus_overruns_and_says_so():
    with (
        served(FilteredSine(rate_Hz=25600.0), can_bus="virtual:slow", speed=1.0, bitrate=125e3, data_bitrate=250e3),
        can.Bus(interface="virtual", channel="slow", fd=True) as bus,
    ):
        start = CanCommand(Opcode.START).pack()
        began, overrun, came = time.monotonic(), 0, 0
        bus.send(can.Message(arbitration_id=MessageId.COMMAND, data=start, is_extended_id=False, is_fd=True))
        while time.monotonic() - began < PATIENCE_S and not overrun:
            message = bus.recv(0.1)
            if message is not None and message.arbitration_id == MessageId.STATUS:
                overrun = int.from_bytes(message.data[:4], "little")
            came += message is not None and len(message.data) == 64
        elapsed = time.monotonic() - began
    assert overrun > 0
    assert 0 < came < 1.05 * elapsed / frame_seconds(64, bitrate=125e3, data_bitrate=250e3)


@needs("socat")
def test_a_virtual_instrument_at_the_far_end_of_a_cable():
    """Two ports with a cable between them, here made by socat: it serves at one, the host has the other."""
    cable = [program("socat"), "-d", "-d", "pty,raw,echo=0", "pty,raw,echo=0"]
    source = FilteredSine()
    with subprocess.Popen(cable, stderr=subprocess.PIPE, text=True) as socat:
        assert socat.stderr is not None
        ports: list[str] = []
        while len(ports) < 2:
            line = socat.stderr.readline()
            assert line, "socat has ended"
            ports += re.findall(r"PTY is (\S+)", line)
        rig = VirtualRig(source, Addresses(serial=ports[0]))
        stop = threading.Event()
        thread = threading.Thread(target=rig.serve, args=(stop.is_set,))
        thread.start()
        try:
            device = {"name": "daq", "address": f"serial:{ports[1]}", "generator": True}
            with open_instruments(Instruments.model_validate({"device": [device]})) as acquisition:
                acquisition.start()
                blocks = [block for _ in range(8) for block in acquisition.read(timeout_s=PATIENCE_S)]
                acquisition.stop()
                assert not acquisition.take_events()
        finally:
            stop.set()
            thread.join(PATIENCE_S)
            socat.kill()
    force = np.concatenate([block.samples["force"] for block in blocks])
    assert np.array_equal(force, source.everything[0, : 8 * 240])
