"""Whatever bytes come in from outside: bounded time and memory, nothing worse than a counted or clear error."""

from __future__ import annotations

import struct
import tracemalloc
import zlib
from collections.abc import Callable

import numpy as np
import pytest

from drivers.addresses import parse_address
from drivers.can_protocol import ChannelInfo, Command, Heartbeat, Reply, Status, TimeSync
from drivers.frames import Decoder, Frame, FrameKind, encode, unpack_samples
from drivers.scpi import Instrument, Interpreter
from drivers.virtual.faults import parse_fault
from recordings.errors import InputError

COUNTS = [1000, pytest.param(1_000_000, marks=pytest.mark.slow)]
WORDS = [b"*IDN?", b"SYST:", b"ERR", b"?", b";", b",", b" ", b'"', b"'", b"#", b"1e9", b"-", b"\n", b":", b"*", b"\xff"]


def damaged(generator: np.random.Generator, good: bytes) -> bytes:
    """A good input with bits flipped, cut, repeated, or plain rubbish."""
    data = bytearray(good)
    fate = generator.integers(4)
    if fate == 0:
        return generator.bytes(int(generator.integers(120)))
    for _ in range(int(generator.integers(1, 4))):
        if data:
            data[int(generator.integers(len(data)))] = int(generator.integers(256))
    if fate == 1:
        return bytes(data[: int(generator.integers(len(data) + 1))])
    return bytes(data * 2 if fate == 2 else data)


@pytest.mark.parametrize("count", COUNTS)
def test_frames(count):
    generator = np.random.default_rng(1)
    good = encode(Frame(kind=FrameKind.SAMPLES, sequence=1, channels=2, payload=bytes(8 + 80)))
    decoder = Decoder()
    tracemalloc.start()
    for _ in range(count):
        for frame in decoder.feed(damaged(generator, good)):
            if frame.kind == FrameKind.SAMPLES and frame.channels != 2:
                with pytest.raises(ValueError, match="payload"):
                    unpack_samples(frame)
        if decoder._buffer and len(decoder._buffer) > 70_000:
            raise AssertionError("the decoder keeps more than a frame")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2_000_000
    assert decoder.bad_headers + decoder.bad_payloads > count / 10


@pytest.mark.parametrize("count", COUNTS)
def test_scpi(count):
    generator = np.random.default_rng(2)
    instrument = Instrument()
    interpreter = Interpreter(instrument)
    for _ in range(count):
        if interpreter.room:
            picks = generator.integers(len(WORDS), size=int(generator.integers(1, 12)))
            interpreter.feed(b"".join(WORDS[i] for i in picks))
        assert all(reply.endswith(b"\n") for reply in interpreter.run())
    assert len(instrument.errors) <= 16
    interpreter.feed(b"\n*CLS;*OPC?\n")
    assert interpreter.run()[-1] == b"1\n"


@pytest.mark.parametrize("count", COUNTS)
def test_can_messages(count):
    generator = np.random.default_rng(3)
    for _ in range(count):
        data = generator.bytes(int(generator.integers(65)))
        for message in (TimeSync, Heartbeat, Status, Command, Reply, ChannelInfo):
            try:
                message.unpack(data)
            except (ValueError, struct.error):
                continue


@pytest.mark.parametrize("parse", [parse_address, parse_fault])
def test_options(parse: Callable[[str], object]):
    generator = np.random.default_rng(4)
    seeds = [b"tcp:localhost:5025", b"can:virtual:0", b"drop:device=daq,probability=0.1", b"stuck:channel=acc1,at_s=1"]
    refused = []
    for k in range(4000):
        text = damaged(generator, seeds[k % 4]).decode("latin-1")
        try:
            parse(text)
        except (ValueError, InputError) as error:
            refused.append(str(InputError("option", "", str(error))))
    assert len(refused) > 2000
    assert not any("\n" in line for line in refused)


def test_a_valid_header_with_any_length_is_bounded():
    decoder = Decoder()
    for length in (65537, 2**24, 2**32 - 1):
        header = struct.pack("<BBHIQqd", 1, 1, 0, length, 0, 0, 1.0)
        decoder.feed(b"\xd7RIG" + header + struct.pack("<I", zlib.crc32(header)) + bytes(1000))
    assert decoder.bad_headers == 3
    assert len(decoder.take_rest()) < 8
