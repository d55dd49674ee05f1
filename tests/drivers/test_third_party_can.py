"""The CAN node as other people's programs see it: python-can's logger, cantools and the shipped database."""

import subprocess
import sys
import time

import can
import cantools
import numpy as np
import pytest
from virtual_rig import FilteredSine, served

from drivers.can_protocol import read_dbc
from drivers.host import open_instruments
from recordings.streams import Excitation

DATABASE = cantools.database.load_string(read_dbc(), "dbc")


@pytest.mark.usefixtures("multicast_alone")
@pytest.mark.parametrize("interface", ["unixbus", "udp_multicast"])
def test_can_logger_records_the_node_and_cantools_decodes_it(interface, tmp_path):
    channel = str(tmp_path / "bus") if interface == "unixbus" else "239.74.163.9"
    log = tmp_path / "run.blf"
    command = [sys.executable, "-m", "can.logger", "-i", interface, "-c", channel, "--fd", "-f", str(log)]
    with served(FilteredSine(), tcp=True, can_bus=f"{interface}:{channel}") as rig:
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as logger:
            assert logger.stdout is not None
            for line in logger.stdout:
                if b"Can Logger" in line:
                    break
            with open_instruments(rig.instruments()) as acquisition:
                acquisition.start()
                acquisition.set_output(Excitation(kind="sine", amplitude_V=1.0, frequency_Hz=30.0))
                for _ in range(10):
                    acquisition.read()
                acquisition.stop()
            time.sleep(0.3)
            logger.send_signal(2)
            logger.stdout.read()
            assert logger.wait(10) == 0
        sent = rig.source.everything[2]
    values, limits = {}, set()
    for message in can.BLFReader(log):
        fields = DATABASE.decode_message(message.arbitration_id, bytes(message.data), allow_truncated=True)
        name = DATABASE.get_message_by_frame_id(message.arbitration_id).name
        if name == "Samples0":
            for k in range((len(message.data) - 4) // 2):
                values[fields["Counter"] + k] = fields[f"S{k:02d}"]
        if name == "ChannelInfo":
            limits.add(fields["Range"])
        if name == "TimeSync":
            assert fields["TimeNs"] == pytest.approx(fields["Counter"] * 1e9 / 1024.0, abs=1)
    assert limits == {490.0}
    assert sorted(values) == list(range(len(values)))
    assert len(values) >= 2400
    decoded = 490.0 * np.array([values[k] for k in range(len(values))])
    assert np.max(np.abs(decoded - sent[: len(decoded)])) <= 490.0 / 32767 / 2 * 1.001


def test_any_program_can_run_the_node_with_the_database_alone():
    """Start, samples, stop, and a rest in a shorter frame, with messages encoded by cantools."""
    with (
        served(FilteredSine(), can_bus="virtual:alone", speed=1.0),
        can.Bus(interface="virtual", channel="alone", fd=True) as bus,
    ):

        def command(opcode: str, value: float = 0.0) -> None:
            data = DATABASE.encode_message("Command", {"Opcode": opcode, "Value": value})
            bus.send(can.Message(arbitration_id=0x200, data=data, is_extended_id=False, is_fd=True))

        def wait_for(name: str) -> dict:
            deadline = time.monotonic() + 5
            while time.monotonic() < deadline:
                message = bus.recv(0.5)
                if message and DATABASE.get_message_by_frame_id(message.arbitration_id).name == name:
                    return DATABASE.decode_message(message.arbitration_id, bytes(message.data), allow_truncated=True)
            raise AssertionError(f"no {name}")

        assert wait_for("Heartbeat")["State"] == "IDLE"
        command("SET_RATE", 2000.0)
        assert wait_for("Reply") == {"Opcode": "SET_RATE", "Result": "DONE", "Decimation": 1, "SampleRate": 2048.0}
        command("START")
        assert wait_for("TimeSync")["Counter"] == 0
        assert wait_for("Samples2")["Counter"] == 0  # alone on the bus, the node carries all channels
        command("SET_RATE", 512.0)
        assert wait_for("Reply")["Result"] == "REFUSED"
        command("STOP")
        assert wait_for("Reply")["Opcode"] == "STOP"


def test_rubbish_on_the_bus_does_not_stop_the_node():
    with (
        served(FilteredSine(), can_bus="virtual:noisy", speed=1.0),
        can.Bus(interface="virtual", channel="noisy", fd=True) as bus,
    ):
        generator = np.random.default_rng(5)
        for _ in range(300):
            data = generator.bytes(int(generator.choice([0, 1, 3, 7, 8, 12, 64])))
            identifier = int(generator.choice([0x200, 0x100, int(generator.integers(2048))]))
            bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False, is_fd=True))
        data = DATABASE.encode_message("Command", {"Opcode": "DESCRIBE", "Value": 1})
        bus.send(can.Message(arbitration_id=0x200, data=data, is_extended_id=False, is_fd=True))
        deadline = time.monotonic() + 5
        while time.monotonic() < deadline:
            message = bus.recv(0.5)
            if message is not None and message.arbitration_id == 0x182 and message.data[0] == 1:
                return
        raise AssertionError("the node does not answer any more")
