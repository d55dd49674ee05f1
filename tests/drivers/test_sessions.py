"""Each client has a session of its own, one controls, the others look on; floods and silence harm nobody else."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import socket
import time
from collections.abc import Callable
from pathlib import Path

import can
import numpy as np
import pytest
import serial
from served_apart import served_apart
from virtual_rig import PATIENCE_S, FilteredSine, Served, served, wait_until

from drivers.can_dialect import FdDialect
from drivers.can_protocol import CanCommand, Opcode
from drivers.frames import Decoder, FrameKind
from drivers.host import open_instruments
from drivers.unixbus import UnixBus
from drivers.virtual import Protection
from drivers.virtual.conversing import SESSIONS_LIMIT
from recordings.errors import InputError
from recordings.streams import Excitation


class Client:
    """A socket that speaks in lines."""

    def __init__(self, rig: Served) -> None:
        host, _, port = str(rig.tcp).rpartition(":")
        self.socket = socket.create_connection((host.strip("[]"), int(port)), timeout=PATIENCE_S)
        self._file = self.socket.makefile("rb")

    def send(self, text: str) -> None:
        self.socket.sendall(text.encode() + b"\n")

    def line(self) -> str:
        return self._file.readline().decode().strip()

    def ask(self, text: str) -> str:
        self.send(text)
        return self.line()

    def close(self) -> None:
        self._file.close()
        self.socket.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


IDN = "Virtual Test Rig,DAQ-GEN,simulated,1.0"


@pytest.mark.parametrize(
    "left", ["VOLT 9;", "*IDN?\n" * 50, ":ACQ:STAR\n", "READ? 65536\n", "NONSENSE\n*ESE 255\n"],
    ids=["half a line", "unread replies", "a stream", "an answer that takes long", "errors"],
)  # fmt: skip
def test_who_comes_at_once_inherits_nothing(left: str):
    with served(FilteredSine(), tcp=True) as rig:
        for _ in range(30):
            before = Client(rig)
            before.socket.sendall(left.encode())
            before.close()
            with Client(rig) as after:
                assert after.ask("*IDN?;*ESE?;SYST:ERR?") == f'{IDN};0;0,"No error"'


@pytest.mark.parametrize("left", [b"VOLT 9;", b"*IDN?\n" * 50, b":ACQ:STAR\n"])
def test_who_opens_the_terminal_next_inherits_nothing(left: bytes, tmp_path: Path):
    with served_apart(tmp_path) as rig:
        for _ in range(2):
            with serial.Serial(rig.serial, timeout=PATIENCE_S) as before:
                before.write(left)
                before.flush()
                time.sleep(0.01)
            # What two clients send is one stream to the server unless it has noticed that the first one left.
            time.sleep(2.5)
            with serial.Serial(rig.serial, timeout=PATIENCE_S) as after:
                after.write(b"FREQ?;*ESE?\n")
                assert after.readline() == b"100.0;0\n"


def test_replies_come_in_the_order_of_their_queries_while_samples_flow():
    with served(FilteredSine(), tcp=True) as rig, Client(rig) as client:
        client.send(":ACQ:STAR")
        client.send("\n".join(f"*ESE {number};*ESE?" for number in range(200)))
        decoder, replies = Decoder(), []
        while len(replies) < 200:
            frames = decoder.feed(client.socket.recv(65536))
            replies += [frame.payload for frame in frames if frame.kind == FrameKind.TEXT]
        assert replies == [b"%d\n" % number for number in range(200)]
        assert decoder.lost_frames == decoder.bad_headers == 0


def test_what_nobody_reads_costs_no_memory_and_harms_nobody():
    with served(FilteredSine(), tcp=True) as rig, Client(rig) as greedy, Client(rig) as good:
        greedy.send("READ? 65536")
        greedy.socket.settimeout(0.1)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        with pytest.raises(TimeoutError):
            greedy.socket.sendall(b"FETC?\n" * 1_000_000)
        for _ in range(20):
            assert good.ask("*IDN?") == IDN
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # kB

        def hung_up() -> bool:
            try:
                greedy.socket.sendall(b"\n")
            except TimeoutError:
                return False
            except OSError:
                return True
            return False

        wait_until(hung_up)


def test_answers_of_one_message_are_bounded():
    with served(FilteredSine(), tcp=True) as rig, Client(rig) as client:
        client.send("READ? 65536")
        size = 3 * 4 * 65536
        assert len(client._file.read(len("#6786432") + size + 1)) == size + 9
        client.send("FETC?;FETC?")
        assert client.ask("SYST:ERR?").startswith('-430,"Query DEADLOCKED')


def test_silent_and_many_connections_do_not_keep_a_good_client_out():
    with served(FilteredSine(), tcp=True) as rig, Client(rig) as controller:
        assert controller.ask("VOLT 0.5;:OUTP ON;:SYST:LOCK:REQ?") == "1"
        flood = [Client(rig) for _ in range(200)]
        with Client(rig) as good:
            assert good.ask("*IDN?") == IDN
            assert controller.ask("OUTP?") == "1"  # who has control is never pushed out
        still = sum(answers(client) for client in flood)
        assert still < SESSIONS_LIMIT
        for client in flood:
            client.close()


def answers(client: Client) -> bool:
    try:
        return client.ask("*IDN?") == IDN
    except OSError:
        return False


def test_a_client_that_is_silent_too_long_is_hung_up_and_its_generator_off():
    with served(FilteredSine(), tcp=True, protection=Protection(idle_s=0.3)) as rig, Client(rig) as client:
        assert client.ask("VOLT 1;:OUTP ON;OUTP?") == "1"
        assert client.line() == ""  # the end of the connection
        with Client(rig) as after:
            assert after.ask("OUTP?") == "0"


def test_the_generator_stops_when_its_client_is_killed():
    with served(FilteredSine(), tcp=True) as rig:
        pid = os.fork()
        if pid == 0:
            client = Client(rig)
            client.ask("VOLT 1;:OUTP ON;OUTP?")
            os.kill(os.getpid(), signal.SIGKILL)
        os.waitpid(pid, 0)
        with Client(rig) as after:
            assert after.ask("OUTP?") == "0"
            after.send("READ? 100")
            assert after._file.read(6) == b"#41200"
        assert rig.source.excitation.kind == "off"


def test_a_cut_stream_drives_on_for_as_long_as_the_watchdog_allows():
    with served(FilteredSine(), tcp=True, protection=Protection(watchdog_s=0.5)) as rig, Client(rig) as looks_on:
        with Client(rig) as client:
            client.send("VOLT 1;:OUTP ON;:ACQ:STAR")
            wait_until(lambda: looks_on.ask("ACQ:STAT?") == "RUN")
        wait_until(lambda: looks_on.ask("ACQ:STAT?") == "INTERRUPTED")
        assert looks_on.ask("OUTP?") == "1"
        wait_until(lambda: looks_on.ask("ACQ:STAT?") == "FAILED")
        assert looks_on.ask("OUTP?;:ACQ:FAIL?") == '0;"watchdog: no client for 0.5 s, output to zero"'
        assert looks_on.ask("OUTP:PROT:WDOG:DEL 2;DEL?") == "2.0"
        looks_on.send(":ACQ:STAR")  # it goes on as if nothing had been
        wait_until(lambda: rig.source.excitation.kind == "off")


def test_a_watchdog_is_an_event_of_the_recording():
    with served(FilteredSine(), tcp=True, protection=Protection(watchdog_s=0.1)) as rig:
        acquisition = open_instruments(rig.instruments(reconnect_s=5.0))
        acquisition.start()
        acquisition.set_output(Excitation(kind="sine", amplitude_V=1.0, frequency_Hz=20.0))
        (daq,) = acquisition._devices
        real_open, daq._open = daq._open, refuse_for(0.5, daq._open)
        daq._line._link.shutdown(socket.SHUT_RDWR)
        events = []

        def read() -> None:
            with contextlib.suppress(TimeoutError):
                acquisition.read(timeout_s=0.5)
            events.extend(acquisition.take_events())

        wait_until(lambda: any(event.kind == "device-error" for event in events), step=read)
        daq._open = real_open
        acquisition.close()
    told = [event.detail for event in events if event.kind == "device-error"]
    assert any(detail.startswith("watchdog: no client for 0.1 s") for detail in told), events


def refuse_for(seconds: float, opens: Callable[[], object]) -> Callable[[], object]:
    until = time.monotonic() + seconds

    def late() -> object:
        if time.monotonic() < until:
            raise InputError("line", "", "not yet")
        return opens()

    return late


@pytest.mark.parametrize("text", ["VOLT 2", "FREQ 20", "OUTP OFF", "*RST", ":ACQ:STOP", ":ACQ:STAR", "READ? 10"])
def test_a_second_client_may_look_on_but_change_nothing(text: str):
    with served(FilteredSine(), tcp=True) as rig, Client(rig) as first, Client(rig) as second:
        first.send("VOLT 1;FREQ 50;:OUTP ON;:ACQ:STAR")
        wait_until(lambda: second.ask("ACQ:STAT?") == "RUN")
        second.send(text)
        name = "{}:{}".format(*first.socket.getsockname())
        assert second.ask("SYST:ERR?") == f'-203,"Command protected;{name} has control"'
        assert second.ask("VOLT?;FREQ?;:OUTP?;:SYST:LOCK:OWN?") == f'1.0;50.0;1;"{name}"'
        assert second.ask("ACQ:STAT?") == "RUN"


def test_a_lock_lasts_until_it_is_released():
    with served(FilteredSine(), tcp=True) as rig, Client(rig) as first, Client(rig) as second:
        assert first.ask("SYST:LOCK:REQ?") == "1"
        assert second.ask("SYST:LOCK:REQ?") == "0"
        first.send("SYST:LOCK:REL")
        assert first.ask("SYST:LOCK:OWN?") == '""'
        assert second.ask("SYST:LOCK:REQ?") == "1"
        assert first.ask("VOLT 1;:SYST:ERR?").startswith("-203")


@pytest.mark.parametrize("by", ["scpi", "can", "signal"])
def test_an_emergency_stop_ends_everything_until_it_is_cleared(by: str, tmp_path):
    with (
        served(FilteredSine(), tcp=True, can_bus=f"unixbus:{tmp_path}/bus") as rig,
        Client(rig) as driving, Client(rig) as looks_on,
    ):  # fmt: skip
        driving.send("VOLT 1;:OUTP ON;:ACQ:STAR")
        wait_until(lambda: looks_on.ask("ACQ:STAT?") == "RUN")
        if by == "scpi":
            looks_on.send("OUTP:PROT:TRIP")
        elif by == "signal":
            rig.stop_at_once("signal")
        else:
            with UnixBus(f"{tmp_path}/bus") as bus:
                for identifier, data in FdDialect().encode(CanCommand(Opcode.HALT, 0.0)):
                    bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False, is_fd=True))
                wait_until(lambda: looks_on.ask("OUTP:PROT:TRIP?") == "1")
        wait_until(lambda: looks_on.ask("ACQ:STAT?") == "FAILED")
        assert looks_on.ask("OUTP?;:ACQ:FAIL?").startswith('0;"emergency stop by ')
        assert looks_on.ask("*CLS;OUTP ON;:ACQ:STAR;:OUTP?;:SYST:ERR:COUN?") == "0;2"
        assert looks_on.ask("OUTP:PROT:CLE;TRIP?") == "0"
        looks_on.send(":ACQ:STAR")
        before = rig.source.index
        wait_until(lambda: rig.source.index > before)
        assert rig.source.excitation.kind == "off"


def test_no_client_passes_the_drive_limit():
    with served(FilteredSine(), tcp=True, protection=Protection(drive_limit_V=2.0)) as rig, Client(rig) as client:
        assert client.ask("VOLT 2;VOLT?") == "2.0"
        assert client.ask("VOLT 2.1;VOLT?;:SYST:ERR?").startswith('2.0;-222,"Data out of range;this')


def test_it_listens_on_ipv6():
    with served(FilteredSine(), tcp="[::1]:0") as rig, Client(rig) as client:
        assert client.ask("*IDN?") == IDN
        assert np.isfinite(float(client.ask("FREQ?")))
