"""What the writer puts on disk, seen by other programs, and what it leaves when it is killed or the disk is full."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from google.protobuf import descriptor_pb2
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap_protobuf.decoder import DecoderFactory
from needed import program
from recording_builders import CHANNELS, INFO, START_NS, RATE_Hz, block_at, step_at, write_run

from recordings import Channel, Event, Indicator, InputError, RunWriter, SampleBlock, Step, StepState, read_run
from recordings.check import check_run
from recordings.container.messages import encode_block
from recordings.container.opening import Opening
from recordings.container.schema import SAMPLE_BLOCK, message_class


def test_stock_reader_decodes_every_message(tmp_path: Path) -> None:
    path = write_run(tmp_path / "run.mcap", blocks=12)
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_summary() is not None
        decoded = [(channel.topic, message) for _, channel, _, message in reader.iter_decoded_messages()]
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        attachments = {record.name: record.data for record in reader.iter_attachments()}
    blocks = [message for topic, message in decoded if topic == "/samples/daq"]
    assert [block.first_index for block in blocks] == [256 * number for number in range(12)]
    assert blocks[5].sample_rate == RATE_Hz
    assert blocks[5].timestamp.ToNanoseconds() == block_at(5 * 256).time_ns
    assert {series.channel: list(series.samples) for series in blocks[5].series} == {
        name: values.tolist() for name, values in block_at(5 * 256).samples.items()
    }
    assert [message.state for topic, message in decoded if topic == "/procedure"] == [0, 1, 2]
    assert metadata["run"]["format"] == "1"
    assert metadata["channel/acc1"] == {
        "quantity": "acceleration", "unit": "m/s^2", "position_m": "0.3", "direction": "-y", "range": "490.0",
        "device": "daq",
    }  # fmt: skip
    assert attachments == {"rig.toml": b"x = 1\n"}


def test_schema_is_a_descriptor_set_with_its_dependency(tmp_path: Path) -> None:
    path = write_run(tmp_path / "run.mcap", blocks=1)
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    for schema in summary.schemas.values():
        files = descriptor_pb2.FileDescriptorSet.FromString(schema.data)
        assert [file.name for file in files.file] == ["google/protobuf/timestamp.proto", "rig.proto"]
        assert schema.encoding == "protobuf"


def test_numpy_packs_the_bytes_that_protobuf_would(tmp_path: Path) -> None:
    block = block_at(77, 300)
    block = SampleBlock(**{**block.__dict__, "overload": {"acc1": 200}})
    message = message_class(SAMPLE_BLOCK)(first_index=77, sample_rate=RATE_Hz)
    message.timestamp.FromNanoseconds(block.time_ns)
    for name, values in block.samples.items():
        message.series.add(channel=name, samples=values.tolist(), overload=block.overload.get(name, 0))
    assert encode_block(block) == message.SerializeToString(deterministic=True)


def test_rerun_finds_no_fault_in_the_file(tmp_path: Path) -> None:
    path = write_run(tmp_path / "run.mcap", blocks=12)
    result = subprocess.run([program("rerun"), "mcap", "check", str(path)], capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stdout + result.stderr
    rows = [line.split() for line in result.stdout.splitlines() if line.startswith(("ok", "warn", "err"))]
    assert rows
    assert {row[0] for row in rows} == {"ok"}


KILLED = """
import sys, time
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from recording_builders import CHANNELS, INFO, block_at
from recordings import RunWriter
with RunWriter(Path(sys.argv[1]), info=INFO, channels=CHANNELS, attachments={"rig.toml": b"x = 1"}) as writer:
    for number in range(100_000):
        if number == 60 and "stall" in sys.argv:
            time.sleep(60)
        writer.write_block(block_at(number * 256))
        print(number, flush=True)
        time.sleep(0.01)
"""


def topics_up_to_the_cut(path: Path) -> list[str]:
    """Topics of the messages that another program reads from a cut file."""
    topics: list[str] = []
    with path.open("rb") as stream, contextlib.suppress(McapError):
        for _, channel, _ in NonSeekingReader(stream).iter_messages(log_time_order=False):
            topics.append(channel.topic)
    return topics


@pytest.mark.parametrize("stall", [False, True], ids=["streaming", "stalled"])
def test_killed_writer_loses_at_most_half_a_second(tmp_path: Path, stall: bool) -> None:
    """`stalled`: the last block must reach the disk although nothing is written after it."""
    path = tmp_path / "run.mcap"
    arguments = [sys.executable, "-c", KILLED, str(path), str(Path(__file__).parent), "stall" if stall else ""]
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    written = []
    for line in process.stdout:
        written.append((time.monotonic(), int(line)))
        if len(written) == (60 if stall else 120):
            break
    if stall:
        time.sleep(0.6)
    os.kill(process.pid, signal.SIGKILL)
    killed_at = time.monotonic()
    rest = [int(line) for line in process.stdout]
    process.wait(timeout=300)
    process.stdout.close()
    report = check_run(path)
    must_have = [number for at, number in written if at < killed_at - 0.5]
    assert len(must_have) > 20
    kept = report.channels[0].samples // 256
    assert must_have[-1] < kept <= written[-1][1] + len(rest) + 2
    assert not report.sound
    assert topics_up_to_the_cut(path).count("/samples/daq") == kept
    with path.open("rb") as stream:
        early = stream.read(4096)
    for record in (b"channel/force", b"channel/acc1", b"rig.toml", b"simulated"):
        assert record in early


def test_run_reads_back_as_it_was_written(tmp_path: Path) -> None:
    event = Event(time_ns=START_NS + 5, source="daq", kind="overrun", detail="7 bytes")
    value = Indicator(name="force_rms", time_ns=START_NS + 9, value=1.25, unit="N")
    with RunWriter(tmp_path / "run.mcap", info={**INFO, "preload_N": "120"}, channels=CHANNELS) as writer:
        writer.write_block(block_at(0))
        writer.write_event(event)
        writer.write_indicator(value)
    run = read_run(tmp_path / "run.mcap")
    assert run.events == (event,)
    assert run.indicators == (value,)
    assert run.channels == {channel.name: channel for channel in CHANNELS}
    assert run.info["preload_N"] == "120"
    assert run.info["source"] == "simulated"
    np.testing.assert_array_equal(run.devices["daq"].values["acc1"], block_at(0).samples["acc1"])


def test_existing_file_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(b"precious")
    with pytest.raises(InputError, match="exists already"):
        RunWriter(path, info=INFO, channels=CHANNELS)
    assert path.read_bytes() == b"precious"
    write_run(path, blocks=2, overwrite=True)
    assert len(read_run(path).devices["daq"]) == 512


def test_folder_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"run\.mcap: cannot be written: no such file") as caught:
        RunWriter(tmp_path / "none" / "run.mcap", info=INFO, channels=CHANNELS)
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_full_disk_is_never_silent() -> None:
    """/dev/full takes no byte: the first flush must tell, and nothing may hang or pass over it."""
    with pytest.raises(InputError, match="no space left"):
        RunWriter("/dev/full", info=INFO, channels=CHANNELS, overwrite=True)


def test_disk_that_fills_up_is_told_at_the_next_call_and_at_the_end(tmp_path: Path) -> None:
    """A file-size limit stands for the full disk; what was written before stays recoverable."""
    code = """
import resource, signal, sys
sys.path.insert(0, sys.argv[2])
from recording_builders import CHANNELS, INFO, block_at
from recordings import InputError, RunWriter
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))
writer = RunWriter(sys.argv[1], info=INFO, channels=CHANNELS, compression="none")
number = 0
try:
    for number in range(1000):
        writer.write_block(block_at(number * 256))
except InputError as error:
    print(number, error)
try:
    writer.close()
except InputError as error:
    print("closing", error)
"""
    path = tmp_path / "run.mcap"
    result = subprocess.run(
        [sys.executable, "-c", code, str(path), str(Path(__file__).parent)],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert result.stderr == ""
    first, last = result.stdout.splitlines()
    assert "cannot be written: file too large" in first
    assert last.startswith("closing")
    assert check_run(path).channels[0].samples > 100 * 256
    assert int(first.split()[0]) < 200


def test_channel_that_was_not_announced_is_the_callers_mistake(tmp_path: Path) -> None:
    with RunWriter(tmp_path / "run.mcap", info=INFO, channels=CHANNELS[:1]) as writer:
        with pytest.raises(ValueError, match="not announced"):
            writer.write_block(block_at(0))
        with pytest.raises(ValueError, match="not announced"):
            writer.write_block(
                SampleBlock(device="can", time_ns=1, first_index=0, sample_rate_Hz=1.0, samples={"force": np.ones(2)})
            )


@pytest.mark.parametrize(
    ("info", "channel", "reason"),
    [
        ({"source": "guessed"}, CHANNELS[0], "source"),
        ({"source": "measured", "stored": "some"}, CHANNELS[0], "stored"),
        (INFO, Channel(name="f", quantity="force", unit="kN"), "unit"),
        (INFO, Channel(name="f", quantity="weight", unit="N"), "quantity"),
        (INFO, Channel(name="f", quantity="force", unit="N", direction="z"), "direction"),
    ],
)
def test_contract_is_checked_before_a_file_is_made(
    tmp_path: Path, info: dict[str, str], channel: Channel, reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        RunWriter(tmp_path / "run.mcap", info=info, channels=[channel])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "change",
    [{"frequency_Hz": float("nan")}, {"target_amplitude": -1.0}, {"time_ns": -1}, {"index": -1}],
    ids=lambda change: next(iter(change)),
)
def test_step_that_could_not_be_read_back_is_not_written(tmp_path: Path, change: dict[str, float]) -> None:
    step = step_at(START_NS, StepState.DONE)
    with RunWriter(tmp_path / "run.mcap", info=INFO, channels=CHANNELS) as writer:
        with pytest.raises(ValueError, match=r"cannot be recorded|[Oo]ut of range"):
            writer.write_step(Step(**{**step.__dict__, **change}))
        writer.write_step(step)
    assert read_run(tmp_path / "run.mcap").steps == (step,)


def test_error_inside_the_block_still_finishes_the_file(tmp_path: Path) -> None:
    def interrupted() -> None:
        with RunWriter(tmp_path / "run.mcap", info=INFO, channels=CHANNELS) as writer:
            writer.write_block(block_at(0))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert len(read_run(tmp_path / "run.mcap").devices["daq"]) == 256


def test_file_made_by_somebody_else_meanwhile_is_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.mcap"
    start = Opening.start

    def start_slowly(opening: Opening) -> None:
        start(opening)
        path.write_bytes(b"precious")

    monkeypatch.setattr(Opening, "start", start_slowly)
    with pytest.raises(InputError, match="exists already"):
        RunWriter(path, info=INFO, channels=CHANNELS)
    assert [each.name for each in tmp_path.iterdir()] == ["run.mcap"]
    assert path.read_bytes() == b"precious"


def test_file_system_without_hard_links_will_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError("no hard links here")

    monkeypatch.setattr(os, "link", refuse)
    path = write_run(tmp_path / "run.mcap", blocks=2)
    assert check_run(path).sound
    assert [each.name for each in tmp_path.iterdir()] == ["run.mcap"]
