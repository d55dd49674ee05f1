"""Runs of other programs are read, and whatever breaks the contract is refused with its place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap_protobuf.decoder import DecoderFactory
from recording_builders import START_NS, ForeignWriter, RATE_Hz, block_at, write_run

from recordings import Channel, InputError, Limits, SampleBlock, StepState, read_run

FOREIGN = Path(__file__).parents[1] / "data" / "recordings" / "foreign.mcap"


@pytest.mark.parametrize("compression", list(CompressionType))
def test_file_of_an_independent_writer_is_read(tmp_path: Path, compression: CompressionType) -> None:
    writer = ForeignWriter(tmp_path / "run.mcap", compression=compression)
    writer.message(
        "/procedure", "Step", START_NS, sweep="a", index=3, frequency=25.5, target_channel="force",
        target_amplitude=1.5, state=1,
    )  # fmt: skip
    for number in range(3):
        writer.block(block_at(number * 256), note="a field of the future")
    writer.message("/events", "Event", START_NS + 7, source="daq", kind="overload", detail="force")
    writer.message("/indicators/force_rms", "Indicator", START_NS + 8, value=1.06, unit="N")
    writer.message("/lab/humidity", "Indicator", START_NS + 9, value=41.0, unit="%")
    run = read_run(writer.finish())
    device = run.devices["daq"]
    assert (device.sample_rate_Hz, len(device), device.gaps) == (RATE_Hz, 768, ())
    np.testing.assert_array_equal(device.values["force"], block_at(0, 768).samples["force"])
    assert run.channels["acc1"] == Channel(
        name="acc1", quantity="acceleration", unit="m/s^2", position_m=0.3, direction="-y", range=490.0
    )
    step = run.steps[0]
    assert (step.time_ns, step.sweep, step.index, step.frequency_Hz) == (START_NS, "a", 3, 25.5)
    assert step.state is StepState.MEASURING
    assert [(event.kind, event.detail) for event in run.events] == [("overload", "force")]
    assert [(value.name, value.value, value.unit) for value in run.indicators] == [("force_rms", 1.06, "N")]
    assert run.info["stored"] == "all"


def test_recording_of_an_unrelated_program_is_read_as_the_stock_reader_sees_it() -> None:
    run = read_run(FOREIGN)
    blocks = []
    with FOREIGN.open("rb") as stream:
        for _, channel, _, message in make_reader(stream, True, [DecoderFactory()]).iter_decoded_messages():
            if channel.topic == "/samples/daq":
                blocks.append(message)
    for place, name in enumerate(("force", "acc1", "acc2")):
        expected = np.concatenate([np.array(block.series[place].samples, dtype=np.float32) for block in blocks])
        np.testing.assert_array_equal(run.devices["daq"].values[name], expected)
    assert (run.info["stored"], run.info["preload_N"]) == ("settled", "120")
    assert set(run.attachments) == {"rig.toml", "procedure.toml"}
    assert len(run.steps) == 83


def broken(tmp_path: Path, change: str) -> Path:
    """A file with one breach of the contract."""
    writer = ForeignWriter(tmp_path / "run.mcap", enable_crcs=change != "no checksum")
    key = change.partition(" ")[2]
    if change.startswith("without "):
        del writer.run[key]
    elif change.startswith("channel without "):
        del writer.channels["acc1"][change.split()[-1]]
    elif change == "unknown channel":
        del writer.channels["acc1"]
    elif "=" in change:
        name, value = change.split("=")
        (writer.channels["acc1"] if name in writer.channels["acc1"] else writer.run)[name] = value
    series = {"force": np.zeros(4, np.float32), "acc1": np.zeros(3 if change == "ragged" else 4, np.float32)}
    block = SampleBlock(device="daq", time_ns=START_NS, first_index=0, sample_rate_Hz=RATE_Hz, samples=series)
    if change == "two of a channel":
        twice = [writer.types["rig.Series"](channel="force", samples=[1.0])] * 2
        writer.message("/samples/daq", "SampleBlock", START_NS, sample_rate=1.0, series=twice)
    elif change == "no rate":
        writer.block(block, sample_rate=0.0)
    elif change == "no timestamp":
        writer.raw("/events", "rig.Event", START_NS, writer.types["rig.Event"](kind="x").SerializeToString())
    elif change == "nanos":
        message = writer.types["rig.Event"](kind="x")
        message.timestamp.nanos = 2_000_000_000
        writer.raw("/events", "rig.Event", START_NS, message.SerializeToString())
    elif change == "rubbish":
        writer.raw("/procedure", "rig.Step", START_NS, b"\xff\xff\xff")
    elif change == "wrong schema":
        writer.raw("/procedure", "rig.Event", START_NS, b"")
    elif change == "wrong encoding":
        writer.raw("/procedure", "rig.Step", START_NS, b"{}", encoding="json")
    elif change == "unknown state":
        writer.message("/procedure", "Step", START_NS, sweep="a", state=9)
    elif change == "infinite frequency":
        writer.message("/procedure", "Step", START_NS, sweep="a", frequency=float("inf"))
    elif change == "overload":
        crowded = writer.types["rig.Series"](channel="force", samples=[1.0], overload=2)
        writer.message("/samples/daq", "SampleBlock", START_NS, sample_rate=1.0, series=[crowded])
    else:
        writer.block(block)
    if change == "rate changes":
        writer.block(block_at(256), sample_rate=RATE_Hz * 1.01)
    if change == "time runs back":
        writer.block(block_at(256), time_ns=START_NS - 10_000_000)
    if change == "two devices":
        writer.block(SampleBlock(**{**block.__dict__, "device": "can"}))
    if change == "channel of two devices":
        writer.channels["acc1"]["device"] = "can"
    return writer.finish()


@pytest.mark.parametrize(
    ("change", "place", "reason"),
    [
        ("without format", "metadata 'run'", "no key 'format'"),
        ("without source", "metadata 'run'", "no key 'source'"),
        ("without started", "metadata 'run'", "no key 'started'"),
        ("format=2", "metadata 'run'", "format '2'"),
        ("source=dreamt", "metadata 'run'", "source is 'dreamt'"),
        ("stored=some", "metadata 'run'", "stored is 'some'"),
        ("started=yesterday", "metadata 'run'", "ISO 8601"),
        ("started=2026-01-01T00:00:00+02:00", "metadata 'run'", "not in UTC"),
        ("preload_N=much", "metadata 'run'", "preload_N"),
        ("channel without quantity", "metadata 'channel/acc1'", "no key 'quantity'"),
        ("channel without unit", "metadata 'channel/acc1'", "no key 'unit'"),
        ("unit=g", "metadata 'channel/acc1'", "unit of acceleration is 'g'"),
        ("quantity=jerk", "metadata 'channel/acc1'", "quantity is 'jerk'"),
        ("direction=up", "metadata 'channel/acc1'", "direction 'up' is not +x"),
        ("position_m=nan", "metadata 'channel/acc1'", "position_m is 'nan'"),
        ("range=-5", "metadata 'channel/acc1'", "range"),
        ("unknown channel", "metadata 'channel/acc1'", "is missing"),
        ("channel of two devices", "metadata 'channel/acc1'", "says device 'can'"),
        ("ragged", "message 1 of '/samples/daq'", "different lengths"),
        ("two of a channel", "message 1 of '/samples/daq'", "stands twice"),
        ("no rate", "message 1 of '/samples/daq'", "sample_rate is 0.0"),
        ("no timestamp", "message 1 of '/events'", "no timestamp"),
        ("nanos", "message 1 of '/events'", "timestamp"),
        ("rubbish", "message 1 of '/procedure'", "no rig.Step"),
        ("wrong schema", "message 1 of '/procedure'", "has the schema 'rig.Event'"),
        ("wrong encoding", "message 1 of '/procedure'", "not encoded as protobuf"),
        ("unknown state", "message 1 of '/procedure'", "state 9"),
        ("infinite frequency", "message 1 of '/procedure'", "frequency is inf"),
        ("overload", "message 1 of '/samples/daq'", "overload"),
        ("rate changes", "message 2 of '/samples/daq'", "sample rate changes"),
        ("time runs back", "message 2 of '/samples/daq'", "contradict"),
        ("two devices", "message 1 of '/samples/can'", "also one of device 'daq'"),
        ("no checksum", "chunk at byte", "without checksum"),
    ],
)
def test_breach_of_the_contract_is_refused_with_its_place(tmp_path: Path, change: str, place: str, reason: str) -> None:
    path = broken(tmp_path, change)
    with pytest.raises(InputError) as caught:
        read_run(path)
    assert caught.value.source == str(path)
    assert place in caught.value.place
    assert reason in caught.value.reason
    assert "\n" not in str(caught.value)


def test_schema_with_other_field_types_is_refused(tmp_path: Path) -> None:
    """first_index as a varint would be silently read as something else."""
    writer = ForeignWriter(tmp_path / "run.mcap")
    writer.schema = writer.schema.replace(b"\x0bfirst_index\x18\x02 \x01(\x06", b"\x0bfirst_index\x18\x02 \x01(\x04")
    writer.block(block_at(0))
    with pytest.raises(InputError, match=r"field 2 of rig\.SampleBlock is not 'first_index'"):
        read_run(writer.finish())


@pytest.mark.parametrize(
    ("limits", "reason"),
    [
        (Limits(values=100), "more than 100 samples"),
        (Limits(messages=5), "more than 5 messages"),
        (Limits(text_bytes=20), "more than 20 bytes of steps"),
        (Limits(attachment_bytes=3), "more than 3 bytes of attachments"),
        (Limits(record_bytes=1000), "more than"),
    ],
)
def test_limits_hold(tmp_path: Path, limits: Limits, reason: str) -> None:
    path = write_run(tmp_path / "run.mcap", blocks=8)
    assert read_run(path)
    with pytest.raises(InputError, match=reason):
        read_run(path, limits=limits)


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.LZ4])
def test_chunk_that_unpacks_to_far_more_is_refused(tmp_path: Path, compression: CompressionType) -> None:
    """A gigabyte of zeros fits into a file of a few kilobytes (zstd) or megabytes (lz4)."""
    writer = ForeignWriter(tmp_path / "run.mcap", compression=compression, chunk_size=1 << 28)
    for _ in range(8):
        writer.raw("/lab/zeros", "rig.Event", START_NS, bytes(1 << 24))
    path = writer.finish()
    assert path.stat().st_size < 2 << 20
    with pytest.raises(InputError, match="more than 16777216"):
        read_run(path, limits=Limits(record_bytes=1 << 24))
