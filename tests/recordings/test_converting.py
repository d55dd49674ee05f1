"""Other formats and back: every value, unit, time and gap; real files of analysers; rubbish refused."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyuff
import scipy.io
from needed import program
from recording_builders import CHANNELS, INFO, START_NS, RATE_Hz, block_at, step_at

from recordings import Channel, Event, Indicator, InputError, Run, RunWriter, SampleBlock, StepState, read_run
from recordings.check import check_run
from recordings.convert import FORMATS, Format, convert
from recordings.convert.uff import load_sets
from recordings.recover import recover

DATA = Path(__file__).parents[1] / "data" / "recordings"
UNIVERSAL = sorted((DATA / "uff").glob("*.uff"))
SECOND_DEVICE = Channel(
    name="joint preload", quantity="preload", unit="N", device="can node/1", range=1e4, direction="0.6,0,-0.8"
)


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two devices, an odd rate, gaps, a clock that steps, overload, extreme values, steps, events, indicators."""
    path = tmp_path_factory.mktemp("original") / "run.mcap"
    rng = np.random.default_rng(11)
    hard = rng.integers(0, 1 << 32, 700, dtype=np.uint32).view(np.float32)  # any float32 there is
    hard = np.where(np.isfinite(hard), hard, np.float32(1e-45))
    with RunWriter(
        path, info={**INFO, "preload_N": "120"}, channels=[*CHANNELS, SECOND_DEVICE],
        attachments={"rig.toml": b"x = 1\n", "blob": bytes(range(256))},
    ) as writer:  # fmt: skip
        writer.write_step(step_at(START_NS, StepState.SETTLING))
        writer.write_step(step_at(START_NS + 77, StepState.MEASURING))
        writer.write_event(Event(time_ns=START_NS + 5, source="daq", kind="overrun", detail='"7", bytes;\n'))
        writer.write_indicator(Indicator(name="force_rms", time_ns=START_NS, value=0.1, unit="N"))
        for number in (2, 3, 7, 8, 9):
            writer.write_block(block_at(number * 256))
        late = block_at(2560)
        shifted = SampleBlock(**{**late.__dict__, "time_ns": late.time_ns + 1_000_000, "overload": {"acc1": 3}})
        writer.write_block(shifted)
        for number in range(2):
            writer.write_block(
                SampleBlock(
                    device="can node/1", time_ns=START_NS + 123 + round(number * 350e9 / 44100.7),
                    first_index=number * 350, sample_rate_Hz=44100.7,
                    samples={"joint preload": hard[number * 350 : number * 350 + 350]},
                )
            )  # fmt: skip
    return path


def assert_same_samples(a: Run, b: Run) -> None:
    assert set(a.devices) == set(b.devices)
    assert a.channels == b.channels
    for name, device in a.devices.items():
        other = b.devices[name]
        assert (other.sample_rate_Hz, other.first_index, other.gaps) == (
            device.sample_rate_Hz, device.first_index, device.gaps,
        )  # fmt: skip
        assert list(other.values) == list(device.values)
        for channel, values in device.values.items():
            bits = [np.asarray(each).view(np.uint32) for each in (other.values[channel], values)]
            np.testing.assert_array_equal(*bits)
        received = ~np.isnan(next(iter(device.values.values())))
        assert np.abs(other.times_ns() - device.times_ns())[received].max() <= 2


@pytest.mark.parametrize("suffix", [".csv", ".mat", ".uff", ".unv"])
def test_round_trip_keeps_every_value_unit_time_and_gap(original: Path, tmp_path: Path, suffix: str) -> None:
    notes = convert(original, tmp_path / f"other{suffix}")
    assert convert(tmp_path / f"other{suffix}", tmp_path / "back.mcap") == []
    assert check_run(tmp_path / "back.mcap").sound
    a, b = read_run(original), read_run(tmp_path / "back.mcap")
    assert_same_samples(a, b)
    if suffix in (".csv", ".mat"):
        assert notes == []
        assert (b.steps, b.events, b.indicators, b.attachments, b.info) == (
            a.steps, a.events, a.indicators, a.attachments, a.info,
        )  # fmt: skip
        assert b.devices["daq"].overload == a.devices["daq"].overload == {"force": 0, "acc1": 3}
    else:
        told = " ".join(notes)
        for what in ("2 steps", "1 events", "1 indicators", "3 overload counts", "2 attachments"):
            assert what in told


def test_rerun_finds_nothing_wrong_with_what_is_written(original: Path, tmp_path: Path) -> None:
    """Structure and time lines: of a recording with gaps and clock steps, one converted, one recovered from a cut."""
    convert(original, tmp_path / "run.csv")
    convert(tmp_path / "run.csv", tmp_path / "converted.mcap")
    (tmp_path / "cut.mcap").write_bytes(original.read_bytes()[:-3000])
    recover(tmp_path / "cut.mcap", tmp_path / "recovered.mcap")
    for path in (original, tmp_path / "converted.mcap", tmp_path / "recovered.mcap"):
        command = [program("rerun"), "mcap", "check", "--full", str(path)]
        found = subprocess.run(command, capture_output=True, text=True, timeout=300, stdin=subprocess.DEVNULL)
        assert found.returncode == 0, found.stderr
        rows = [line.split() for line in found.stdout.splitlines() if "/samples/" in line or "/procedure" in line]
        assert rows, found.stdout
        assert all(row[0] == "ok" for row in rows), found.stdout


def test_universal_file_is_one_that_pyuff_reads(original: Path, tmp_path: Path) -> None:
    convert(original, tmp_path / "run.uff")
    sets = pyuff.UFF(str(tmp_path / "run.uff")).read_sets()
    force = [each for each in sets if each["id1"] == "force"]
    assert [len(each["data"]) for each in force] == [512, 768, 256]  # one set a stretch, at gaps and clock steps
    assert {each["ordinate_axis_units_lab"] for each in sets} == {"N", "m/s^2"}
    assert {each["func_type"] for each in sets} == {1}
    np.testing.assert_array_equal(force[0]["data"], block_at(512, 512).samples["force"].astype(float))
    np.testing.assert_allclose(np.diff(force[0]["x"]), 1 / RATE_Hz, rtol=1e-5)
    assert [each["rsp_dir"] for each in sets if each["id1"] == "acc1"] == [-2] * 3


def test_mat_file_is_plain_for_matlab(original: Path, tmp_path: Path) -> None:
    convert(original, tmp_path / "run.mat")
    arrays = scipy.io.loadmat(tmp_path / "run.mat")
    metadata = json.loads(arrays["metadata"][0])
    assert metadata["devices"][0]["channels"] == ["force", "acc1"]
    assert metadata["channels"]["acc1"]["unit"] == "m/s^2"
    assert arrays["samples_1"].shape == (6 * 256, 2)
    assert arrays["samples_1"].dtype == np.float32
    assert arrays["number_1"][0, 0] == 512


def test_csv_is_plain_for_numpy(original: Path, tmp_path: Path) -> None:
    convert(original, tmp_path / "run.csv")
    lines = (tmp_path / "run.csv").read_text().splitlines()
    assert lines[2] == "number,time_ns,force [N],acc1 [m/s^2]"
    rows = np.genfromtxt(lines[3 : 3 + 6 * 256], delimiter=",", dtype=np.float64)
    np.testing.assert_array_equal(rows[:512, 2].astype(np.float32), block_at(512, 512).samples["force"])


def test_csv_has_all_digits_whatever_another_package_made_numpy_print(original: Path, tmp_path: Path) -> None:
    convert(original, tmp_path / "plain.csv")
    with np.printoptions(legacy="1.13"):
        convert(original, tmp_path / "legacy.csv")
    assert (tmp_path / "legacy.csv").read_bytes() == (tmp_path / "plain.csv").read_bytes()


@pytest.mark.parametrize("path", UNIVERSAL, ids=lambda path: path.stem)
def test_real_universal_files_survive_the_way_through_a_run(path: Path, tmp_path: Path) -> None:
    """Sound pressure and spectra have no place among the contract's quantities: kept whole, and said so."""
    (note,) = convert(path, tmp_path / "run.mcap")
    assert "kept as attachment uff/1.uff" in note
    assert check_run(tmp_path / "run.mcap").sound
    convert(tmp_path / "run.mcap", tmp_path / "back.uff")
    before, after = (pyuff.UFF(str(each)).read_sets() for each in (path, tmp_path / "back.uff"))
    assert set(before) == set(after)
    for key, value in before.items():
        np.testing.assert_array_equal(after[key], value)


@pytest.mark.parametrize(
    ("unit", "quantity", "factor"),
    [("g", "acceleration", 9.80665), ("m/s²", "acceleration", 1.0), ("N", "force", 1.0), ("mm", "displacement", 1e-3)],
)
def test_analysers_units_become_si(tmp_path: Path, unit: str, quantity: str, factor: float) -> None:
    data = np.sin(np.arange(100.0))
    fields = {
        "type": 58, "binary": 0, "func_type": 1, "rsp_node": 1, "rsp_dir": 2, "ref_node": 0, "ref_dir": 0,
        "abscissa_spacing": 1, "id3": "18-Apr-16 13:49:58", "rsp_ent_name": "Acc 7", "orddenom_spec_data_type": 0,
        "ordinate_axis_units_lab": unit, "data": data, "x": np.arange(100) / 1024,
    }  # fmt: skip
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets(fields)
    assert convert(tmp_path / "a.uff", tmp_path / "run.mcap") == []
    run = read_run(tmp_path / "run.mcap")
    assert run.channels["Acc 7"].quantity == quantity
    np.testing.assert_allclose(run.devices["uff"].values["Acc 7"], data * factor, rtol=1e-6)
    assert run.info["started"].startswith("2016-04-18T13:49:58")


def test_data_sets_of_other_kinds_are_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.uff"
    units = {"type": 164, "units_code": 1, "length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 0.0}
    pyuff.UFF(str(path)).write_sets(units)
    with monkeypatch.context() as patch:
        patch.setattr(pyuff.UFF, "read_sets", lambda *_: pytest.fail("it was read"))
        assert load_sets(path)[1] == [{"type": 164}]
    assert load_sets(path, kinds=(164,))[1][0]["length"] == 1.0


def test_existing_target_and_unknown_suffix_are_refused(original: Path, tmp_path: Path) -> None:
    target = tmp_path / "out.csv"
    target.write_text("precious")
    with pytest.raises(InputError, match="exists already"):
        convert(original, target)
    assert target.read_text() == "precious"
    with pytest.raises(InputError, match=r"no format has the suffix '\.xyz'"):
        convert(original, tmp_path / "out.xyz")
    with pytest.raises(InputError, match="same format"):
        convert(original, tmp_path / "out.mcap")
    assert [path.name for path in tmp_path.iterdir()] == ["out.csv"]


def test_failure_leaves_nothing_half_written(original: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        convert(original, tmp_path / "none" / "out.csv")
    (tmp_path / "bad.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match=r"bad\.csv: line 1: does not begin with '# rig run'"):
        convert(tmp_path / "bad.csv", tmp_path / "out.mcap")
    assert [path.name for path in tmp_path.iterdir()] == ["bad.csv"]


def test_mat_that_unpacks_to_too_much_or_holds_objects_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = next(each.read for each in FORMATS if each.suffix == ".mat")
    assert read is not None
    scipy.io.savemat(tmp_path / "cells.mat", {"metadata": np.array([{"a": 1}], dtype=object)})
    with pytest.raises(InputError, match="is of class cell"):
        read(tmp_path / "cells.mat")
    scipy.io.savemat(tmp_path / "bomb.mat", {"metadata": np.zeros(1 << 21)}, do_compression=True)
    monkeypatch.setattr("recordings.convert.mat.SIZE_LIMIT_BYTES", 1 << 23)
    assert (tmp_path / "bomb.mat").stat().st_size < 1 << 16
    with pytest.raises(InputError, match="holds more than"):
        read(tmp_path / "bomb.mat")


def test_format_from_elsewhere_joins_in(original: Path, tmp_path: Path) -> None:
    """What needs knowledge of hardware, CAN frames for one, is added by the caller."""
    frames = Format(suffix=".blf", name="BLF", read=lambda path: read_run(original), write=None)
    (tmp_path / "frames.blf").write_bytes(b"")
    convert(tmp_path / "frames.blf", tmp_path / "out.mcap", formats=[*FORMATS, frames])
    assert_same_samples(read_run(original), read_run(tmp_path / "out.mcap"))
    with pytest.raises(InputError, match="BLF can be read but not written"):
        convert(original, tmp_path / "out.blf", formats=[*FORMATS, frames])


def test_value_beyond_float32_is_refused_not_made_infinite(original: Path, tmp_path: Path) -> None:
    convert(original, tmp_path / "run.csv")
    lines = (tmp_path / "run.csv").read_text().splitlines()
    lines[5] = ",".join([*lines[5].split(",")[:2], "1e39", "0"])
    (tmp_path / "run.csv").write_text("\n".join(lines))
    with pytest.raises(InputError, match="beyond the range of float32"):
        convert(tmp_path / "run.csv", tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()


def test_command_converts_and_tells(original: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "twin", "convert", str(original), str(tmp_path / "run.uff"), "--json"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    assert any("2 steps" in note for note in json.loads(result.stdout)["notes"])
    again = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert (again.returncode, again.stdout) == (2, "")
    assert len(again.stderr.strip().splitlines()) == 1
