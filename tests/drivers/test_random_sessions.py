"""Random clients that come, go, are killed and talk nonsense, against a model of who has said what and who controls.

Every answer is compared with the model's, every sample with the tone's to the bit.
"""

from __future__ import annotations

import socket
import struct
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import can
import numpy as np
import pytest
import serial
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule, run_state_machine_as_test
from served_apart import Apart, served_apart

from drivers.frames import Decoder, FrameKind, unpack_samples
from drivers.unixbus import UnixBus
from drivers.virtual.tone import Tone

IDN = "Virtual Test Rig,DAQ-GEN,simulated,1.0"
TONE = Tone(("force", "acc1", "acc2"), sample_rate_Hz=5120.0)
MOST_BYTES = 50 << 20
"""By which the server's memory may grow over all sessions."""
PATIENCE_S = 60.0


class Talker:
    """A TCP client and what the model knows of it: the register that is its own alone."""

    def __init__(self, tcp: str) -> None:
        host, _, port = tcp.rpartition(":")
        self.socket = socket.create_connection((host, int(port)), timeout=PATIENCE_S)
        self.lines = self.socket.makefile("rb")
        self.enabled = 0

    def send(self, text: str) -> None:
        self.socket.sendall(text.encode())

    def ask(self, text: str) -> str:
        self.send(text + "\n")
        return self.lines.readline().decode().strip()

    def close(self, *, killed: bool) -> None:
        if killed:  # the system sends a reset instead of an orderly end
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.lines.close()
        self.socket.close()


class Sessions(RuleBasedStateMachine):
    """The model: registers of each client, who has control, whether the generator is on."""

    rig: Apart

    def __init__(self) -> None:
        super().__init__()
        self.talkers: list[Talker] = []
        self.controller: Talker | None = None

    def pick(self, number: int) -> Talker:
        return self.talkers[number % len(self.talkers)]

    @rule()
    @precondition(lambda self: len(self.talkers) < 8)
    def come(self) -> None:
        self.talkers.append(Talker(self.rig.tcp))

    @rule(
        number=st.integers(0, 7), killed=st.booleans(), last=st.sampled_from(["", "VOLT 9;", "*IDN?\n*IDN?\n", "\xff"])
    )
    @precondition(lambda self: self.talkers)
    def go(self, number: int, killed: bool, last: str) -> None:
        talker = self.pick(number)
        talker.send(last)
        talker.close(killed=killed)
        self.talkers.remove(talker)
        if talker is self.controller:
            self.controller = None
            self.await_release()

    def await_release(self) -> None:
        """The server notices a reset a moment after it was sent."""
        onlooker = Talker(self.rig.tcp)
        give_up = time.monotonic() + PATIENCE_S
        while onlooker.ask("SYST:LOCK:OWN?") != '""':
            assert time.monotonic() < give_up
        assert onlooker.ask("OUTP?") == "0"
        onlooker.close(killed=False)

    @rule(number=st.integers(0, 7), value=st.integers(0, 255))
    @precondition(lambda self: self.talkers)
    def enable(self, number: int, value: int) -> None:
        talker = self.pick(number)
        talker.enabled = value
        talker.send(f"*ESE {value}\n")

    @rule(number=st.integers(0, 7), count=st.integers(1, 40))
    @precondition(lambda self: self.talkers)
    def ask_many(self, number: int, count: int) -> None:
        talker = self.pick(number)
        talker.send("".join(f"*ESE?;FREQ? {'MIN' if k % 2 else 'MAX'}\n" for k in range(count)))
        for k in range(count):
            assert talker.lines.readline().decode().strip() == f"{talker.enabled};{'0.001' if k % 2 else '100000.0'}"

    @rule(
        number=st.integers(0, 7), text=st.text(st.characters(codec="latin-1", exclude_characters="?\n\r;"), max_size=40)
    )
    @precondition(lambda self: self.talkers)
    def talk_nonsense(self, number: int, text: str) -> None:
        talker = self.pick(number)
        talker.socket.sendall(b"NONSENSE " + text.encode("latin-1") + b"\n")
        assert talker.ask("*CLS;SYST:ERR:COUN?") == "0"

    @rule(number=st.integers(0, 7))
    @precondition(lambda self: self.talkers)
    def take_control(self, number: int) -> None:
        talker = self.pick(number)
        given = talker.ask("SYST:LOCK:REQ?")
        assert given == str(int(self.controller in (None, talker)))
        if given == "1":
            self.controller = talker
            talker.send("VOLT 1;:OUTP ON\n")

    @rule(number=st.integers(0, 7))
    @precondition(lambda self: self.talkers and self.controller)
    def disturb(self, number: int) -> None:
        talker = self.pick(number)
        if talker is not self.controller:
            assert talker.ask("*CLS;:VOLT 7;:OUTP OFF;:ACQ:STOP;*RST;:SYST:ERR?").startswith("-203,")
            assert talker.ask("*CLS;VOLT?;:OUTP?") == "1.0;1"

    @rule(half=st.sampled_from([b"VOLT 9;", b"FREQ 3\n", b"\xd7RIG", b""]))
    def come_over_the_terminal(self, half: bytes) -> None:
        with serial.Serial(self.rig.serial, timeout=PATIENCE_S) as line:
            line.write(b"\n*CLS;*ESE?;*IDN?\n")
            assert line.readline().decode().strip() == f"0;{IDN}"
            line.write(half)
        time.sleep(0.05)  # until the system has told the server

    @rule(identifier=st.integers(0x211, 0x7FF), data=st.binary(max_size=8))
    def rubbish_on_the_bus(self, identifier: int, data: bytes) -> None:
        with UnixBus(self.rig.can.partition(":")[2]) as bus:
            bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    @rule(blocks=st.integers(1, 6))
    @precondition(lambda self: self.controller is None)
    def measure(self, blocks: int) -> None:
        good = Talker(self.rig.tcp)
        check_stream(good, blocks)
        good.close(killed=False)
        self.await_release()

    @invariant()
    def memory_stays(self) -> None:
        assert self.rig.resident_bytes - self.began_bytes < MOST_BYTES

    def teardown(self) -> None:
        for talker in self.talkers:
            talker.close(killed=True)
        self.await_release()

    began_bytes = 0


def check_stream(good: Talker, blocks: int) -> int:
    """A stream of so many frames, without a gap and right to the bit; how many samples."""
    good.send("*CLS\nACQ:BLOC 240;WIND 0\nACQ:STAR\n")
    decoder, taken, origin = Decoder(), 0, None
    stopped = ended = False
    while not ended:
        for frame in decoder.feed(good.socket.recv(65536)):
            ended = ended or frame.kind == FrameKind.END
            if frame.kind != FrameKind.SAMPLES:
                continue
            values, _ = unpack_samples(frame)
            assert frame.first_index == taken
            at = round(frame.time_ns * 1e-9 * 5120.0)
            origin = at if origin is None else origin
            assert at == origin + taken
            for name, row in zip(("force", "acc1"), values, strict=True):
                assert np.array_equal(row, TONE.values(name, at, len(row)))
            taken += values.shape[1]
        if taken >= 240 * blocks and not stopped:
            stopped = True
            good.send("ACQ:STOP\n")
    assert decoder.lost_frames == decoder.bad_headers == decoder.bad_payloads == 0
    assert good.ask("*IDN?") == IDN
    return taken


@pytest.mark.parametrize("count", [30, pytest.param(10_000, marks=pytest.mark.nightly)])
def test_random_sessions_never_get_in_each_others_way(count: int) -> None:
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        Sessions.rig = stack.enter_context(served_apart(Path(folder)))
        Sessions.began_bytes = Sessions.rig.resident_bytes
        run_state_machine_as_test(
            Sessions, settings=settings(max_examples=count, stateful_step_count=15, deadline=None)
        )


@pytest.mark.parametrize("seconds", [10.0, pytest.param(3600.0, marks=pytest.mark.nightly)])
def test_a_good_client_beside_fifty_random_ones_keeps_all_its_samples(seconds: float, tmp_path: Path) -> None:
    generator = np.random.default_rng(29)
    with served_apart(tmp_path) as rig:
        good = Talker(rig.tcp)
        assert good.ask("SYST:LOCK:REQ?") == "1"
        others = [Talker(rig.tcp) for _ in range(50)]
        began, samples, end = rig.resident_bytes, 0, time.monotonic() + seconds
        while time.monotonic() < end:
            samples += check_stream(good, 4)
            for _ in range(20):
                number = int(generator.integers(len(others)))
                others[number] = misbehave(others[number], rig.tcp, generator)
            assert rig.resident_bytes - began < MOST_BYTES
        for each in (good, *others):
            each.close(killed=True)
    print(f"{seconds:g} s: {samples} samples, all right")
    assert samples > 1000 * seconds


def misbehave(other: Talker, tcp: str, generator: np.random.Generator) -> Talker:
    """One thing that a bad client does; the client that is there afterwards."""
    said = [
        b"FETC?\n" * 100,
        b"ACQ:STOP\n*RST\n",
        b"VOLT 9;",
        generator.bytes(200),
        b"READ? 65536\n",
        b"\n" * 4096,
        b"",
    ]
    try:
        other.socket.setblocking(False)
        other.socket.send(said[int(generator.integers(len(said)))])
        if generator.random() < 0.7:
            return other
    except OSError:
        pass  # its buffers are full, or it was hung up
    other.close(killed=bool(generator.integers(2)))
    return Talker(tcp)
