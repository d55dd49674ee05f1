"""Samples that stay in the file are those that an array would hold, and take no memory for being many."""

from __future__ import annotations

import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from google.protobuf.internal.encoder import _VarintBytes
from recording_builders import INFO, block_at, write_run

import recordings.run
from recordings import Channel, InputError, Limits, RunWriter, read_run
from recordings.container import stored
from recordings.container.assemble import Assembler
from recordings.container.messages import decode_block, decode_series, encode_block
from recordings.container.stored import with_samples
from recordings.run import channel_blocks, pieces

FEW = Limits(held_samples=1024, gap_fill=300)
"""Four blocks are kept, so that nearly all is read again."""


@pytest.fixture(params=["lz4", "none"])
def disordered(request, tmp_path):
    """A file with a late block, one twice, two that overlap, a loss, a long loss and one without a channel."""
    whole = [block_at(number * 256) for number in range(40)]
    short = replace(block_at(4000, 100), samples={"force": block_at(4000, 100).samples["force"]})
    blocks = [*whole[:5], whole[6], whole[5], *whole[7:10], whole[9], block_at(2500, 256), block_at(2800, 100)]
    blocks += [short, block_at(20000), block_at(20256, 64)]
    with RunWriter(tmp_path / "run.mcap", info=INFO, channels=CHANNELS, compression=request.param) as writer:
        for block in blocks:
            writer.write_block(block)
    assembler = Assembler("daq", FEW)
    for block in blocks:
        assembler.add(block)
    return tmp_path / "run.mcap", assembler.finish()


CHANNELS = [Channel(name="force", quantity="force", unit="N"), Channel(name="acc1", quantity="velocity", unit="m/s")]


def bits(values):
    return np.asarray(values).view(np.uint32).tolist()


def test_every_window_is_that_of_an_array_to_the_bit(disordered):
    path, held = disordered
    device = read_run(path, limits=FEW).devices["daq"]
    assert device.gaps == held.gaps
    assert device.block_start.tolist() == held.block_start.tolist()
    assert device.block_time_ns.tolist() == held.block_time_ns.tolist()
    rng = np.random.default_rng(0)
    for name, expected in held.values.items():
        samples = device.values[name]
        assert len(samples) == len(expected)
        assert bits(samples) == bits(expected)
        assert bits(np.concatenate(list(pieces(samples)))) == bits(expected)
        for start, stop in rng.integers(-50, len(expected) + 50, (200, 2)):
            assert bits(samples[start:stop]) == bits(expected[start:stop])
        assert bits(samples[10:700:7]) == bits(expected[10:700:7])
        assert bits(samples[::-3]) == bits(expected[::-3])
        assert samples[-1] == expected[-1]


def test_channels_together_decode_every_block_once(disordered, monkeypatch):
    path, held = disordered
    device, decoded = read_run(path, limits=FEW).devices["daq"], []
    monkeypatch.setattr(recordings.run, "PIECE", 500)
    monkeypatch.setattr(stored, "decode_series", lambda *given: decoded.append(1) or decode_series(*given))
    seen = {name: [] for name in device.values}
    for name, piece in channel_blocks(device, 100, 9000):
        seen[name].append(piece)
    for name, expected in held.values.items():
        assert bits(np.concatenate(seen[name])) == bits(expected[100:9000])
    assert 0 < len(decoded) <= len(device.block_start)


def test_turned_and_mended_samples_are_those_of_an_array(disordered):
    path, held = disordered
    first, second = np.array([3, 700, 2999]), np.array([4, 700])
    for name, values in read_run(path, limits=FEW).devices["daq"].values.items():
        expected = np.array(held.values[name])
        changed = -with_samples(values, first, np.float32([1, 2, 3]))
        expected[first] = [1, 2, 3]
        expected = -expected
        changed = with_samples(changed, second, np.float32([7, np.nan]))
        expected[second] = [7, np.nan]
        assert np.array_equal(np.asarray(changed), expected, equal_nan=True)
        assert np.array_equal(changed[600:800], expected[600:800], equal_nan=True)
        assert np.array_equal(2 * changed, 2 * expected, equal_nan=True)


def test_tables_of_other_libraries_take_them_as_they_take_an_array(disordered):
    path, held = disordered
    samples = read_run(path, limits=FEW).devices["daq"].values["force"]
    expected = held.values["force"]
    assert bits(pd.DataFrame({"force": samples})["force"]) == bits(expected)
    assert bits(pa.table({"force": samples})["force"].to_numpy()) == bits(expected)
    assert bits(list(samples)) == bits(expected)
    assert samples.std() == pytest.approx(expected.std(), nan_ok=True)


def test_a_run_outlives_its_file_s_name_and_goes_to_another_process(disordered):
    path, held = disordered
    run = read_run(path, limits=FEW)
    again = pickle.loads(pickle.dumps(run))
    path.unlink()
    for each in (run, again):
        assert bits(each.devices["daq"].values["force"]) == bits(held.values["force"])


def test_a_file_that_changes_meanwhile_gives_an_error_and_no_wrong_sample(tmp_path):
    path = write_run(tmp_path / "run.mcap", blocks=400, compression="none")
    samples = read_run(path, limits=FEW).devices["daq"].values["force"]
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 1
    path.write_bytes(data)
    with pytest.raises(InputError, match="changed after it was read"):
        np.asarray(samples)


def test_series_are_found_however_they_are_packed():
    block = block_at(0, 5)
    usual = encode_block(block)
    one = b"\x0a\x05force" + b"".join(b"\x15" + value.tobytes() for value in block.samples["force"])
    halves = b"".join(
        b"\x12" + _VarintBytes(part.nbytes) + part.tobytes() for part in np.split(block.samples["acc1"], [2])
    )
    two = b"\x0a\x04acc1" + halves
    head = usual[: usual.index(b"\x22")]
    odd = head + b"".join(b"\x22" + _VarintBytes(len(each)) + each for each in (one, two))
    other = encode_block(replace(block, samples={"acc1": block.samples["force"], "force": block.samples["acc1"]}))
    assert len(other) == len(usual)
    layouts: dict = {}
    for data in (usual, usual, other, odd):
        expected = decode_block("", data).samples
        found = decode_series(data, layouts)
        assert {name: bits(x) for name, x in found.items()} == {name: bits(x) for name, x in expected.items()}


PEAK = """
import pathlib, sys
import numpy as np
from drivers.virtual.recorded import RecordedSource
from recordings import Channel, RunWriter, SampleBlock, check_run, read_run
from recordings.convert.mcap_run import write_mcap
from recordings.run import pieces, channel_blocks
NAMES = ("force", "acc1", "acc2", "acc3")
channels = [Channel(name=name, quantity="force", unit="N", range=9.0) for name in NAMES]
noise = np.random.default_rng(0).standard_normal((4, 8192)).astype(np.float32)
blocks = int(sys.argv[1]) * 60 * 25600 // 8192
with RunWriter("run.mcap", info={"source": "measured"}, channels=channels) as writer:
    for k in range(blocks):
        about = {"device": "daq", "time_ns": k * 320_000_000, "first_index": k * 8192, "sample_rate_Hz": 25600.0}
        writer.write_block(SampleBlock(samples=dict(zip(NAMES, noise)), **about))
assert check_run("run.mcap").sound
run = read_run("run.mcap")
for samples in run.devices["daq"].values.values():
    assert sum(map(len, pieces(samples))) == blocks * 8192
source = RecordedSource(run)
while len(source.read(8192)):
    pass
write_mcap(run, "again.mcap")
status = pathlib.Path("/proc/self/status").read_text()
print(int(status.split("VmHWM:")[1].split()[0]) / 1024)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_twice_the_length_takes_no_more_memory(tmp_path: Path):
    """Written, checked, read, replayed and written again: 123 MB of samples more in ten minutes than in five."""
    peaks_MB = []
    for minutes in (5, 10):
        (tmp_path / str(minutes)).mkdir()
        done = subprocess.run(
            [sys.executable, "-c", PEAK, str(minutes)], cwd=tmp_path / str(minutes), capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        peaks_MB.append(float(done.stdout))
    assert peaks_MB[1] - peaks_MB[0] < 10
    assert peaks_MB[1] < 150
