"""Anybody's files: every sample comes in as it was, whatever wrote it; what is not known is asked for once."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from foreign_files import WRITERS, Signals, fill_in
from needed import package

from recordings import InputError, Run, read_run
from recordings.convert import convert, write_mcap
from recordings.importing import Mapping, import_files, mapping_beside, read_mapping

RATE_Hz = 1000.0
RNG = np.random.default_rng(5)
SIGNALS: Signals = {
    "force": ("N", RNG.normal(size=2000).astype(np.float32)),
    "acc1": ("m/s^2", RNG.normal(size=2000).astype(np.float32)),
    "acc2": ("m/s^2", RNG.normal(size=2000).astype(np.float32)),
}


def taken(*paths: Path) -> Run:
    """Import with the mapping beside the first file, if there is one."""
    beside = mapping_beside(paths[0])
    mapping = read_mapping(beside) if beside.exists() else Mapping()
    return import_files(paths, mapping, ask=beside).run


def refused(*paths: Path) -> str:
    with pytest.raises(InputError) as told:
        taken(*paths)
    line = str(told.value)
    assert "\n" not in line
    assert str(paths[0]) in line
    assert len(line) < 600
    return line


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", WRITERS)
def test_every_sample_comes_in_and_goes_out_again(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    WRITERS[name](path, SIGNALS, RATE_Hz)
    if path.suffix == ".wav":
        assert "has no unit" in refused(path)
        fill_in(mapping_beside(path), SIGNALS)
    run = taken(path)
    write_mcap(run, tmp_path / "run.mcap")
    for suffix in (".csv", ".mat", ".uff"):
        convert(tmp_path / "run.mcap", tmp_path / f"out{suffix}")
        convert(tmp_path / f"out{suffix}", tmp_path / f"again{suffix}.mcap")
    for again in (run, *(read_run(each) for each in sorted(tmp_path.glob("*.mcap")))):
        (device,) = again.devices.values()
        assert device.sample_rate_Hz == RATE_Hz
        assert set(device.values) == set(SIGNALS)
        for channel, (unit, values) in SIGNALS.items():
            np.testing.assert_array_equal(device.values[channel], values)
            assert again.channels[channel].unit == unit


HEADS = {
    "names and units in one": "Time (s),Force [lbf],acc 1 (g)",
    "a line of units": "Time,Force,acc 1\ns,lbf,g",
    "brackets in the line of units": '"Time","Force","acc 1"\n[s],[lbf],[g]',
    "as in DIN": "t/s,Force / lbf,acc 1 / g",
    "commented": "# measured by nobody\n# time_s,force_lbf,acc_1_g",
    "more lines": "Operator: A. Person\nSetup,3\n\nTime in s,Force in lbf,acc 1 in g",
    "a rate instead of a time": "Sampling rate: 1000 Hz\nForce [lbf],acc 1 [g]",
    "milliseconds": "Time [ms],Force [lbf],acc 1 [g]",
}


@pytest.mark.parametrize("head", HEADS)
@pytest.mark.parametrize("dialect", [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), ("|", ".")])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_dialects_heads_and_encodings(head: str, dialect: tuple[str, str], encoding: str, tmp_path: Path) -> None:
    delimiter, decimal = dialect
    rows = RNG.normal(size=(50, 2))
    time = np.arange(50) * (1.0 if head == "milliseconds" else 1e-3)
    columns = rows if "rate" in head else np.column_stack([time, rows])
    lines = [delimiter.join(f"{value:.7g}".replace(".", decimal) for value in row) for row in columns]
    text = "\r\n".join([*HEADS[head].replace(",", delimiter).split("\n"), *lines, ""])
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    run = taken(tmp_path / "a.csv")
    (device,) = run.devices.values()
    assert device.sample_rate_Hz == pytest.approx(1000.0, rel=1e-6)
    np.testing.assert_allclose(device.values["force"], rows[:, 0] * 4.4482216152605, rtol=1e-6)
    np.testing.assert_allclose(device.values["acc_1"], rows[:, 1] * 9.80665, rtol=1e-6)
    assert run.channels["force"].quantity == "force"
    assert run.channels["acc_1"].quantity == "acceleration"


def test_volts_become_what_their_sensitivity_says(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "Time [s],ai0 [V],ai1 [mV]\n" + "".join(f"{n / 100},1,20\n" for n in range(9)))
    assert re.search(
        r"'ai0': is in volts; write .*; fill in 'sensitivity' and 1 more in .*a.csv.mapping.toml", refused(path)
    )
    asked = mapping_beside(path).read_text()
    assert asked.count('sensitivity = ""') == 2
    first, _, second = asked.partition('sensitivity = ""')
    mapping_beside(path).write_text(
        first + 'sensitivity = "22.4 mV/lbf"' + second.replace('sensitivity = ""', 'sensitivity = "100 mV/g"')
    )
    run = taken(path)
    assert run.between("ai0", 0, 1 << 62)[0] == pytest.approx(4.4482216 / 0.0224, rel=1e-6)
    assert run.between("ai1", 0, 1 << 62)[0] == pytest.approx(0.02 / 0.1 * 9.80665, rel=1e-6)
    assert [run.channels[name].quantity for name in ("ai0", "ai1")] == ["force", "acceleration"]


def test_several_files_are_one_run_of_several_devices(tmp_path: Path) -> None:
    for name, rate in (("force", 1000), ("acc1", 500)):
        package("soundfile").write(tmp_path / f"{name}.wav", SIGNALS[name][1][: 2 * rate], rate, subtype="FLOAT")
    paths = (tmp_path / "force.wav", tmp_path / "acc1.wav")
    refused(*paths)
    fill_in(mapping_beside(paths[0]), {name: SIGNALS[name] for name in ("force", "acc1")})
    run = taken(*paths)
    assert {name: device.sample_rate_Hz for name, device in run.devices.items()} == {"daq1": 1000.0, "daq2": 500.0}
    assert set(run.channels) == {"force", "acc1"}


def test_missing_rows_are_lost_samples(tmp_path: Path) -> None:
    rows = [f"{n / 1000},{n}" for n in range(100) if not 40 <= n < 50]
    rows[20] = "0.02,"
    run = taken(written(tmp_path / "a.csv", "\n".join(["Time [s],Force [N]", *rows])))
    (device,) = run.devices.values()
    assert sum(gap.count for gap in device.gaps) == 11
    assert np.flatnonzero(np.isnan(device.values["force"])).tolist() == [20, *range(40, 50)]


def test_moments_are_the_run_s_clock(tmp_path: Path) -> None:
    rows = "".join(f"2026-02-15 09:00:{n / 100:06.3f};{n}\n" for n in range(100))
    run = taken(written(tmp_path / "a.csv", "Datetime;Force [N]\n" + rows))
    (device,) = run.devices.values()
    assert device.sample_rate_Hz == 100.0
    assert run.info["started"] == "2026-02-15T09:00:00.000Z"


T = "Time [s],Force [N]\n"
BROKEN = {
    "text among numbers": (T + "0,1\n0.1,2\n0.2,oops\n0.3,4\n", r"line 4, column 'Force': 'oops' is not a number"),
    "a cell too many": (T + "0,1\n0.1,2\n0.2,3,9\n0.3,4\n", r"line 4: has 3 columns, the lines before it 2"),
    "cut in a row": (T + "0,1\n0.1,2\n0.2,3\n0.3", r"line 5: has 1 columns"),
    "no time": ("Force [N],acc [g]\n1,2\n3,4\n5,7\n", r"no column of time .*fill in 'sample_rate_Hz' in .*mapping"),
    "two times": (
        "Time [s],Force [N],t2 [s]\n0,1,0\n.1,2,.2\n.2,3,.4\n",
        r"2 columns of time: 'Time' and 't2'; fill in 'time'",
    ),
    "no unit": ("Time [s],Force\n0,1\n.1,2\n.2,3.5\n", r"column 'Force': has no unit; .*fill in 'unit' in"),
    "unknown unit": ("Time [s],Force [furlong]\n0,1\n.1,2\n.2,3\n", r"its unit 'furlong' is not known"),
    "time without a unit": ("Time,Force [N]\n0,1\n1,2\n2,3\n", r"'Time' has no unit, and 1 Hz is no sample rate"),
    "time runs back": (T + "0,1\n0.1,2\n0.05,3\n", r"column 'Time': does not rise at row 3"),
    "time stands": (T + "0,1\n0.1,2\n0.1,3\n", r"does not rise at row 3"),
    "uneven time": (T + "0,1\n0.1,2\n0.25,3\n0.3,4\n0.4,5\n", r"not evenly sampled: row 3"),
    "time leaps": (T + "0,1\n0.1,2\n0.2,3\n1e9,4\n", r"leaps over 99\d+ samples"),
    "time with a hole": (T + "0,1\n,2\n0.2,3\n", r"row 2 has no time"),
    "prose": ("Dear diary,\n\ttoday = nothing [was] measured\n", r"no lines of numbers|no columns"),
    "empty": ("", r"no lines of numbers"),
    "beyond float32": (T + "0,1\n0.1,1e39\n0.2,3\n", r"column 'Force': a value is beyond the range of float32"),
    "column twice": ("Time [s],a b [N],a_b [N]\n0,1,1\n.1,2,2\n.2,3,3\n", r"channel 'a_b': stands twice"),
    "one of ours": ('# rig run {"a": 1}\n1,2\n', r"is a recording already; 'twin convert' reads it"),
}  # fmt: skip


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_table_is_one_line(what: str, tmp_path: Path) -> None:
    text, said = BROKEN[what]
    assert re.search(said, refused(written(tmp_path / "a.csv", text)))
    asked = "fill in" in said or what in ("unknown unit", "time without a unit")
    assert mapping_beside(tmp_path / "a.csv").exists() == asked


@pytest.mark.parametrize("name", [name for name in WRITERS if not name.endswith((".csv", ".txt"))])
def test_a_file_that_is_cut_or_damaged_is_one_line(name: str, tmp_path: Path) -> None:
    WRITERS[name](tmp_path / name, SIGNALS, RATE_Hz)
    good = (tmp_path / name).read_bytes()
    assert good
    path = tmp_path / f"cut{Path(name).suffix}"
    generator = np.random.default_rng(3)
    for share in (0.0, 0.01, 0.3, 0.9):
        path.write_bytes(good[: int(share * len(good))])
        if path.suffix not in (".wav",) or share < 0.01:  # scipy gives what is there of a sound, with units unknown
            refused(path)
    for _ in range(30):
        bad = bytearray(good)
        for at in generator.integers(0, min(len(bad), 2000), 8):
            bad[at] = generator.integers(256)
        path.write_bytes(bytes(bad))
        try:
            taken(path)
        except InputError as error:
            assert "\n" not in str(error)  # noqa: PT017


def test_a_file_that_claims_a_billion_rows_is_not_believed(tmp_path: Path) -> None:
    with package("h5py", "import").File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("force", shape=(10**9,), chunks=(1 << 20,), dtype="f4")
    assert "claims 1000000000 values" in refused(tmp_path / "a.h5")
    frame = package("pyarrow").table({"force": package("pyarrow").repeat(1.0, 140_000_000)})
    package("pyarrow.parquet").write_table(frame, tmp_path / "a.parquet")
    assert (tmp_path / "a.parquet").stat().st_size < 1 << 20
    assert "claims 140000000 values" in refused(tmp_path / "a.parquet")


def test_nested_and_foreign_parts_are_passed_over_or_told(tmp_path: Path) -> None:
    h5py = package("h5py", "import")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        deep = file
        for level in range(60):
            deep = deep.create_group(f"g{level}")
        deep["text"] = "none of our business"
        deep["force_N"] = SIGNALS["force"][1]
        deep["fs"] = RATE_Hz
        file["loop"] = h5py.SoftLink("/g0")
        file["elsewhere"] = h5py.ExternalLink("/etc/passwd", "/")
    assert set(taken(tmp_path / "a.h5").channels) == {"force"}
    scipy.io.savemat(tmp_path / "a.mat", {"run": {"force": SIGNALS["force"][1], "deeper": {"still": 1.0}}})
    assert "of class struct" in refused(tmp_path / "a.mat")


def test_a_reader_that_is_not_installed_is_named_with_what_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path / "a.tdms", "TDSm")
    monkeypatch.setitem(sys.modules, "nptdms", None)
    assert "needs nptdms, which is not installed; pip install 'virtual-test-rig[import]'" in refused(
        tmp_path / "a.tdms"
    )


@pytest.mark.parametrize(
    ("field", "said"),
    [
        ('chanel = 1', "chanel: no such field, perhaps 'channel' is meant"),
        ('[[channel]]\ncolumn = "a"\nsensitivity = "100 furlongs"', "is no sensitivity; write it as '10.2 mV/g'"),
        ('[[channel]]\ncolumn = "a"\nquantity = "acceleraton"', "there are force, acceleration"),
        ('[[channel]]\ncolumn = "gone"', "column 'gone': is not in the file; there are Time, Force"),
        ('[[channel]]\ncolumn = "Force"\nquantity = "velocity"', "is a velocity, but its unit is that of a force"),
        ('[[channel]]\ncolumn = "Force"\nsensitivity = "10 mV/g"', "has a sensitivity, but its unit"),
        ('target = "acc9"', "there is no channel 'acc9'; there are force"),
        ('excitation = "stepped-sine"', "no steps of a stepped sine are found in it"),
        ("sample_rate_Hz = -1.0", "sample_rate_Hz: "),
    ],
)  # fmt: skip
def test_a_mistake_in_the_mapping_is_one_line(field: str, said: str, tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", T + "".join(f"{n / 100},{n % 7}\n" for n in range(50)))
    written(mapping_beside(path), field)
    with pytest.raises(InputError, match=re.escape(said)):
        taken(path)
