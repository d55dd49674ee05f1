"""Clients of a pseudo-terminal are told apart, be their visits longer or shorter than the instrument's turns."""

from __future__ import annotations

import contextlib
import os
import time
import tty
from collections.abc import Iterator

import pytest
from virtual_rig import PATIENCE_S

from drivers.virtual import PtyPort


@pytest.fixture
def port() -> Iterator[PtyPort]:
    made = PtyPort()
    yield made
    made.close()


@contextlib.contextmanager
def visitor(port: PtyPort) -> Iterator[int]:
    descriptor = os.open(port.address, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def heard(port: PtyPort, size: int) -> bytes:
    """What has come; the kernel carries it over in its own time."""
    data, end = b"", time.monotonic() + PATIENCE_S
    while len(data) < size and time.monotonic() < end:
        port.poll()
        data += port.read()
    return data


def test_a_visit_between_two_polls_is_a_visit(port: PtyPort) -> None:
    with visitor(port) as line:
        os.write(line, b"VOLT 0\n")
    assert heard(port, 7) == b"VOLT 0\n"
    assert port.client == 1
    port.poll()
    assert port.client == 0


def test_what_such_a_visitor_sent_is_not_the_next_ones(port: PtyPort) -> None:
    with visitor(port) as line:
        os.write(line, b"*IDN?\n")
    assert heard(port, 6) == b"*IDN?\n"
    port.write(memoryview(b"to nobody\n"))
    with visitor(port) as line:
        port.poll()
        assert port.client == 2
        with pytest.raises(BlockingIOError):
            os.read(line, 100)


def test_one_that_stays_is_one_visitor(port: PtyPort) -> None:
    with visitor(port) as line:
        tty.setraw(line)
        for _ in range(3):
            os.write(line, b"*OPC?\n")
            assert heard(port, 6) == b"*OPC?\n"
            assert port.write(memoryview(b"1\n")) == 2
            assert port.client == 1
