"""A virtual line and a virtual bus are as slow as real ones, and as deaf at the wrong rate."""

import re
import subprocess
import threading
import time

import can
import numpy as np
import pytest
import serial
from needed import needs
from virtual_rig import FilteredSine, served

from drivers.can_protocol import SAMPLES_PER_FRAME, Command, MessageId, Opcode
from drivers.host import open_instruments
from drivers.instruments import Instruments
from drivers.virtual import Addresses, VirtualRig
from drivers.virtual.bus_time import BusTime, frame_seconds
from recordings.errors import InputError


def test_an_answer_takes_the_time_of_its_bits():
    with served(FilteredSine(), serial=True, speed=1.0, baud=19200) as rig:
        assert rig.serial is not None
        with serial.Serial(rig.serial, 19200, timeout=10) as line:
            line.write(b"SYST:HELP:HEAD?\n")
            began = time.monotonic()
            digits = int(line.read(2)[1:])
            size = int(line.read(digits))
            assert len(line.read(size + 1)) == size + 1
            elapsed = time.monotonic() - began
    assert elapsed == pytest.approx(10 * (size + 4) / 19200, rel=0.2)


def test_at_the_wrong_rate_nobody_understands_and_the_client_says_what_to_check():
    with served(FilteredSine(), serial=True, speed=1.0, baud=115200) as rig:
        device = {"name": "daq", "address": f"serial:{rig.serial}", "generator": True}
        for baud, fits in ((9600, False), (115200, True)):
            instruments = Instruments.model_validate({"device": [device | {"baud": baud}], "timeout_s": 1.0})
            if fits:
                open_instruments(instruments).close()
            else:
                with pytest.raises(InputError, match="the right baud rate"):
                    open_instruments(instruments)


def test_a_stream_too_fast_for_its_line_overruns_and_says_so():
    with served(FilteredSine(rate_Hz=5120.0), serial=True, speed=40.0, baud=115200) as rig:
        device = {"name": "daq", "address": f"serial:{rig.serial}", "generator": True, "baud": 115200}
        with open_instruments(Instruments.model_validate({"device": [device]})) as acquisition:
            acquisition.start()
            kinds: set[str] = set()
            deadline = time.monotonic() + 20
            while not {"overrun", "lost-samples"} <= kinds and time.monotonic() < deadline:
                acquisition.read()
                kinds |= {event.kind for event in acquisition.take_events()}
    assert {"overrun", "lost-samples"} <= kinds


def test_capacity_of_a_bus_at_1_and_5_megabits():
    samples = SAMPLES_PER_FRAME / frame_seconds(64, bitrate=1e6, data_bitrate=5e6)
    assert samples / 4 == pytest.approx(49.6e3, rel=0.02)  # four channels, as computed independently for hardware
    classic = frame_seconds(8, bitrate=1e6, data_bitrate=1e6)
    assert 64e-6 * 1.5 < classic < 64e-6 * 2.5


def test_a_limited_bus_lets_through_what_its_bit_rates_allow():
    """Never more; less only while the machine does something else, which it does not do every time."""
    counts = []
    for _ in range(5):
        bus = BusTime(multiple=2.0)
        began, frames = time.monotonic(), 0
        while time.monotonic() - began < 0.3:
            if bus.is_free:
                bus.take(64)
                frames += 1
        counts.append(frames)
    assert max(counts) == pytest.approx(0.6 / frame_seconds(64, bitrate=1e6, data_bitrate=5e6), rel=0.02)


def test_a_process_kept_waiting_makes_up_for_it_and_an_idle_bus_does_not():
    a_frame = frame_seconds(64, bitrate=1e6, data_bitrate=5e6)
    for idle, expected in ((False, 0.2 / a_frame), (True, 1)):
        bus = BusTime(multiple=1.0)
        time.sleep(0.2)
        if idle:
            bus.idle()
        frames = 0
        while bus.is_free:
            bus.take(64)
            frames += 1
        assert frames == pytest.approx(expected, rel=0.2, abs=1)


def test_a_node_beyond_the_capacity_of_its_bus_overruns_and_says_so():
    with (
        served(FilteredSine(rate_Hz=25600.0), can_bus="virtual:slow", speed=1.0, bitrate=125e3, data_bitrate=250e3),
        can.Bus(interface="virtual", channel="slow", fd=True) as bus,
    ):
        start = Command(Opcode.START).pack()
        bus.send(can.Message(arbitration_id=MessageId.COMMAND, data=start, is_extended_id=False, is_fd=True))
        began, overrun = time.monotonic(), 0
        came: list[float] = []
        while time.monotonic() - began < 6.0 and not overrun:
            message = bus.recv(0.1)
            if message is not None and message.arbitration_id == MessageId.STATUS:
                overrun = int.from_bytes(message.data[:4], "little")
            came += [] if message is None else [time.monotonic() - began]
    assert overrun > 0
    # A busy machine leaves the bus idle now and then: the best second tells.
    best = max(np.searchsorted(came, start + 1.0) - k for k, start in enumerate(came))
    assert best == pytest.approx(1 / frame_seconds(64, bitrate=125e3, data_bitrate=250e3), rel=0.15)


@needs("socat")
def test_a_virtual_instrument_at_the_far_end_of_a_cable():
    """Two ports with a cable between them, here made by socat: it serves at one, the host has the other."""
    cable = ["socat", "-d", "-d", "pty,raw,echo=0", "pty,raw,echo=0"]
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
                blocks = [block for _ in range(8) for block in acquisition.read()]
                acquisition.stop()
                assert not acquisition.take_events()
        finally:
            stop.set()
            thread.join(10)
            socat.kill()
    force = np.concatenate([block.samples["force"] for block in blocks])
    assert np.array_equal(force, source.everything[0, : 8 * 240])
