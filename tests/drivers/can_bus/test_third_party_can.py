"""The CAN node as other people's programs see it: python-can's logger, cantools and the shipped database."""

import subprocess
import sys
import time
from pathlib import Path

import can
import cantools
import numpy as np
import pytest
from virtual_rig import PATIENCE_S, FilteredSine, served, wait_until, wait_until_asleep

from drivers.can_dialect import ClassicDialect, FdDialect
from drivers.can_protocol import Reply, TimeSync, read_dbc
from drivers.host import CanClient, open_instruments
from drivers.host.device import Mailbox
from drivers.instruments import DeviceSettings
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
                    acquisition.read(timeout_s=PATIENCE_S)
                acquisition.stop()
            wait_until_asleep(logger)
            logger.send_signal(2)
            logger.stdout.read()
            assert logger.wait(PATIENCE_S) == 0
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


def slowed(log: Path) -> tuple[list[can.Message], int]:
    """A log in which a host has time before each answer; and how many full sample frames come before it says stop."""
    messages = list(can.BLFReader(log))
    stop = max(k for k, message in enumerate(messages) if message.arbitration_id == 0x200)
    wait_s = 0.0
    for k, message in enumerate(messages):
        if message.arbitration_id in (0x182, 0x201):
            wait_s += 3.0 if k > stop else 0.5
        message.timestamp += wait_s
    return messages, sum(message.arbitration_id == 0x100 for message in messages[:stop])


def test_can_player_replays_a_log_into_the_host(tmp_path):
    """What another program has logged, and another one plays, is to the host the node itself."""
    bus, log, again = tmp_path / "bus", tmp_path / "run.blf", tmp_path / "slowed.blf"
    record = [sys.executable, "-m", "can.logger", "-i", "unixbus", "-c", str(bus), "--fd", "-f", str(log)]
    with served(FilteredSine(), tcp=True, can_bus=f"unixbus:{bus}") as rig:
        with subprocess.Popen(record, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as logger:
            assert logger.stdout is not None
            next(line for line in logger.stdout if b"Can Logger" in line)
            with open_instruments(rig.instruments()) as acquisition:
                acquisition.start()
                acquisition.set_output(Excitation(kind="sine", amplitude_V=1.0, frequency_Hz=30.0))
                for _ in range(8):
                    acquisition.read(timeout_s=PATIENCE_S)
                acquisition.stop()
            wait_until_asleep(logger)
            logger.send_signal(2)
            logger.stdout.read()
        sent = rig.source.everything[2]
    messages, frames = slowed(log)
    writer = can.BLFWriter(again)
    for message in messages:
        writer.on_message_received(message)
    writer.stop()
    second = tmp_path / "second"
    play = [sys.executable, "-m", "can.player", "-i", "unixbus", "-c", str(second), "--fd", str(again)]
    settings = DeviceSettings(name="can", address=f"can:unixbus:{second}")
    mailbox = Mailbox()
    with can.Bus(interface="unixbus", channel=str(second), fd=True) as hub, can.Notifier(hub, []):
        player = subprocess.Popen(play, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            client = CanClient(settings, mailbox, timeout_s=PATIENCE_S, silence_s=PATIENCE_S)
            client.start(block_length=240)
            wait_until(lambda: client.inbox.samples.high >= 30 * frames)
            client.stop()
            client.close()
        finally:
            player.kill()
            player.wait()
    assert [channel.name for channel in client.channels] == ["acc2"]
    assert not mailbox.take_events()
    ((piece, _),) = client.inbox.take(30 * frames)
    assert piece.values is not None
    assert piece.count == 30 * frames >= 8 * 240
    steps = np.rint(sent[: piece.count] * (32767 / 490.0)).astype(np.float32)
    assert np.array_equal(piece.values[0], steps * np.float32(490.0 / 32767))


def test_cantools_decodes_a_dumped_log(tmp_path):
    """`cantools decode` with the shipped database, on lines as candump writes them."""
    database = tmp_path / "rig.dbc"
    database.write_text(read_dbc())
    frames = [*FdDialect().encode(TimeSync(3, 2_929_688, 0, 1024.0)), *ClassicDialect().encode(Reply(2, 0, 25600.0, 8))]
    lines = "".join(
        f"  can0  {identifier:03X}   [{len(data):02d}]  {data.hex(' ').upper()}\n" for identifier, data in frames
    )
    command = [sys.executable, "-m", "cantools", "decode", "--single-line", str(database)]
    done = subprocess.run(command, input=lines, capture_output=True, text=True, timeout=300, check=True)
    for words in (
        "TimeSync(",
        "Counter: 3",
        "TimeNs: 2929688 ns",
        "SampleRate: 1024.0 Hz",
        "ClassicReply(",
        "Decimation: 8",
    ):
        assert words in done.stdout


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
            deadline = time.monotonic() + PATIENCE_S
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
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            message = bus.recv(0.5)
            if message is not None and message.arbitration_id == 0x182 and message.data[0] == 1:
                return
        raise AssertionError("the node does not answer any more")
