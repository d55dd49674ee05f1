"""Whatever bytes come in from outside: bounded time and memory, nothing worse than a counted or clear error."""

from __future__ import annotations

import struct
import tracemalloc
import zlib
from collections.abc import Callable

import numpy as np
import pytest

from drivers.addresses import parse_address
from drivers.blf import read_blf
from drivers.can_protocol import CanCommand, ChannelInfo, Heartbeat, Reply, Status, TimeSync
from drivers.frames import Decoder, Frame, FrameKind, encode, unpack_samples
from drivers.host.catalogue import read_catalogue
from drivers.instruments import read_instruments
from drivers.scpi import Instrument, Interpreter
from drivers.virtual.faults import parse_fault
from drivers.virtual.ports import PtyPort
from drivers.virtual.slcan import INPUT_FRAMES, SlcanAdapter
from recordings.errors import InputError

COUNTS = [1000, pytest.param(1_000_000, marks=pytest.mark.nightly)]
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
    assert len(instrument.registers.errors) <= 16
    interpreter.feed(b"\n*CLS;*OPC?\n")
    assert interpreter.run()[-1] == b"1\n"


@pytest.mark.parametrize("count", COUNTS)
def test_can_messages(count):
    generator = np.random.default_rng(3)
    for _ in range(count):
        data = generator.bytes(int(generator.integers(65)))
        for message in (TimeSync, Heartbeat, Status, CanCommand, Reply, ChannelInfo):
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
    assert len(decoder._buffer) < 8


@pytest.mark.parametrize("count", COUNTS)
def test_lines_to_a_serial_can_adapter(count):
    generator = np.random.default_rng(6)
    good = [
        b"S8",
        b"Y5",
        b"O",
        b"C",
        b"V",
        b"F",
        b"t1232AABB",
        b"b10090102030405060708090A0B0C",
        b"T000000010",
        b"r1000",
    ]
    adapter = SlcanAdapter(PtyPort(), bitrate=1e6, data_bitrate=5e6)
    try:
        for number in range(count):
            answer = adapter._obey(damaged(generator, good[number % len(good)]).replace(b"\r", b""))
            assert answer[-1:] in (b"\r", b"\a")
            assert len(answer) < 10
            if len(adapter._received) == INPUT_FRAMES:
                adapter._received.clear()
    finally:
        adapter.shutdown()


@pytest.mark.parametrize("count", COUNTS)
def test_what_an_instrument_says_of_its_channels(count):
    generator = np.random.default_rng(7)
    good = b'"acc2","acceleration","m/s^2",0.42,"+y",490.0'
    refused = 0
    for _ in range(count):
        answers = iter(["1", damaged(generator, good).decode("latin-1")])
        try:
            (channel,) = read_catalogue(lambda _, told=answers: next(told), device="daq")
        except ValueError:
            refused += 1
        else:
            assert channel.device == "daq"
    assert count / 2 < refused < count


@pytest.mark.parametrize("count", COUNTS)
def test_logs_of_frames(count, tmp_path):
    """Below the compression, where python-can would trust every size."""
    generator = np.random.default_rng(8)
    frames = b"".join(
        struct.pack("<4sHHLL", b"LOBJ", 32, 1, 116, 100) + struct.pack("<LHHQ", 2, 0, 0, 7 * number)
        + struct.pack("<HBBLLBBB5x64s", 1, 0, 15, identifier, 0, 0, 3, 64, data)
        for number, (identifier, data) in enumerate(
            [
                (0x182, struct.pack("<BBBbff24s8s", 0, 1, 0, 1, 50.0, 0.1, b"force", b"N")),
                (0x080, struct.pack("<IqId", 0, 10**9, 0, 1024.0)),
                (0x100, struct.pack("<I30h", 0, *range(30))),
                (0x100, struct.pack("<I30h", 30, *range(30))),
            ]
        )
    )  # fmt: skip
    path = tmp_path / "log.blf"
    read = 0
    for number in range(count):
        inner = damaged(generator, frames) if number else frames
        head = struct.pack("<4sHHLL", b"LOBJ", 16, 1, 32 + len(inner), 10) + struct.pack("<H6xL4x", 0, len(inner))
        path.write_bytes(struct.pack("<4sL", b"LOGG", 144).ljust(144, b"\0") + head + inner)
        try:
            run = read_blf(path)
        except InputError as error:
            assert "log.blf" in str(error)  # noqa: PT017
        else:
            read += 1
            assert len(run.devices["can1"]) < 1 << 21
    assert count / 20 < read < count


SETTINGS = b"""timeout_s = 2.0
[[device]]
name = "daq"
address = "tcp:127.0.0.1:5025"
generator = true
[[device.channel]]
source = "ch1"
name = "force"
quantity = "force"
unit = "N"
sensitivity = 0.0112
[[device]]
name = "can"
address = "can:virtual:0"
"""


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("kind", ["instruments", "rig", "procedure"])
def test_settings_files(kind, count, tmp_path):
    """Rubbish between good lines: never more than one line that names the file."""
    from twin.procedures import dump_procedure, load_procedure
    from twin.rigs import load_rig, save_rig

    generator = np.random.default_rng(9)
    path = tmp_path / "settings.toml"
    if kind == "instruments":
        path.write_bytes(SETTINGS)
    elif kind == "rig":
        save_rig(load_rig("steel-lap-joint"), path)
    else:
        path.write_bytes(dump_procedure(load_procedure("steel-sweeps")))
    good, read = (
        path.read_bytes(),
        {"instruments": read_instruments, "rig": load_rig, "procedure": load_procedure}[kind],
    )
    read(str(path))
    refused = 0
    for _ in range(count):
        path.write_bytes(damaged(generator, good))
        try:
            read(str(path))
        except InputError as error:
            refused += 1
            assert str(path) in str(error)  # noqa: PT017
            assert "\n" not in str(error)  # noqa: PT017
            assert len(str(error)) < 1000  # noqa: PT017
    assert count / 10 < refused <= count
