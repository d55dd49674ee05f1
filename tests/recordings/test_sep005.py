"""Time series as SEP-0005 dictionaries: sdypy's own validator takes them, and every value and unit comes back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from recording_builders import CHANNELS, INFO, START_NS, RATE_Hz, block_at
from sdypy_sep005.sep005 import assert_sep005

from recordings import Channel, InputError, Run, RunWriter, SampleBlock, read_run
from recordings.convert import from_sep005, to_sep005, write_mcap

PRELOAD = Channel(name="joint preload", quantity="preload", unit="N", device="meter/1", range=1e4)


def record(path: Path, numbers: tuple[int, ...], *, late_ns: int = 0) -> Run:
    """Blocks of 256 samples by number, the last of them later than it should be; a second device at an odd rate."""
    with RunWriter(path, info=INFO, channels=[*CHANNELS, PRELOAD]) as writer:
        for number in numbers:
            block = block_at(number * 256)
            late = late_ns if number == numbers[-1] else 0
            writer.write_block(SampleBlock(**{**block.__dict__, "time_ns": block.time_ns + late}))
        slow = np.linspace(119, 121, 7, dtype=np.float32)
        writer.write_block(
            SampleBlock(
                device="meter/1", time_ns=START_NS + 1234, first_index=0, sample_rate_Hz=2.5,
                samples={"joint preload": slow},
            )
        )  # fmt: skip
    return read_run(path)


def test_the_validator_of_sdypy_takes_every_channel(tmp_path: Path) -> None:
    series = to_sep005(record(tmp_path / "run.mcap", (0, 1, 2)))
    assert_sep005(series)
    assert [one["name"] for one in series] == ["force", "acc1", "joint preload"]
    assert [one["unit_str"] for one in series] == ["N", "m/s^2", "N"]
    assert [one.get("quantity") for one in series] == ["f", "a", None]  # the proposal has no letter for a preload
    assert [one["fs"] for one in series] == [RATE_Hz, RATE_Hz, 2.5]
    assert isinstance(series[0]["fs"], int)
    np.testing.assert_array_equal(series[1]["data"], block_at(0, 768).samples["acc1"])


def test_the_way_back_keeps_every_value_unit_time_and_gap(tmp_path: Path) -> None:
    run = record(tmp_path / "run.mcap", (0, 1, 3))
    series = to_sep005(run)
    assert [one["lost_samples"] for one in series] == [256, 256, 0]
    write_mcap(from_sep005(series), tmp_path / "back.mcap")
    back = read_run(tmp_path / "back.mcap")
    assert back.channels == run.channels
    for name, device in run.devices.items():
        other = back.devices[name]
        assert (other.sample_rate_Hz, other.gaps) == (device.sample_rate_Hz, device.gaps)
        for channel, values in device.values.items():
            np.testing.assert_array_equal(other.values[channel], values)
        received = np.isfinite(next(iter(device.values.values())))
        np.testing.assert_array_equal(other.times_ns()[received], device.times_ns()[received])


def test_a_clock_that_stepped_is_told_sample_by_sample(tmp_path: Path) -> None:
    run = record(tmp_path / "run.mcap", (0, 1, 2), late_ns=1_000_000)
    force = to_sep005(run)[0]
    assert "fs" not in force
    assert force["time"][512] == pytest.approx(512 / RATE_Hz + 1e-3, abs=1e-8)
    assert_sep005([force])
    with pytest.raises(InputError, match=r"channel force: has no 'fs'; it is not evenly sampled"):
        from_sep005(force)


def test_a_stretch_of_the_run_is_cut_out(tmp_path: Path) -> None:
    run = record(tmp_path / "run.mcap", (0, 1, 2))
    start_ns, stop_ns = run.devices["daq"].times_ns(100, 102)
    force = to_sep005(run, start_ns=int(start_ns), stop_ns=int(stop_ns))[0]
    np.testing.assert_array_equal(force["data"], block_at(100, 1).samples["force"])


def test_units_of_others_become_si() -> None:
    series = {"data": [1.0, -2.0], "name": "tip", "unit_str": "g", "fs": 100, "quantity": "a", "range": 50.0}
    run = from_sep005(series)
    assert (run.channels["tip"].unit, run.channels["tip"].range) == ("m/s^2", 50 * 9.80665)
    np.testing.assert_allclose(run.devices["sep005"].values["tip"], [9.80665, -19.6133], rtol=1e-6)


GOOD = {"data": [1.0, 2.0], "name": "tip", "unit_str": "N", "fs": 100}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"unit_str": "furlong"}, "cannot hold the unit 'furlong'"),
        ({"unit_str": None}, "has no 'unit_str'"),
        ({"quantity": "a"}, "is said to be 'acceleration', but its unit is 'N'"),
        ({"data": [[1.0], [2.0]]}, r"the shape \(2, 1\)"),
        ({"data": ["a", "b"]}, "could not convert"),
        ({"data": [1e39, 0.0]}, "beyond the range of float32"),
        ({"fs": 0.0}, "a sample rate of 0.0 Hz"),
        ({"start_timestamp": "yesterday"}, "yesterday"),
        ({"direction": "up"}, "is not \\+x, -x"),
    ],
)
def test_what_is_no_channel_of_a_run_is_refused_by_name(change: dict[str, object], reason: str) -> None:
    with pytest.raises(InputError, match=reason) as refused:
        from_sep005([{**GOOD, **change}])
    assert refused.value.place in ("channel tip", "group sep005")


def test_channels_that_were_not_sampled_together_need_groups_of_their_own() -> None:
    with pytest.raises(InputError, match="differ in length"):
        from_sep005([GOOD, {**GOOD, "name": "root", "fs": 200}])
    assert len(from_sep005([GOOD, {**GOOD, "name": "root", "fs": 200, "group": "other"}]).devices) == 2
