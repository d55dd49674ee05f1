"""The laboratory in Python: a handful of calls from recordings to pictures, results that read as tables."""

from __future__ import annotations

import gc
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import twin
from recordings import InputError, read_run
from studies.force_levels import with_polynomials
from twin.lab.identified_joint import IdentifiedJoint
from twin.lab.recording import as_runs
from twin.lab.rehearsed import RehearsedProcedure
from twin.procedures import SteppedSine
from twin.procedures.tables import Measure
from twin.rigs import Rig, load_rig

DATA = Path(__file__).parents[2] / "data"


@pytest.fixture(scope="module")
def model(campaign: Path) -> IdentifiedJoint:
    runs = [campaign / "random.mcap", campaign / "sweeps.mcap"]
    found = twin.load_rig("steel-lap-joint").identify(runs, beside=with_polynomials)
    assert isinstance(found, IdentifiedJoint)
    return found


@pytest.fixture(scope="module")
def rehearsed() -> RehearsedProcedure:
    procedure = SteppedSine(frequencies=[24.0, 25.0, 26.0], amplitudes=[1.0], measure=Measure(seconds=0.5))
    return twin.load_rig("steel-lap-joint").rehearse(procedure, rounds=0)


def is_png(figure: Figure) -> bool:
    return bool(figure._repr_png_().startswith(b"\x89PNG"))  # type: ignore[attr-defined]


def test_importing_it_imports_nothing_heavy() -> None:
    code = "import sys, twin; print(*[m for m in ('numpy', 'scipy', 'numba', 'matplotlib') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300)
    assert done.stdout.split() == []


def test_the_names_it_promises_are_there_and_no_others() -> None:
    assert {"InputError", "load_rig", "load_run"} <= set(dir(twin))
    assert all(getattr(twin, name) is not None for name in twin.__all__)
    with pytest.raises(AttributeError, match="load_rigs"):
        twin.load_rigs  # noqa: B018


def test_what_was_true_of_the_rig_is_identified(model: IdentifiedJoint, true_rig: Rig) -> None:
    true = true_rig.joint.preload["120N"]
    for name in ("normal_modulus", "shear_modulus"):
        found = model.found.linear[name]
        assert not isinstance(found, list)
        assert abs(found.value - getattr(true, name)) < 5 * found.std
        assert found.std < 0.02 * found.value
    assert max(model.found.residual_percent.values()) < 0.5


def test_a_model_reads_as_tables(model: IdentifiedJoint) -> None:
    text, html = repr(model), model._repr_html_()
    first = model.found.linear["normal_modulus"]
    assert not isinstance(first, list)
    assert f"E′ = {first.scaled(1e-6)} N/mm²" in text
    lines = text.splitlines()
    rule = next(i for i, line in enumerate(lines) if line.startswith("──"))
    ends = [match.end() for match in re.finditer("─+", lines[rule])]
    assert all(len(line) <= ends[-1] for line in lines[rule : rule + 9]), "columns end under their rule"
    assert html.count("<table>") == html.count("</table>") == 3


def test_every_picture_is_a_figure_that_a_notebook_shows(model: IdentifiedJoint) -> None:
    for draw in (model.plot_law, model.plot_sweeps, model.plot_residuals, model.plot_broadband, model.plot_strength):
        figure = draw()
        assert isinstance(figure, Figure)
        assert all(axes.get_xlabel() for axes in figure.axes if axes.get_subplotspec().is_last_row())
    assert is_png(model.plot_modes())


def test_the_sweeps_are_drawn_at_their_true_height(model: IdentifiedJoint, campaign: Path) -> None:
    recording = twin.load_run(campaign / "sweeps.mcap")
    highest = max(float(sweep.receptance["acc2"].max()) for sweep in recording.sweeps)
    for figure in (model.plot_sweeps(), recording.plot_sweeps()):
        drawn = max(float(np.max(line.get_ydata())) for line in figure.axes[1].get_lines())
        assert drawn == pytest.approx(highest, rel=0.01)


def test_the_model_goes_on_as_a_rig(model: IdentifiedJoint, tmp_path: Path) -> None:
    model.save(tmp_path / "model.toml")
    loaded = twin.load_rig(tmp_path / "model.toml")
    assert loaded.file == model.rig.file == load_rig(tmp_path / "model.toml")
    found, again = (rig.predict([26.0, 26.4], force_N=1.5).response for rig in (model.rig, loaded))
    assert np.array_equal(found.acceleration_m_per_s2, again.acceleration_m_per_s2)
    assert list(tmp_path.iterdir()) == [tmp_path / "model.toml"]


def test_a_prediction_meets_what_was_measured(model: IdentifiedJoint, campaign: Path) -> None:
    """Of a sweep at 4.5 N that nothing was learnt from; where the response folds, it is on one of the branches."""
    (sweep,) = twin.load_run(campaign / "heldout.mcap").sweeps
    predicted = model.rig.predict(sweep.frequency_Hz, force_N=4.5).response
    w2 = (2 * np.pi * sweep.frequency_Hz) ** 2
    measured = 1e-3 * sweep.receptance["acc2"] * w2 * 4.5
    error = np.abs(predicted.acceleration_m_per_s2 / measured[predicted.step] - 1)
    nearest = [error[predicted.step == step].min() for step in range(len(measured))]
    assert max(nearest) < 0.03


def test_a_prediction_takes_one_kind_of_target() -> None:
    rig = twin.load_rig("steel-lap-joint")
    with pytest.raises(ValueError, match="either"):
        rig.predict([26.0], force_N=1.0, acceleration_m_per_s2=1.0)
    with pytest.raises(ValueError, match="2 frequencies, but 3 values"):
        rig.predict([26.0, 27.0], force_N=[1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="above zero"):
        rig.predict([26.0], force_N=-1.0)
    held = rig.predict([26.0], acceleration_m_per_s2=2.0)
    assert "force" not in held.given
    assert is_png(held.plot())


def test_runs_are_taken_as_files_or_in_memory(campaign: Path) -> None:
    path = campaign / "heldout.mcap"
    given = as_runs([str(path), path, read_run(path), twin.load_run(path)])
    samples = [run.device_of("acc2").values["acc2"] for run in given]
    assert all(np.array_equal(one, samples[0]) for one in samples)


def test_a_recording_reads_as_tables_and_keeps_its_peaks(campaign: Path) -> None:
    recording = twin.load_run(campaign / "random.mcap")
    assert "acc2" in repr(recording)
    assert "<th scope=" in recording._repr_html_()
    (line,) = recording.plot_samples("acc2").axes[0].get_lines()
    samples = recording.run.device_of("acc2").values["acc2"]
    assert len(samples) > 5 * len(line.get_xdata())
    assert np.max(line.get_ydata()) == samples.max()
    assert np.min(line.get_ydata()) == samples.min()
    (line,) = recording.plot_samples("acc2", start_s=1.0, duration_s=0.1).axes[0].get_lines()
    assert 0.999 <= np.min(line.get_xdata()) < np.max(line.get_xdata()) <= 1.1001
    with pytest.raises(ValueError, match="no sine sweeps"):
        recording.plot_sweeps()


def test_a_rehearsal_is_a_run_with_an_answer(rehearsed: RehearsedProcedure, tmp_path: Path) -> None:
    assert rehearsed.sentence.startswith("The procedure ")
    (sweep,) = rehearsed.recording.sweeps
    assert sweep.frequency_Hz.tolist() == [24.0, 25.0, 26.0]
    assert is_png(rehearsed.plot_responses())
    with pytest.raises(ValueError, match="no resonance number 2: sweeps were rehearsed about 1"):
        rehearsed.plot_responses(resonance=2)
    assert is_png(rehearsed.plot_range())
    assert "peak at, Hz" in repr(rehearsed)
    rehearsed.report(tmp_path / "report.html")
    assert (tmp_path / "report.html").stat().st_size > 10_000


def test_recordings_that_nobody_keeps_go_with_the_rehearsal() -> None:
    procedure = SteppedSine(frequencies=[24.0], amplitudes=[1.0], measure=Measure(seconds=0.2))
    rehearsed = twin.load_rig("steel-lap-joint").rehearse(procedure, rounds=0)
    path = rehearsed.first.recording
    assert path.exists()
    del rehearsed
    gc.collect()
    assert not path.parent.exists()


def test_tables_are_diagnosed_and_the_model_goes_on(tmp_path: Path) -> None:
    found = twin.load_rig("brake-reuss").diagnose(DATA / "brake-reuss" / "response_control.csv")
    assert found.verdict == "unknown"
    assert found.sentence in repr(found)
    assert found.save(tmp_path / "kept")["extended_model"] == "extended.toml"
    assert twin.load_rig(tmp_path / "kept" / "extended.toml").file == found.rig.file
    assert len(found.rig.predict([80.2], acceleration_m_per_s2=30.0).response.force_N) == 1


@pytest.mark.parametrize(
    ("use", "told"),
    [
        (lambda: twin.load_rig("gremlin"), "shipped rigs"),
        (lambda: twin.load_rig("composite-beam").rehearse("steel-sweeps"), "here a rig of format 1 or 2 is needed"),
        (lambda: twin.load_rig("brake-reuss").identify("run.mcap"), "one table of sweeps"),
        (lambda: twin.load_rig("steel-lap-joint").identify("nowhere.mcap", preload="99N"), "99N"),
        (lambda: twin.load_rig("steel-lap-joint").diagnose("nowhere.mcap"), "no such file"),
        (lambda: twin.load_rig("composite-beam").predict([26.0], force_N=1.0), "is a beam alone"),
        (lambda: twin.load_run("nowhere.mcap"), "nowhere.mcap"),
    ],
)
def test_mistakes_are_told_in_one_line(use, told) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError, match=told) as caught:
        use()
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_from_recordings_to_a_diagnosis_in_a_handful_of_calls(campaign: Path, tmp_path: Path) -> None:
    rig = twin.load_rig("steel-lap-joint")
    found = rig.diagnose([campaign / "random.mcap", campaign / "sweeps.mcap"], held_out=campaign / "heldout.mcap")
    assert found.verdict == "none"
    assert "noise floor" in repr(found)
    found.report(tmp_path / "report.html")
    found.save(tmp_path)
    assert twin.load_rig(tmp_path / "extended.toml").file == found.rig.file
