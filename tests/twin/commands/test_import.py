"""`twin import`: a virtual run as other programs would have kept it comes in with its samples and its steps."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from foreign_files import WRITERS, Signals, fill_in

from recordings import read_run, sweeps
from recordings.importing import mapping_beside
from twin.cli import main


def said(capsys: pytest.CaptureFixture[str], *words: str, status: int = 0) -> dict:
    with pytest.raises(SystemExit) as ended:
        main([*words, "--json", "--quiet"])
    shown = capsys.readouterr()
    assert ended.value.code == status, shown.err
    return json.loads(shown.out) if shown.out else {}


def signals_of(path: Path) -> tuple[Signals, float]:
    run = read_run(path)
    signals = {name: (run.channels[name].unit, run.device_of(name).values[name]) for name in run.channels}
    return signals, run.device_of("force").sample_rate_Hz


def imported(folder: Path, name: str, source: Path, capsys: pytest.CaptureFixture[str]) -> tuple[Path, dict]:
    """The run of `source` as `name` says, imported."""
    path, out = folder / name, folder / f"{name}.mcap"
    signals, rate_Hz = signals_of(source)
    WRITERS[name](path, signals, rate_Hz)
    if path.suffix == ".wav":
        assert said(capsys, "import", str(path), "--out", str(out), status=2) == {}
        fill_in(mapping_beside(path), signals)
    return out, said(capsys, "import", str(path), "--out", str(out))


@pytest.mark.parametrize("name", WRITERS)
def test_a_stepped_sine_comes_in_with_its_steps(name, campaign, tmp_path, capsys):
    source = campaign / "sweeps.mcap"
    out, told = imported(tmp_path, name, source, capsys)
    before, after = read_run(source), read_run(out)
    for channel in before.channels:
        np.testing.assert_array_equal(
            after.device_of(channel).values[channel], before.device_of(channel).values[channel]
        )
    wanted = [[each.step.frequency_Hz for each in sweep.stretches] for sweep in sweeps(before)]
    found = [[each.step.frequency_Hz for each in sweep.stretches] for sweep in sweeps(after)]
    assert found == [pytest.approx(each, abs=2e-3) for each in wanted]
    assert [each["steps"] for each in told["sweeps"]] == [len(each) for each in wanted]
    assert said(capsys, "check", str(out))["sound"]


def test_nothing_is_written_over(tmp_path, capsys):
    (tmp_path / "a.csv").write_text("Time [s],Force [N]\n0,1\n0.1,2\n0.2,1\n")
    out = tmp_path / "run.mcap"
    out.write_bytes(b"mine")
    said(capsys, "import", str(tmp_path / "a.csv"), "--out", str(out), status=2)
    assert out.read_bytes() == b"mine"
    said(capsys, "import", str(tmp_path / "a.csv"), "--out", str(out), "--overwrite")
    assert read_run(out).info["procedure"] == "broadband"


def test_a_mapping_of_another_name_is_asked_again_in_its_place(tmp_path, capsys):
    (tmp_path / "a.csv").write_text("Force\n1\n2\n1\n")
    mapping = tmp_path / "mine.toml"
    mapping.write_text("sample_rate_Hz = 100.0\n")
    words = ["import", str(tmp_path / "a.csv"), "--out", str(tmp_path / "run.mcap"), "--mapping", str(mapping)]
    said(capsys, *words, status=2)
    text = mapping.read_text()
    assert "sample_rate_Hz = 100.0" in text
    mapping.write_text(text.replace('unit = ""', 'unit = "N"'))
    assert said(capsys, *words)["channels"][0]["samples"] == 3


@pytest.mark.slow
def test_an_imported_campaign_is_identified_the_same(campaign, tmp_path, capsys):
    results = []
    files = {name: campaign / f"{name}.mcap" for name in ("random", "sweeps")}
    for folder in ("original", "foreign"):
        (tmp_path / folder).mkdir()
        runs = list(files.values())
        if folder == "foreign":
            runs = []
            for name, source in files.items():
                mapping_beside(tmp_path / folder / "pandas.csv").write_text("preload_N = 120.0\n")
                out, _ = imported(tmp_path / folder, "pandas.csv", source, capsys)
                runs.append(out.rename(out.with_name(f"{name}.mcap")))
        model = tmp_path / folder / "model.toml"
        results.append(said(capsys, "identify", *map(str, runs), "--rig", "steel-lap-joint", "--out", str(model)))
    original, foreign = (each["linear"] for each in results)
    for name in ("normal_modulus", "shear_modulus"):
        assert abs(foreign[name]["value"] - original[name]["value"]) < 0.3 * original[name]["std"]
