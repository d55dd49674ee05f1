"""A run shown as it happens: what is drawn, and that nothing waits for the drawing."""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recorded_views import CHANNELS, STEP, FREQUENCIES_Hz, RATE_Hz, columns, sdof_receptance, value_at, verify

from recordings import Event, Run, SampleBlock, Step
from recordings.run import StepState
from twin.procedures import Random, SteppedSine, StepResult
from twin.views.live import view as live_view
from twin.views.live.about import LiveAbout
from twin.views.live.drawing import LiveDrawing
from twin.views.live.view import ROOM_BLOCKS, LiveView
from twin.views.rerun.rrd import recording_file

LEVEL_N = 2.0
PROCEDURE = SteppedSine(frequencies=list(FREQUENCIES_Hz), amplitudes=[LEVEL_N], sample_rate=RATE_Hz)


def about(**others: Any) -> LiveAbout:
    return LiveAbout(title="one resonance", channels=CHANNELS, procedure=PROCEDURE, **others)


def blocks_of(run: Run) -> list[SampleBlock]:
    device = run.devices["daq"]
    return [
        SampleBlock(
            device="daq", time_ns=round(start / RATE_Hz * 1e9), first_index=start, sample_rate_Hz=RATE_Hz,
            samples={name: values[start : start + STEP] for name, values in device.values.items()},
        )
        for start in range(0, len(device), STEP)
    ]  # fmt: skip


def result_at(index: int, *, sweep: str = "2N-up") -> StepResult:
    frequency = FREQUENCIES_Hz[index]
    acceleration = -((2 * np.pi * frequency) ** 2) * sdof_receptance(frequency) * LEVEL_N
    return StepResult(
        sweep=sweep, index=index, frequency_Hz=frequency, target_channel="force", target_amplitude=LEVEL_N,
        voltage_V=1.0, amplitude=LEVEL_N, settle_s=0.5, measure_s=0.5,
        phasors={"force": LEVEL_N + 0j, "acc1": complex(acceleration)},
        harmonics={"acc1": (abs(acceleration), 0.01 * abs(acceleration), 0.001 * abs(acceleration))},
    )  # fmt: skip


def step(state: StepState, index: int = 0) -> Step:
    return Step(
        time_ns=0, sweep="2N-up", index=index, frequency_Hz=25.0, target_channel="force", target_amplitude=LEVEL_N,
        state=state,
    )  # fmt: skip


@pytest.fixture(scope="module")
def view(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four seconds of a run, by way of the other process."""
    path = tmp_path_factory.mktemp("live") / "live.rrd"
    frequency = np.linspace(23, 26, 30)
    amplitude = [LEVEL_N * abs(sdof_receptance(f)) * (2 * np.pi * f) ** 2 for f in frequency]
    branch = {"force_N": LEVEL_N, "frequency_Hz": list(frequency), "response": {"acc1": {"amplitude": amplitude}}}
    live = LiveView(about(branches=(branch,)), path)
    end_ns = 0
    for index, block in enumerate(blocks_of(run)[:4]):
        live.show(step(StepState.SETTLING, index), end_ns)
        live.show(block)
        end_ns = block.time_ns + 10**9
        live.show(result_at(index), end_ns)
    live.show(Event(time_ns=end_ns, source="acc1", kind="overload", detail="3 samples"), end_ns)
    live.show(step(StepState.DONE, 3), end_ns)
    assert live.close()
    assert live.not_shown == 0
    return path


@pytest.fixture(scope="module")
def found(view: Path) -> dict[str, dict[str, list[Any]]]:
    return columns(view)


def test_a_kept_view_passes_the_verifier(view: Path) -> None:
    verify(view)
    assert [path.name for path in view.parent.iterdir()] == ["live.rrd"]


def test_all_samples_are_drawn(run: Run, found: dict[str, dict[str, list[Any]]]) -> None:
    rows = found["/signals/acc1"]["Scalars:scalars"]
    shown = np.array([row[0] for row in rows if row])
    assert shown[np.isfinite(shown)] == pytest.approx(run.devices["daq"].values["acc1"][: 4 * STEP])


def test_the_sweep_grows_by_a_point_a_step_at_its_true_height(found: dict[str, dict[str, list[Any]]]) -> None:
    grown = found["/sweeps/2N-up/steps"]["Points2D:positions"]
    assert [len(points) for points in grown] == [1, 2, 3, 4]
    drawn = [value_at(found["/sweeps/axes/y"], y) for _, y in grown[-1]]
    assert drawn == pytest.approx([1e3 * abs(sdof_receptance(f)) for f in FREQUENCIES_Hz], rel=2e-3)


def test_the_predicted_branch_is_there_before_the_first_step(found: dict[str, dict[str, list[Any]]]) -> None:
    branch = found["/sweeps/branches/0"]
    assert branch["time"][0] == 0
    (dashes,) = branch["LineStrips2D:strips"]
    top = max(value_at(found["/sweeps/axes/y"], y) for dash in dashes for _, y in dash)
    assert top == pytest.approx(1e3 * abs(sdof_receptance(25.0)), rel=0.02)


def test_harmonics_and_events_are_told(found: dict[str, dict[str, list[Any]]]) -> None:
    heights = [point[1] for point in found["/harmonics/2/steps"]["Points2D:positions"][-1]]
    assert [value_at(found["/harmonics/axes/y"], y) for y in heights] == pytest.approx([-40.0] * 4, abs=0.2)
    texts = [row[0] for row in found["/events"]["TextLog:text"]]
    assert texts == ["0.0 s  recording begins", "0.0 s  2N-up begins", "4.0 s  acc1: overload 3 samples",
                     "4.0 s  2N-up done"]  # fmt: skip


def test_a_range_is_used_as_far_as_its_largest_sample(run: Run, found: dict[str, dict[str, list[Any]]]) -> None:
    largest = max(np.abs(block.samples["acc1"]).max() for block in blocks_of(run)[:4])
    (text,) = found["/ranges/acc1/text"]["Points2D:labels"][-1]
    assert text.startswith("acc1: ")
    assert float(text.split(", ")[1].rstrip(" %")) == pytest.approx(100 * largest / 490.0, rel=0.01)


def test_axes_widen_when_a_step_falls_outside(tmp_path: Path) -> None:
    """Without a rig nothing is known of the response, and yet no point is lost."""
    path = tmp_path / "grown.rrd"
    with recording_file(path) as recording:
        drawing = LiveDrawing(recording, about())
        for index in (0, 2):  # far below the resonance, then on it
            drawing.draw([(0, index * 10**9, result_at(index))])
    found = columns(path)
    scales = found["/sweeps/axes/y"]
    assert len(scales["Points2D:labels"]) > 1
    points = found["/sweeps/2N-up/steps"]["Points2D:positions"][-1]
    drawn = [value_at(scales, y) for _, y in points]
    assert drawn == pytest.approx([1e3 * abs(sdof_receptance(FREQUENCIES_Hz[i])) for i in (0, 2)], rel=2e-3)


def test_what_was_not_shown_is_a_gap_and_is_counted(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "gap.rrd"
    first, _, third, *_ = blocks_of(run)
    with recording_file(path) as recording:
        drawing = LiveDrawing(recording, about())
        drawing.draw([(0, 0, first)])
        drawing.draw([(1, 0, third)])
    found = columns(path)
    shown = np.array([row[0] for row in found["/signals/acc1"]["Scalars:scalars"] if row])
    assert np.isnan(shown[STEP + 1]), "the first sample after the gap does not join the last before it"
    assert "not shown | 1 |" in found["/now"]["TextDocument:text"][-1][0]
    assert any("the viewer is slow" in row[0] for row in found["/events"]["TextLog:text"])


def test_noise_is_shown_by_its_spectrum(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "random.rrd"
    t = np.arange(STEP) / RATE_Hz
    tone = (5.0 * np.sin(2 * np.pi * 100.0 * t)).astype(np.float32)  # a tenth of the force's range
    block = replace(blocks_of(run)[0], samples={"force": tone, "acc1": tone})
    procedure = Random(band=(5.0, 400.0), duration=10.0, rms=0.5, sample_rate=RATE_Hz)
    with recording_file(path) as recording:
        LiveDrawing(recording, replace(about(), procedure=procedure)).draw([(0, 0, block)])
    found = columns(path)
    (curve,) = found["/spectrum/force"]["LineStrips2D:strips"][-1]
    x, y = max(curve, key=lambda point: -point[1])
    assert value_at(found["/spectrum/axes/y"], y, log=True) == pytest.approx(0.1, rel=0.02)
    assert value_at(found["/spectrum/axes/x"], x, axis=0, log=True) == pytest.approx(100.0, rel=0.02)


def test_the_run_never_waits_for_a_view_that_stands_still(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_view, "FILE_END_S", 0.5)  # it ends in vain however long it is given
    live = LiveView(about(), tmp_path / "still.rrd")
    block = blocks_of(run)[0]
    os.kill(live._process.pid or 0, signal.SIGSTOP)
    for _ in range(2000):  # were one of them waited for, this test would not end
        live.show(block)
    # One block may have been on its way when the process was stopped.
    assert 2000 - ROOM_BLOCKS - 1 <= live.not_shown <= 2000 - ROOM_BLOCKS
    lost = live.not_shown
    live.show(result_at(0), 10**9)
    assert live.not_shown == lost, "steps find room where blocks do not"
    assert not live.close()
    assert not live._process.is_alive()
    assert not (tmp_path / "still.rrd").exists()


def test_a_view_whose_process_dies_does_not_end_the_run(run: Run, tmp_path: Path) -> None:
    live = LiveView(about(), tmp_path / "gone.rrd")
    os.kill(live._process.pid or 0, signal.SIGKILL)
    for block in blocks_of(run):
        live.show(block)
    assert not live.close()


def test_a_file_that_cannot_be_written_is_told_before_the_run(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="did not start"):
        LiveView(about(), tmp_path / "nowhere" / "live.rrd")
