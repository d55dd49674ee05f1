"""Damaged files: what is wrong is told, and every complete message comes out of them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader, breakup_chunk
from recording_builders import START_NS, ForeignWriter, block_at, write_run

from recordings import Gap, InputError, RunWriter, read_run
from recordings.check import check_run
from recordings.recover import recover

FOREIGN = Path(__file__).parents[1] / "data" / "recordings" / "foreign.mcap"


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_run(tmp_path_factory.mktemp("run") / "run.mcap", blocks=400, compression="none")


def chunks(path: Path) -> list[tuple[int, int, list[int]]]:
    """Start, end and block numbers of each chunk, by the stock reader."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        assert summary is not None
        found = []
        for index in sorted(summary.chunk_indexes, key=lambda index: index.chunk_start_offset):
            stream.seek(index.chunk_start_offset)
            reader = StreamReader(stream, skip_magic=True, emit_chunks=True)
            chunk = next(record for record in reader.records if isinstance(record, Chunk))
            topics = {number: channel.topic for number, channel in summary.channels.items()}
            numbers = [
                round((message.log_time - START_NS) / 1e7)
                for message in breakup_chunk(chunk)
                if hasattr(message, "log_time") and topics[message.channel_id] == "/samples/daq"
            ]
            found.append((index.chunk_start_offset, index.chunk_start_offset + index.chunk_length, numbers))
        return found


def numbers_of(path: Path) -> list[int]:
    """Numbers of the blocks a run holds, after comparing every value with what was written."""
    device = read_run(path).devices["daq"]
    received = np.flatnonzero(~np.isnan(device.values["force"])) + device.first_index
    expected = block_at(0, int(received[-1]) + 1).samples
    for name, values in device.values.items():
        np.testing.assert_array_equal(values[received - device.first_index], expected[name][received])
    assert len(received) % 256 == 0
    return sorted({int(number) // 256 for number in received})


def test_sound_file_has_no_problem(sound: Path) -> None:
    report = check_run(sound)
    assert report.sound
    assert report.problems == ()
    assert [(c.name, c.unit, c.samples, c.lost, c.overload) for c in report.channels] == [
        ("force", "N", 102400, 0, 0), ("acc1", "m/s^2", 102400, 0, 0),
    ]  # fmt: skip
    assert report.messages == {"/samples/daq": 400, "/procedure": 3}
    assert report.duration_s == pytest.approx(4.0)


@pytest.mark.parametrize("cut", [0.1, 0.35, 0.5, 0.77, 0.999])
def test_cut_file_gives_every_complete_message(sound: Path, tmp_path: Path, cut: float) -> None:
    data = sound.read_bytes()
    length = int(len(data) * cut)
    path, out = tmp_path / "cut.mcap", tmp_path / "out.mcap"
    path.write_bytes(data[:length])
    complete = [number for _, end, numbers in chunks(sound) if end <= length for number in numbers]
    with pytest.raises(InputError, match="twin check --recover"):
        read_run(path)
    assert not check_run(path).sound
    result = recover(path, out)
    assert result.sound
    kept = numbers_of(out)
    assert kept[: len(complete)] == complete
    # Of an uncompressed chunk that was cut, the messages before the cut are there as well: 2.1 kB a block.
    beyond = length - max(end for _, end, _ in chunks(sound) if end <= length)
    assert len(kept) >= min(400, len(complete) + beyond // 2200 - 1)
    (event,) = read_run(out).events
    assert (event.kind, event.source) == ("recovered", "recovery")
    assert "cut short" in event.detail or "summary" in event.detail or cut > 0.99


HITS = {"opcode": 0, "length": 2, "high length": 7, "size": 25, "checksum": 33, "compression": 37, "inner length": 41}


@pytest.mark.parametrize("hit", HITS)
def test_hit_in_the_head_of_a_chunk_costs_at_most_that_chunk(sound: Path, tmp_path: Path, hit: str) -> None:
    parts = chunks(sound)
    data = bytearray(sound.read_bytes())
    data[parts[3][0] + HITS[hit]] ^= 0x10
    path, out = tmp_path / "hit.mcap", tmp_path / "out.mcap"
    path.write_bytes(data)
    with pytest.raises(InputError):
        read_run(path)
    assert recover(path, out).sound
    everything = [number for _, _, numbers in parts for number in numbers]
    without = [number for number in everything if number not in parts[3][2]]
    assert numbers_of(out) == (everything if hit in ("opcode", "length", "high length") else without)


def test_every_flipped_bit_is_noticed(tmp_path: Path) -> None:
    """No single flipped byte anywhere passes for sound: our files carry a checksum over everything."""
    data = write_run(tmp_path / "run.mcap", blocks=12, compression="none").read_bytes()
    path = tmp_path / "hit.mcap"
    rng = np.random.default_rng(5)
    places = [*range(0, 1200, 7), *rng.integers(0, len(data), 60), *range(len(data) - 700, len(data), 7)]
    for place in places:
        changed = bytearray(data)
        changed[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(changed)
        assert not check_run(path).sound, place


def test_damaged_chunk_is_told_with_what_was_in_it(sound: Path, tmp_path: Path) -> None:
    parts = chunks(sound)
    data = bytearray(sound.read_bytes())
    data[parts[2][0] + 5000] ^= 1
    path, out = tmp_path / "hit.mcap", tmp_path / "out.mcap"
    path.write_bytes(data)
    report = check_run(path)
    assert report.messages_lost == {"/samples/daq": len(parts[2][2])}
    first, count = parts[2][2][0] * 256, len(parts[2][2]) * 256
    assert recover(path, out).messages_lost == report.messages_lost
    run = read_run(out)
    assert run.devices["daq"].gaps == (Gap(device="daq", first_index=first, count=count),)
    assert f"{len(parts[2][2])} of /samples/daq" in run.events[0].detail
    assert set(run.attachments) == {"rig.toml"}


def test_hole_in_the_middle_is_stepped_over(sound: Path, tmp_path: Path) -> None:
    """A lost disk block: 4096 bytes of zeros across the boundary of two chunks; the ones after still come out."""
    parts = chunks(sound)
    data = bytearray(sound.read_bytes())
    data[parts[3][1] - 1000 : parts[3][1] + 3096] = bytes(4096)
    path, out = tmp_path / "hole.mcap", tmp_path / "out.mcap"
    path.write_bytes(data)
    assert recover(path, out).sound
    expected = [number for place, (_, _, numbers) in enumerate(parts) if place not in (3, 4) for number in numbers]
    assert numbers_of(out) == expected


def test_first_chunk_and_summary_both_lost(tmp_path: Path) -> None:
    """No copy of the topics' descriptions is left: the messages' own bytes tell what they are."""
    writer = ForeignWriter(tmp_path / "run.mcap", chunk_size=8000)
    writer.writer.add_metadata("run", writer.run)
    for name, record in writer.channels.items():
        writer.writer.add_metadata(f"channel/{name}", record)
    for number in range(40):
        writer.block(block_at(number * 256))
        if number % 10 == 5:
            writer.message("/procedure", "Step", block_at(number * 256).time_ns, sweep="a", index=number, state=1)
            writer.message("/events", "Event", block_at(number * 256).time_ns, source="daq", kind="limit")
    parts = chunks(writer.finish())
    data = bytearray(writer.path.read_bytes()[: parts[-1][1]])
    data[parts[0][0] + 300] ^= 1
    writer.path.write_bytes(data)
    assert recover(writer.path, tmp_path / "out.mcap").sound
    assert numbers_of(tmp_path / "out.mcap") == [number for _, _, numbers in parts[1:] for number in numbers]
    run = read_run(tmp_path / "out.mcap")
    assert [step.index for step in run.steps] == [5, 15, 25, 35]
    assert [event.kind for event in run.events] == [*["limit"] * 4, "recovered"]


def test_a_summary_need_not_have_statistics(tmp_path: Path) -> None:
    """Which MCAP leaves to the writer."""
    writer = ForeignWriter(tmp_path / "run.mcap", use_statistics=False)
    for number in range(4):
        writer.block(block_at(number * 256))
    assert check_run(writer.finish()).sound
    assert len(read_run(writer.path).devices["daq"].values["acc1"]) == 4 * 256


def test_unknown_topics_survive_and_breaches_are_set_aside(tmp_path: Path) -> None:
    writer = ForeignWriter(tmp_path / "run.mcap")
    writer.block(block_at(0))
    writer.raw("/lab/camera", "rig.Event", START_NS, b"\x01\x02")
    writer.message("/procedure", "Step", START_NS, sweep="a", state=7)
    writer.block(block_at(128, seed=3))
    result = recover(writer.finish(), tmp_path / "out.mcap")
    assert result.sound
    assert result.kept == {"/samples/daq": 1, "/lab/camera": 1}
    assert result.set_aside == {"/unsound/procedure": 1, "/unsound/samples/daq": 1}
    with (tmp_path / "out.mcap").open("rb") as stream:
        data = {channel.topic: message.data for _, channel, message in make_reader(stream).iter_messages()}
        stream.seek(0)
        names = [record.name for record in make_reader(stream).iter_metadata()]
    assert data["/lab/camera"] == b"\x01\x02"
    assert "weather" in names


def test_all_problems_are_listed(tmp_path: Path) -> None:
    writer = ForeignWriter(tmp_path / "run.mcap")
    writer.run["source"] = "dreamt"
    writer.channels["acc1"]["unit"] = "g"
    writer.block(block_at(0))
    writer.message("/procedure", "Step", START_NS, sweep="a", state=7)
    writer.message("/procedure", "Step", START_NS, sweep="a", frequency=-1.0)
    report = check_run(writer.finish())
    assert [problem.kind for problem in report.problems if problem.kind != "warning"] == ["contract"] * 4
    assert {problem.place.split(" (")[0] for problem in report.problems if problem.kind == "contract"} == {
        "metadata 'run'", "metadata 'channel/acc1'", "message 1 of '/procedure'", "message 2 of '/procedure'",
    }  # fmt: skip


def twin(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "twin", "check", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def test_command_tells_sound_from_damaged_from_unreadable(sound: Path, tmp_path: Path) -> None:
    cut, out = tmp_path / "cut.mcap", tmp_path / "out.mcap"
    cut.write_bytes(sound.read_bytes()[:300_000])
    result = twin(sound, "--json")
    assert result.returncode == 0
    assert json.loads(result.stdout)["sound"] is True
    result = twin(cut, "--recover", out, "--json")
    assert result.returncode == 1
    told = json.loads(result.stdout)
    assert (told["sound"], told["recovered"]["sound"]) == (False, True)
    assert twin(out).returncode == 0
    again = twin(cut, "--recover", out)
    assert (again.returncode, again.stdout) == (2, "")
    assert again.stderr.strip().splitlines()[-1].endswith("exists already; give another name, or --overwrite")
    for path in (tmp_path / "none.mcap", Path(__file__), tmp_path):
        result = twin(path)
        assert (result.returncode, result.stdout) == (2, "")
        assert len(result.stderr.strip().splitlines()) == 1
        assert str(path) in result.stderr


def test_command_checks_tables_too(tmp_path: Path) -> None:
    table = FOREIGN.with_name("brake_reuss_response_control.csv")
    result = twin(table, "--json")
    assert result.returncode == 0
    assert json.loads(result.stdout)["rows"] == 328
    (tmp_path / "bad.csv").write_text("mode,frequency_Hz\n1,x\n")
    result = twin(tmp_path / "bad.csv")
    assert (result.returncode, result.stdout) == (2, "")
    assert "line 2, column frequency_Hz" in result.stderr


def test_names_from_a_file_cannot_steer_the_terminal(tmp_path: Path) -> None:
    writer = ForeignWriter(tmp_path / "run.mcap")
    writer.channels["acc\x1b[2J"] = writer.channels.pop("acc1")
    writer.message("/events", "Event", START_NS, source="\x1b[31m", kind="\x1b]0;evil\x07", detail="\r\n")
    writer.message("/procedure", "Step", START_NS, sweep="\x1b[1m", state=8)
    writer.block(block_at(0))
    writer.raw("/samples/\x1b[5m", "rig.Event", START_NS, b"")
    path = writer.finish()
    assert "\x1b" not in twin(path).stderr
    with pytest.raises(InputError) as caught:
        read_run(path)
    assert "\x1b" not in str(caught.value)


def test_recovered_foreign_file_keeps_its_bytes(tmp_path: Path) -> None:
    data = bytearray(FOREIGN.read_bytes())
    data[-300] ^= 1  # in the summary: every message is still there
    (tmp_path / "hit.mcap").write_bytes(data)
    assert recover(tmp_path / "hit.mcap", tmp_path / "out.mcap").sound
    with FOREIGN.open("rb") as a, (tmp_path / "out.mcap").open("rb") as b:
        old, new = (
            [
                (channel.topic, message.log_time, message.publish_time, message.data)
                for _, channel, message in make_reader(stream, True).iter_messages(log_time_order=False)
                if channel.topic != "/events"
            ]
            for stream in (a, b)
        )
    assert new == old


def test_file_without_samples_is_sound(tmp_path: Path) -> None:
    with RunWriter(tmp_path / "run.mcap", info={"source": "measured"}, channels=[]):
        pass
    report = check_run(tmp_path / "run.mcap")
    assert report.sound
    assert [problem.kind for problem in report.problems] == ["warning"]
