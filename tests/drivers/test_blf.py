"""Runs as logs of CAN FD frames and back: against cantools and python-can, and against strangers' files."""

from __future__ import annotations

import contextlib
import json
import random
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import can
import cantools
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recording_builders import START_NS

from drivers.blf import read_blf, write_blf
from drivers.can_protocol import read_dbc
from recordings import Channel, Event, InputError, Run, RunWriter, SampleBlock, read_run
from recordings.check import check_run
from recordings.convert import FORMATS, Format, convert

DATABASE = cantools.database.load_string(read_dbc(), "dbc")
WITH_BLF = (*FORMATS, Format(suffix=".blf", name="BLF", read=read_blf, write=write_blf))
RATE_Hz = 25600.0
RANGES = {"force": 50.0, "acc1": 490.0, "acc2": 123.4, "acc3": 490.0, "tip": 0.25, "bolt": 4000.0}


def channels() -> list[Channel]:
    common = {"quantity": "acceleration", "unit": "m/s^2", "device": "daq"}
    return [
        Channel(name="force", quantity="force", unit="N", range=50.0, position_m=0.05, device="daq"),
        Channel(name="acc1", range=490.0, position_m=0.3, direction="-y", **common),
        Channel(name="acc2", range=123.4, **common),
        Channel(name="acc3", range=490.0, **common),
        Channel(name="tip", quantity="velocity", unit="m/s", range=0.25, device="daq"),
        Channel(name="bolt", quantity="preload", unit="N", range=4000.0, device="meter"),
    ]


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five channels of one device with a gap and a clock that steps, and a slow second device."""
    path = tmp_path_factory.mktemp("original") / "run.mcap"
    rng = np.random.default_rng(5)
    with RunWriter(path, info={"source": "measured"}, channels=channels()) as writer:
        for number in range(40):
            if number in (7, 8, 20):
                continue
            late = 1_000_000 if number > 30 else 0
            writer.write_block(
                SampleBlock(
                    device="daq", time_ns=START_NS + late + round(number * 250e9 / RATE_Hz), first_index=number * 250,
                    sample_rate_Hz=RATE_Hz, overload={"acc1": 2} if number == 25 else {},
                    samples={
                        name: (RANGES[name] * rng.uniform(-1, 1, 250)).astype(np.float32)
                        for name in ("force", "acc1", "acc2", "acc3", "tip")
                    },
                )
            )  # fmt: skip
        for number in range(3):
            writer.write_block(
                SampleBlock(
                    device="meter", time_ns=START_NS + number * 100_000_000 + 17, first_index=number,
                    sample_rate_Hz=10.0,
                    samples={"bolt": np.array([1200.0 - number], np.float32)},
                )
            )  # fmt: skip
    return path


def there_and_back(path: Path, folder: Path) -> tuple[Run, list[str]]:
    notes = convert(path, folder / "log.blf", formats=WITH_BLF)
    assert convert(folder / "log.blf", folder / "back.mcap", formats=WITH_BLF) == []
    assert check_run(folder / "back.mcap").sound
    return read_run(folder / "back.mcap"), notes


def test_round_trip_keeps_numbers_times_gaps_and_values_to_the_resolution(original: Path, tmp_path: Path) -> None:
    back, notes = there_and_back(original, tmp_path)
    before = read_run(original)
    for name, limit in RANGES.items():
        old, new = before.device_of(name), back.device_of(name)
        assert old.gaps == tuple(type(gap)(**{**gap.__dict__, "device": old.device}) for gap in new.gaps)
        assert (new.first_index, new.sample_rate_Hz) == (old.first_index, old.sample_rate_Hz)
        received = ~np.isnan(old.values[name])
        assert np.array_equal(received, ~np.isnan(new.values[name]))
        assert np.abs(new.times_ns() - old.times_ns())[received].max() <= 2
        error = np.abs(new.values[name] - old.values[name])[received].max()
        assert error <= limit / 32767 / 2 * 1.001
        assert any(f"samples of {name} are rounded to {limit / 32767:.3g}" in note for note in notes)
        was, now = before.channels[name], back.channels[name]
        assert (now.quantity, now.unit, now.direction, now.position_m) == (
            was.quantity, was.unit, was.direction, was.position_m,
        )  # fmt: skip
        assert now.range == pytest.approx(was.range, rel=1e-7)
    assert back.device_of("acc1").overload["acc1"] == 2
    assert {channel.device for channel in back.channels.values()} == {"can1", "can2", "can3"}


def test_what_came_over_can_stays_bit_for_bit(original: Path, tmp_path: Path) -> None:
    """The second way through changes nothing: values that are whole steps of the range stay what they are."""
    (tmp_path / "once").mkdir()
    (tmp_path / "twice").mkdir()
    there_and_back(original, tmp_path / "once")
    back, _ = there_and_back(tmp_path / "once" / "back.mcap", tmp_path / "twice")
    first = read_run(tmp_path / "once" / "back.mcap")
    for name in RANGES:
        a, b = (np.asarray(run.device_of(name).values[name]) for run in (first, back))
        assert np.array_equal(a.view(np.uint32), b.view(np.uint32))


def test_cantools_and_python_can_read_the_file_as_strangers(original: Path, tmp_path: Path) -> None:
    convert(original, tmp_path / "log.blf", formats=WITH_BLF)
    run = read_run(original)
    values: dict[tuple[int, str], dict[int, float]] = {}
    infos, syncs, stamps = {}, {}, []
    for message in can.BLFReader(tmp_path / "log.blf"):
        assert message.is_fd
        stamps.append(message.timestamp)
        fields = DATABASE.decode_message(message.arbitration_id, bytes(message.data), allow_truncated=True)
        name = DATABASE.get_message_by_frame_id(message.arbitration_id).name
        if name == "ChannelInfo":
            text = b"".join(fields[f"Name{k}"].to_bytes(8, "little") for k in range(3)).rstrip(b"\0").decode()
            infos[message.channel, f"Samples{fields['Channel']}"] = text, fields["Range"], str(fields["Quantity"])
        elif name == "TimeSync":
            syncs[message.channel, fields["Counter"]] = fields["TimeNs"]
        elif name.startswith("Samples"):
            row = values.setdefault((message.channel, name), {})
            row.update({fields["Counter"] + k: fields[f"S{k:02d}"] for k in range((len(message.data) - 4) // 2)})
    assert {name for name, _, _ in infos.values()} == set(RANGES)
    for key, row in values.items():
        name, limit, quantity = infos[key]
        device = run.device_of(name)
        assert quantity == run.channels[name].quantity
        numbers = np.array(sorted(row))
        expected = device.values[name][numbers - device.first_index]
        assert not np.isnan(expected).any()
        assert len(numbers) == np.count_nonzero(~np.isnan(device.values[name]))
        decoded = np.array([row[number] for number in numbers]) * limit
        assert np.abs(decoded - expected).max() <= limit / 32767 / 2 * 1.001
    times = run.devices["daq"].times_ns()
    daq = {counter: time_ns for (bus, counter), time_ns in syncs.items() if bus == 0}
    assert {0, 2560, 7750} <= set(daq)  # the start, 100 ms later, and where the clock steps
    assert all(abs(time_ns - times[counter]) <= 2 for counter, time_ns in daq.items())
    assert stamps == sorted(stamps)


def strangers_log(path: Path, *, described: bool = True, synced: bool = True, counter: int = 0) -> np.ndarray:
    """A log made with cantools and python-can alone, with frames of another program in between."""
    rng = np.random.default_rng(2)
    steps = rng.integers(-32767, 32768, 300)
    with can.BLFWriter(path) as writer:

        def put(name: str, fields: dict[str, object], at_s: float) -> None:
            message = DATABASE.get_message_by_name(name)
            writer.on_message_received(
                can.Message(
                    arbitration_id=message.frame_id, data=message.encode(fields, strict=False, padding=False),
                    is_extended_id=False, is_fd=True, timestamp=1.7e9 + at_s,
                )
            )  # fmt: skip

        if described:
            put("ChannelInfo", {
                "Channel": 0, "Channels": 1, "Quantity": "acceleration", "Direction": -1, "Range": 100.0,
                "Position": 0.25, "Name0": int.from_bytes(b"tip", "little"), "Name1": 0, "Name2": 0,
                "Unit": int.from_bytes(b"m/s^2", "little"),
            }, 0.0)  # fmt: skip
        if synced:
            put("TimeSync", {"Counter": counter, "TimeNs": 5_000_000_000, "Pulse": 0, "SampleRate": 1000.0}, 0.0)
        for start in range(0, 300, 30):
            fields = {f"S{k:02d}": steps[start + k] / 32767 for k in range(30)}
            put("Samples0", {"Counter": (counter + start) % 2**32, **fields}, start / 1000)
            writer.on_message_received(can.Message(arbitration_id=0x7E0, data=b"\x01", is_extended_id=False))
        put("Heartbeat", {"State": "IDLE", "Channels": 1, "UptimeMs": 12, "ErrorState": "ACTIVE", "BusLoad": 9}, 0.3)
    return steps


def test_log_of_another_program_is_read_and_what_is_foreign_is_counted(tmp_path: Path) -> None:
    steps = strangers_log(tmp_path / "log.blf", counter=2**32 - 100)  # the counter wraps
    (note,) = convert(tmp_path / "log.blf", tmp_path / "run.mcap", formats=WITH_BLF)
    assert note == "10 frames that are not in the node's database: left out"
    run = read_run(tmp_path / "run.mcap")
    np.testing.assert_allclose(run.devices["can1"].values["tip"], steps * (100 / 32767), rtol=1e-6)
    assert run.channels["tip"].direction == "-y"
    assert run.devices["can1"].first_index == 2**32 - 100
    assert run.devices["can1"].times_ns()[[0, -1]].tolist() == [5_000_000_000, 5_299_000_000]
    assert [event.kind for event in run.events] == ["not-converted"]


@pytest.mark.parametrize(
    ("missing", "reason"),
    [("described", "no frame says what it measures"), ("synced", "no time sync says when")],
)
def test_log_that_cannot_be_scaled_or_timed_is_refused(tmp_path: Path, missing: str, reason: str) -> None:
    strangers_log(tmp_path / "log.blf", **{missing: False})
    with pytest.raises(InputError, match=reason):
        read_blf(tmp_path / "log.blf")


def test_channel_without_a_range_and_names_that_do_not_fit(tmp_path: Path) -> None:
    def write(name: str, **options: float) -> Path:
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.mcap"
        channel = Channel(name=name, quantity="force", unit="N", device="daq", **options)
        with RunWriter(path, info={"source": "simulated"}, channels=[channel]) as writer:
            writer.write_event(Event(time_ns=3, source="daq", kind="overrun"))
            writer.write_block(
                SampleBlock(
                    device="daq", time_ns=1, first_index=0, sample_rate_Hz=10.0,
                    samples={name: np.array([0.5, np.nan, -3.0], np.float32)},
                )
            )  # fmt: skip
        return path

    told = " ".join(convert(write("f"), tmp_path / "a.blf", formats=WITH_BLF))
    for words in ("f has no range: its largest value, 3,", "1 events", "simulated", "1 samples of f are no numbers"):
        assert words in told
    back = read_blf(tmp_path / "a.blf").devices["can1"]
    np.testing.assert_allclose(back.values["f"], [0.5, np.nan, -3.0], atol=1e-4)
    assert "goes beyond its range of 1 N" in " ".join(
        convert(write("g", range=1.0), tmp_path / "b.blf", formats=WITH_BLF)
    )
    with pytest.raises(InputError, match="at most 24 ASCII"):
        convert(write("a name that is longer than that"), tmp_path / "c.blf", formats=WITH_BLF)
    assert not (tmp_path / "c.blf").exists()


def test_two_streams_of_one_log_follow_each_other(tmp_path: Path) -> None:
    """A node that was stopped and started again counts from 0 again."""
    with can.BLFWriter(tmp_path / "log.blf") as writer:

        def put(identifier: int, data: bytes) -> None:
            message = can.Message(
                arbitration_id=identifier, data=data, is_extended_id=False, is_fd=True, timestamp=1.7e9
            )
            writer.on_message_received(message)

        info = struct.pack("<BBBbff24s8s", 0, 1, 0, 1, 32767.0, 0.1, b"force", b"N").ljust(48, b"\0")
        put(0x182, info)
        for start_s in (1, 2):
            put(0x080, struct.pack("<IqId", 0, start_s * 10**9, 0xFFFFFFFF, 100.0))
            for first in (0, 30):
                put(0x100, struct.pack("<I30h", first, *range(first, first + 30)))
    run = read_blf(tmp_path / "log.blf")
    device = run.devices["can1"]
    received = device.values["force"][~np.isnan(device.values["force"])]
    assert received.tolist() == [*range(60), *range(60)]
    assert [gap.count for gap in device.gaps] == [40]


def test_file_cut_short_gives_its_whole_containers_and_says_so(original: Path, tmp_path: Path) -> None:
    convert(original, tmp_path / "log.blf", formats=WITH_BLF)
    data = (tmp_path / "log.blf").read_bytes()
    whole = read_blf(tmp_path / "log.blf")
    (tmp_path / "cut.blf").write_bytes(data[: len(data) - 2000])
    cut = read_blf(tmp_path / "cut.blf")
    assert 0 < len(cut.devices["can1"]) < len(whole.devices["can1"])
    assert "cut short" in cut.events[0].detail


def container(inner: bytes, *, method: int = 2, size: int | None = None) -> bytes:
    body = zlib.compress(inner) if method == 2 else inner
    length = 16 + 16 + len(body) if size is None else size
    head = struct.pack("<4sHHLL", b"LOBJ", 16, 1, length, 10) + struct.pack("<H6xL4x", method, len(inner))
    return head + body + bytes(length % 4)


HEADER = struct.pack("<4sL", b"LOGG", 144).ljust(144, b"\0")


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "not a BLF file"),
        (b"LOGG" + bytes(200), "claims a length of 0"),
        (HEADER + b"rubbish that goes on", "no object of a BLF file"),
        (HEADER + container(b"", size=16), "shorter than its own head"),
        (HEADER + container(struct.pack("<4sHHLL", b"LOBJ", 32, 1, 0, 1) + bytes(64)), "an object of 0 bytes"),
        (HEADER + container(struct.pack("<4sHHLL", b"LOBJ", 32, 1, 1 << 30, 1) + bytes(64)), "object of 1073741824"),
        (HEADER + container(bytes(100)), "no object at byte 0"),
        (HEADER + container(b"x", method=7), "compressed by method 7"),
        (HEADER + container(bytes(65 << 20)), "container of more than"),
        (HEADER, "holds no samples"),
    ],
    ids=lambda value: None if isinstance(value, bytes) else value.replace(" ", "-"),
)
def test_rubbish_is_refused_with_its_place(tmp_path: Path, data: bytes, reason: str) -> None:
    path = tmp_path / "bad.blf"
    path.write_bytes(data)
    with pytest.raises(InputError, match=reason) as caught:
        read_blf(path)
    assert "bad.blf" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.fixture(scope="module")
def small_log(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bytes, bytes]:
    """A small log, and what is in its only container."""
    path = tmp_path_factory.mktemp("fuzz") / "log.blf"
    strangers_log(path)
    data = path.read_bytes()
    inner = zlib.decompress(data[144 + 32 :])
    return path, data, inner


@pytest.mark.parametrize("layer", ["file", "frames"])
@settings(max_examples=500)
@given(seed=st.integers(0, 2**32))
def test_damaged_logs_are_read_or_refused_never_worse(
    small_log: tuple[Path, bytes, bytes], layer: str, seed: int
) -> None:
    """A few bytes changed, cut out or put in, in the file or below its compression."""
    path, data, inner = small_log
    rng = random.Random(seed)
    damaged = bytearray(inner if layer == "frames" else data)
    for _ in range(rng.randint(1, 6)):
        at = rng.randrange(len(damaged))
        kind = rng.random()
        if kind < 0.7:
            damaged[at] = rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))
        elif kind < 0.85:
            del damaged[at : at + rng.randint(1, 40)]
        else:
            damaged[at:at] = rng.randbytes(rng.randint(1, 40))
    path = path.with_name(f"{layer}.blf")
    path.write_bytes(HEADER + container(bytes(damaged)) if layer == "frames" else bytes(damaged))
    with contextlib.suppress(InputError):
        assert all(len(device) < 1 << 22 for device in read_blf(path).devices.values())


def test_command_converts_to_blf_tells_the_loss_and_back(original: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "twin", "convert"]
    log, back = str(tmp_path / "run.blf"), str(tmp_path / "back.mcap")
    result = subprocess.run([*command, str(original), log, "--json"], capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    assert any("rounded to 0.00153 N, 16 bits of 50" in note for note in json.loads(result.stdout)["notes"])
    result = subprocess.run([*command, log, back], capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    decoded = subprocess.run(
        [sys.executable, "-m", "can.logconvert", log, str(tmp_path / "run.asc")], capture_output=True, timeout=300
    )
    assert decoded.returncode == 0
    assert (tmp_path / "run.asc").read_text().count("CANFD") > 1000
