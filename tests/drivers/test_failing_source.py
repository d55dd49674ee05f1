"""What stands behind the instruments fails in mid-run: they stay, say so in words, and the host passes it on."""

from __future__ import annotations

import socket
import threading
import time
from dataclasses import dataclass

import can
import cantools
import numpy as np
import pytest
from test_acquisition import SINE, channel, quantised, take
from virtual_rig import PATIENCE_S, FilteredSine, served

from drivers.can_protocol import read_dbc
from drivers.host import DeviceFailedError, RigAcquisition, open_instruments
from drivers.virtual import Addresses, Backing, VirtualRig
from recordings.run import SampleBlock

WHY = "the joint's equations had no solution in 3 of 240 steps"


@dataclass
class Brittle(FilteredSine):
    """Gives so many blocks, and then no more."""

    blocks: int = 5
    error: type[Exception] = ArithmeticError

    def read(self, count: int) -> SampleBlock:
        if self.blocks == 0:
            raise self.error(WHY)
        self.blocks -= 1
        return super().read(count)


def read_on(acquisition: RigAcquisition, blocks: list[SampleBlock]) -> None:
    while True:
        blocks += acquisition.read(timeout_s=PATIENCE_S)


def set_again_and_again(acquisition: RigAcquisition) -> None:
    give_up = time.monotonic() + PATIENCE_S
    while time.monotonic() < give_up:
        acquisition.set_output(SINE)
        time.sleep(0.02)


@pytest.mark.parametrize("line", ["serial", "tcp"])
def test_the_host_gets_all_samples_before_it_and_then_the_reason(line, tmp_path):
    source = Brittle(blocks=7)
    with (
        served(source, can_bus=f"unixbus:{tmp_path}/bus", **{line: True}) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        blocks: list[SampleBlock] = []
        with pytest.raises(DeviceFailedError, match=r"daq.*no solution in 3 of 240 steps"):
            read_on(acquisition, blocks)
        events = list(acquisition.take_events())
        acquisition.stop()
        assert acquisition.identity.startswith("Virtual")
    assert [event.detail for event in events if (event.source, event.kind) == ("daq", "device-error")] == [WHY]
    assert "lost-samples" not in {event.kind for event in events}
    assert np.array_equal(channel(blocks, "acc1"), source.everything[1])
    assert np.array_equal(channel(blocks, "acc2"), quantised(source.everything[2], 490.0))


def test_a_change_of_the_output_that_comes_too_late_gives_the_reason_too():
    with served(Brittle(blocks=4), tcp=True) as rig, open_instruments(rig.instruments()) as acquisition:
        acquisition.start()
        take(acquisition, 4)
        with pytest.raises(DeviceFailedError, match="no solution"):
            set_again_and_again(acquisition)


def test_without_a_way_to_begin_anew_the_next_start_is_refused_with_the_reason():
    with served(Brittle(blocks=2), tcp=True) as rig, open_instruments(rig.instruments()) as acquisition:
        acquisition.start()
        with pytest.raises(DeviceFailedError):
            take(acquisition, 3)
        acquisition.stop()
        with pytest.raises(DeviceFailedError, match="self-test"):
            acquisition.start()


def test_a_plain_scpi_client_reads_a_device_dependent_error():
    with served(Brittle(blocks=2, error=ZeroDivisionError), tcp=True) as rig:
        host, _, port = str(rig.tcp).rpartition(":")
        with socket.create_connection((host, int(port)), timeout=PATIENCE_S) as link, link.makefile("rwb", 0) as line:

            def ask(text: str) -> str:
                line.write(text.encode() + b"\n")
                return line.readline().decode().strip()

            assert ask("*CLS;*ESR?") == "0"
            assert ask("READ? 2000;*OPC?") == "1"  # the block is missing, what follows is answered
            assert ask("SYST:ERR?") == f'-300,"Device-specific error;{WHY}"'
            assert ask("*ESR?") == "8"  # device-dependent error
            assert ask("ACQ:STAT?") == "FAILED"
            assert ask("ACQ:FAIL?") == f'"{WHY}"'
            assert ask("*TST?") == "1"
            line.write(b"ACQ:STAR\n")
            assert ask("SYST:ERR?").startswith("-300")
            assert ask("SYST:ERR?") == '0,"No error"'
            assert ask("*IDN?").startswith("Virtual Test Rig")


def test_the_node_says_so_at_once_in_words_of_the_database(tmp_path):
    address = f"{tmp_path}/bus"
    with (
        served(Brittle(blocks=3), can_bus=f"unixbus:{address}", can_channels=("acc2",)) as _,
        can.Bus(interface="unixbus", channel=address, fd=True) as bus,
    ):
        database = cantools.database.load_string(read_dbc(), "dbc")
        start = database.encode_message("Command", {"Opcode": "START", "Value": 0})
        bus.send(can.Message(arbitration_id=0x200, data=start, is_extended_id=False, is_fd=True))
        heard = []
        until = time.monotonic() + PATIENCE_S
        while "FAILED" not in heard and time.monotonic() < until:
            message = bus.recv(0.5)
            if message is not None and message.arbitration_id == 0x180:
                heard.append(str(database.decode_message(0x180, message.data)["State"]))
    assert heard[-1] == "FAILED"


def test_with_a_way_to_begin_anew_the_next_run_is_whole_and_the_server_was_told_once(tmp_path):
    made = [Brittle(blocks=3, rate_Hz=512.0), FilteredSine(rate_Hz=512.0)]
    rest = iter(made[1:])
    told: list[str] = []
    stop = threading.Event()
    rig = VirtualRig(
        made[0], Addresses(tcp="127.0.0.1:0", can=f"unixbus:{tmp_path}/bus"), speed=None,
        backing=Backing(renew=lambda: next(rest)),
    )  # fmt: skip
    where = {key: value for entry in rig.ready for key, value in entry.items()}
    thread = threading.Thread(target=rig.serve, args=(stop.is_set,), kwargs={"on_failure": told.append})
    thread.start()
    try:
        devices = [
            {"name": "daq", "address": f"tcp:{where['tcp']}", "generator": True},
            {"name": "can", "address": f"can:{where['can']}"},
        ]
        from drivers.instruments import Instruments

        with open_instruments(Instruments.model_validate({"device": devices})) as acquisition:
            assert acquisition.set_sample_rate(1024.0) == 1024.0
            acquisition.start()
            with pytest.raises(DeviceFailedError):
                take(acquisition, 9)
            acquisition.stop()
            acquisition.take_events()
            acquisition.start()
            acquisition.set_output(SINE)
            blocks = take(acquisition, 6)
            acquisition.stop()
            assert not acquisition.take_events()
    finally:
        stop.set()
        thread.join(PATIENCE_S)
    assert told == [WHY]
    assert {block.sample_rate_Hz for block in blocks} == {1024.0}
    assert blocks[0].first_index == 0
    assert [block.time_ns for block in blocks if block.device == "daq"] == sorted(
        block.time_ns for block in blocks if block.device == "daq"
    )
    force = channel(blocks, "force")
    assert np.array_equal(force, made[1].everything[0, : len(force)])
    assert np.abs(force).max() > 1.0  # the generator reached the new source


def test_rate_that_the_source_does_not_survive_is_an_error_not_an_end():
    class Fixed(FilteredSine):
        def set_sample_rate(self, sample_rate_Hz: float) -> float:
            raise RuntimeError("no such divider")

    with served(Fixed(), tcp=True) as rig, open_instruments(rig.instruments()) as acquisition:
        with pytest.raises(DeviceFailedError, match="no such divider"):
            acquisition.set_sample_rate(512.0)
        assert acquisition.identity.startswith("Virtual")
