"""What the .rrd files hold, read back with rerun's own reader."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recorded_views import FREQUENCIES_Hz, columns, sdof_receptance, value_at, verify, view_origins

from recordings import InputError, Run
from twin.diagnose.answer.result import Diagnosis
from twin.views.curves import stepped_sweeps
from twin.views.rerun import run as rerun_run
from twin.views.rerun.diagnosis import save_diagnosis
from twin.views.rerun.run import save_run
from twin.views.table import markdown_text


@pytest.fixture(scope="module")
def run_file(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "run.rrd"
    save_run(run, path)
    return path


@pytest.fixture(scope="module")
def diagnosis_file(diagnosis: Diagnosis, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("diagnosis") / "view.rrd"
    save_diagnosis(diagnosis, path)
    return path


def test_files_pass_the_verifier(run_file: Path, diagnosis_file: Path) -> None:
    verify(run_file)
    verify(diagnosis_file)


def test_every_sample_is_there(run: Run, run_file: Path) -> None:
    rows = columns(run_file)["/signals/acc1"]["Scalars:scalars"]
    shown = [row[0] for row in rows if row]
    assert shown == pytest.approx(run.devices["daq"].values["acc1"])


def test_signals_are_drawn_by_extremes_not_averages(run_file: Path) -> None:
    style = columns(run_file)["/signals/acc1"]
    # AggregationPolicy.MinMax is the fifth of its enumeration
    assert [row for row in style["SeriesLines:aggregation_policy"] if row] == [[5]]


def test_a_long_channel_keeps_its_extremes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rerun_run, "MOST_SAMPLES", 1000)
    values = np.random.default_rng(0).normal(size=12_345).astype(np.float32)
    values[7_777], values[5] = 50.0, np.nan
    position, shown = rerun_run._envelope(values)
    assert len(shown) < 1300
    assert np.nanmax(shown) == 50.0
    assert np.nanmin(shown) == np.nanmin(values)
    assert (np.diff(position) > 0).all()


def test_the_peak_is_drawn_at_its_height(run_file: Path) -> None:
    found = columns(run_file)
    points = found["/sweeps/acc1/1N-up/steps"]["Points2D:positions"][0]
    drawn = [value_at(found["/sweeps/acc1/axes/y"], y) for _, y in points]
    exact = [1e3 * abs(sdof_receptance(frequency)) for frequency in FREQUENCIES_Hz]
    assert drawn == pytest.approx(exact, rel=2e-3)


def test_axes_say_what_they_show_and_in_which_unit(diagnosis_file: Path) -> None:
    found = columns(diagnosis_file)
    charts = {name.rsplit("/axes/", 1)[0] for name in found if "/axes/" in name}
    assert len(charts) > 10
    for chart in charts:
        for axis in ("x_label", "y_label"):
            (text,) = found[f"{chart}/axes/{axis}"]["Points2D:labels"][0]
            assert len(text) > 6
        assert len(found[f"{chart}/axes/x"]["Points2D:labels"][0]) >= 2
    assert found["/sweeps/receptance/acc2/axes/y_label"]["Points2D:labels"][0] == ["receptance at acc2, mm/N"]


def test_no_pane_is_empty(run_file: Path, diagnosis_file: Path) -> None:
    for path, least in ((run_file, 5), (diagnosis_file, 12)):
        entities = list(columns(path))
        origins = view_origins(path)
        assert len(origins) >= least
        for origin in origins:
            assert any(entity == origin or entity.startswith(f"{origin}/") for entity in entities), origin


def test_the_sweeps_about_each_resonance_have_their_own_charts(diagnosis: Diagnosis, tmp_path: Path) -> None:
    low, high = diagnosis.sweeps
    path = tmp_path / "view.rrd"
    save_diagnosis(replace(diagnosis, sweeps=(low, replace(high, frequency_Hz=6 * high.frequency_Hz))), path)
    found = columns(path)
    for number, sweep in (("1", low), ("2", high)):
        assert f"/sweeps/{number}/receptance/acc2/{sweep.sweep}/measured" in found
        assert f"/sweeps/{number}/residual/acc1/{sweep.sweep}/after" in found
    assert not any(name.startswith("/sweeps/receptance") for name in found)
    assert {"/sweeps/1/receptance/acc1", "/sweeps/2/receptance/acc1"} <= set(view_origins(path))


def test_the_law_goes_by_opening_and_slip(diagnosis_file: Path) -> None:
    found = columns(diagnosis_file)
    for quantity, label in (("softening", "opening o of a layer point, µm"), ("loss", "slip q of a layer point, µm")):
        assert found[f"/law/{quantity}/axes/x_label"]["Points2D:labels"][0] == [label]
        assert f"/law/{quantity}/after/upper" in found


def test_the_answer_and_the_animation_are_there(diagnosis: Diagnosis, diagnosis_file: Path) -> None:
    found = columns(diagnosis_file)
    (text,) = found["/answer"]["TextDocument:text"][0]
    assert markdown_text(diagnosis.sentence) in text
    assert "5.40 %" in text
    frames = found["/motion/rig/upper"]["LineStrips3D:strips"]
    heights = [strips[-1][-1][1] for strips in frames]
    assert len(frames) > 20
    assert max(heights) - min(heights) > 0.05, "drawn larger, by some tenth of the rig"


def test_events_lie_on_the_time_line(run_file: Path) -> None:
    log = columns(run_file)["/events"]
    texts = [row[0] for row in log["TextLog:text"]]
    assert "1.0 s  acc1: overload 3 samples" in texts
    assert any(text.endswith("2N-up done") for text in texts)


def test_a_run_without_steps_shows_what_it_has(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "bare.rrd"
    save_run(replace(run, steps=(), events=()), path)
    verify(path)
    entities = columns(path)
    assert "/signals/force" in entities
    assert not any(name.startswith("/sweeps") for name in entities)
    assert set(view_origins(path)) == {"/about", "/signals/force", "/signals/acc1"}


def test_predicted_branches_lie_over_the_sweeps(run: Run, tmp_path: Path) -> None:
    frequency = list(np.linspace(23, 26, 30))
    amplitude = [2.0 * abs(sdof_receptance(f)) * (2 * np.pi * f) ** 2 for f in frequency]
    branch = {"force_N": 2.0, "frequency_Hz": frequency, "folds_Hz": [], "response": {"acc1": {"amplitude": amplitude}}}
    again = {**branch, "frequency_Hz": [25.0, 26.0], "response": {"acc1": {"amplitude": amplitude[-2:]}}}
    path = tmp_path / "rehearsed.rrd"
    save_run(run, path, rehearsal={"branches": [branch, again], "warnings": []})
    found = columns(path)
    assert "/sweeps/acc1/branches/1" in found  # another resonance has a curve of its own at the same force
    (dashes,) = found["/sweeps/acc1/branches/0"]["LineStrips2D:strips"]
    top = max(value_at(found["/sweeps/acc1/axes/y"], y) for dash in dashes for _, y in dash)
    assert top == pytest.approx(1e3 * max(abs(sdof_receptance(f)) for f in frequency), rel=0.02)


def test_sweeps_about_two_resonances_have_charts_of_their_own(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each behind its tab, over its own frequencies; a predicted branch lies over those it belongs to."""
    first = stepped_sweeps(run)
    second = [replace(sweep, name=f"{sweep.name}, high", frequency_Hz=6 * sweep.frequency_Hz) for sweep in first]
    monkeypatch.setattr(rerun_run, "stepped_sweeps", lambda run: [*second, *first])
    branch = {"force_N": 2.0, "frequency_Hz": [140.0, 160.0], "response": {"acc1": {"amplitude": [1.0, 1.0]}}}
    path = tmp_path / "two.rrd"
    save_run(run, path, rehearsal={"branches": [branch], "warnings": []})
    verify(path)
    found = columns(path)
    for number, sweeps in ((1, first), (2, second)):
        (dots,) = found[f"/sweeps/{number}/acc1/{sweeps[0].name}/steps"]["Points2D:positions"]
        x = [value_at(found[f"/sweeps/{number}/acc1/axes/x"], float(at[0]), axis=0) for at in dots]
        assert sorted(x) == pytest.approx(sorted(sweeps[0].frequency_Hz), rel=1e-3)
    assert "/sweeps/2/acc1/branches/0" in found
    assert "/sweeps/1/acc1/branches/0" not in found
    assert {"/sweeps/1/acc1", "/sweeps/2/acc1"} <= set(view_origins(path))


def test_a_file_that_cannot_be_written_leaves_nothing(run: Run, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        save_run(run, tmp_path / "nowhere" / "run.rrd")
    (tmp_path / "taken.rrd").mkdir()
    with pytest.raises(InputError, match=r"taken\.rrd"):
        save_run(run, tmp_path / "taken.rrd")
    assert [path.name for path in tmp_path.iterdir()] == ["taken.rrd"]
