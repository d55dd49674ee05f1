"""The bus between processes: nothing lost, in order, back-pressure, and participants that come and go."""

import contextlib
import socket
import subprocess
import sys
import threading
import time

import can
import pytest
from virtual_rig import PATIENCE_S

import drivers.unixbus


def frame(number: int) -> can.Message:
    return can.Message(
        arbitration_id=number % 2048, data=number.to_bytes(4, "little") * 16, is_extended_id=False, is_fd=True
    )


@pytest.fixture
def path(tmp_path):
    return str(tmp_path / "bus")


def open_bus(path: str) -> can.BusABC:
    return can.Bus(interface="unixbus", channel=path, fd=True)


def test_another_process_gets_every_frame_in_order(path):
    sender = (
        "import can, sys\n"
        "bus = can.Bus(interface='unixbus', channel=sys.argv[1], fd=True)\n"
        "for n in range(20000):\n"
        "    bus.send(can.Message(arbitration_id=n % 2048, data=n.to_bytes(4, 'little') * 16, is_fd=True,"
        " is_extended_id=False))\n"
        "bus.shutdown()\n"
    )
    with open_bus(path) as bus, subprocess.Popen([sys.executable, "-c", sender, path]) as process:
        for n in range(20000):
            message = bus.recv(PATIENCE_S)
            assert message is not None
            assert int.from_bytes(message.data[:4], "little") == n
            assert (message.arbitration_id, message.dlc, message.is_fd) == (n % 2048, 64, True)
        assert process.wait(PATIENCE_S) == 0


def test_what_was_sent_before_leaving_arrives_though_nobody_read_yet(path):
    """The last frame waits in the sender while the socket is full."""
    with open_bus(path) as hub:
        sender = open_bus(path)
        hub.recv(0.01)
        sent = 0
        while not any(sender._pending.values()):
            sender.send(frame(sent), timeout=PATIENCE_S)
            sent += 1
        leaving = threading.Thread(target=sender.shutdown)
        leaving.start()
        received = [hub.recv(PATIENCE_S) for _ in range(sent)]
        leaving.join(PATIENCE_S)
    assert not any(message is None for message in received)
    assert [message.data for message in received] == [frame(n).data for n in range(sent)]


def test_a_participant_leaves_though_nobody_ever_reads(path, monkeypatch):
    monkeypatch.setattr(drivers.unixbus, "LAST_WORDS_S", 0.2)
    with open_bus(path):
        sender = open_bus(path)
        while not any(sender._pending.values()):
            sender.send(frame(0), timeout=PATIENCE_S)
        began = time.monotonic()
        sender.shutdown()
        assert time.monotonic() - began < PATIENCE_S


def test_every_participant_hears_every_other(path):
    with open_bus(path) as hub, open_bus(path) as a, open_bus(path) as b:
        hub.recv(0.01)
        a.send(frame(1))
        assert hub.recv(PATIENCE_S).data == frame(1).data
        assert b.recv(PATIENCE_S).data == frame(1).data
        assert a.recv(0.01) is None  # not its own
        hub.send(frame(2))
        assert [bus.recv(PATIENCE_S).arbitration_id for bus in (a, b)] == [2, 2]


def test_a_full_participant_holds_the_sender_and_loses_nothing(path):
    with open_bus(path) as hub, open_bus(path) as slow:
        hub.recv(0.01)
        sent = 0
        with contextlib.suppress(can.CanTimeoutError):
            while sent < 100_000:
                hub.send(frame(sent), timeout=0)
                sent += 1
        assert 0 < sent < 100_000
        reader = threading.Thread(target=lambda: received.extend(slow.recv(PATIENCE_S) for _ in range(sent + 1)))
        received: list = []
        reader.start()
        hub.send(frame(sent), timeout=PATIENCE_S)
        hub.recv(0.1)
        reader.join(PATIENCE_S)
        assert [int.from_bytes(m.data[:4], "little") for m in received] == list(range(sent + 1))


def test_the_hub_takes_the_bus_down(path):
    hub = open_bus(path)
    a = open_bus(path)
    hub.recv(0.01)
    hub.shutdown()
    with pytest.raises(can.CanOperationError, match="hub"):
        a.recv(PATIENCE_S)
    a.shutdown()
    with open_bus(path) as again:  # the path is free
        assert again.recv(0.01) is None


def test_a_stale_socket_is_replaced_but_a_file_is_not(tmp_path, path):
    stale = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    stale.bind(path)
    stale.close()
    open_bus(path).shutdown()
    (tmp_path / "file").write_text("precious")
    with pytest.raises(can.CanInitializationError, match="not a socket"):
        open_bus(str(tmp_path / "file"))
    assert (tmp_path / "file").read_text() == "precious"


def test_rubbish_on_the_socket_is_an_error_frame(path):
    with open_bus(path) as hub, socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as stranger:
        stranger.connect(path)
        hub.recv(0.01)
        for data in (b"x", b"\xff" * 8, b"\x00" * 100, bytes([1, 0, 0, 0, 1, 64, 0, 0]) + b"short"):
            stranger.send(data)
            assert hub.recv(PATIENCE_S).is_error_frame


def test_what_was_sent_by_one_who_left_without_listening_still_comes(path):
    with open_bus(path) as hub:
        leaver = open_bus(path)
        hub.recv(0.01)
        hub.send(frame(7))
        for n in range(20):
            leaver.send(frame(n))
        leaver.shutdown()
        came = [message.arbitration_id for _ in range(20) if (message := hub.recv(PATIENCE_S)) is not None]
    assert came == list(range(20))
