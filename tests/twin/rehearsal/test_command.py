"""`twin rehearse` on the steel rig: results, exit status, interruption."""

import json
import os
import signal
import subprocess
import time
from contextlib import contextmanager

import pytest
from needed import program

from recordings import InputError, read_run
from recordings.recover import recover
from recordings.run import StepState
from twin.cli import main
from twin.commands.common.rehearsing import Meter
from twin.procedures import load_procedure
from twin.rigs import Effect, load_rig, save_rig

SWEEP = """
procedure = "stepped-sine"
frequencies = [26.0, 26.4]
amplitudes = [0.2]
settle = { tolerance = 0.005 }
measure = { seconds = 1.0 }
"""


def twin(*arguments):
    with pytest.raises(SystemExit) as ended:
        main(["rehearse", *map(str, arguments)])
    return ended.value.code


def test_results_say_what_was_rehearsed(tmp_path, capsys):
    (tmp_path / "mine.toml").write_text(SWEEP)
    out = tmp_path / "out"
    assert twin(tmp_path / "mine.toml", "--rig", "steel-lap-joint", "--out", out, "--json") == 0
    result = json.loads(capsys.readouterr().out)
    assert result == json.loads((out / "result.json").read_text())
    assert result["state"] == "done"
    assert result["duration_s"] == pytest.approx(sum(s["settle_s"] + s["measure_s"] for s in result["steps"]), abs=1)
    step = result["steps"][0]
    assert step["phasors"]["force"]["amplitude"] == pytest.approx(0.2, rel=0.005)
    assert 0 < step["range_use"]["force"] < 0.01
    assert set(step["limit_use"]) == {"voltage"}
    run = read_run(out / "run.mcap")
    assert run.info["preload_N"] == "120"
    assert set(run.attachments) == {"rig.toml", "procedure.toml"}
    assert step["transient"] < 0.005
    assert load_procedure(out / "procedure.toml").amplitudes == [0.2]
    assert "The procedure can be run as it is" in (out / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_recording_says_nothing_of_the_effects_of_the_rig(tmp_path):
    """They act in it nevertheless: the rig file of a diagnosis has them."""
    rig = load_rig("steel-lap-joint")
    heavier = Effect(cause="added-mass", parameters={"mass_kg": 0.05, "position_m": 0.42})
    save_rig(rig.model_copy(update={"effect": [heavier]}), tmp_path / "rig.toml")
    (tmp_path / "mine.toml").write_text(SWEEP)
    responses = []
    for name in ("steel-lap-joint", tmp_path / "rig.toml"):
        out = tmp_path / f"out-{len(responses)}"
        assert twin(tmp_path / "mine.toml", "--rig", name, "--out", out, "--rounds", "0") == 0
        run = read_run(out / "run.mcap")
        (tmp_path / "assumed.toml").write_bytes(run.attachments["rig.toml"])
        assert load_rig(tmp_path / "assumed.toml").effect == []
        step = json.loads((out / "result.json").read_text())["steps"][-1]
        responses.append(step["phasors"]["acc2"]["amplitude"])
    assert abs(responses[1] / responses[0] - 1) > 0.05


def test_a_procedure_that_must_not_be_run_ends_with_status_1(tmp_path):
    (tmp_path / "wild.toml").write_text(SWEEP + "limits = { peak = { acc2 = 0.5 } }\n")
    out = tmp_path / "out"
    assert twin(tmp_path / "wild.toml", "--rig", "steel-lap-joint", "--out", out, "--rounds", "0") == 1
    result = json.loads((out / "result.json").read_text())
    assert [caution["kind"] for caution in result["warnings"]] == ["limit-reached"]
    assert read_run(out / "run.mcap").steps[-1].state == StepState.ABORTED


@pytest.mark.parametrize(
    ("text", "arguments", "message"),
    [
        (SWEEP + 'target_channel = "torque"\n', [], "mine.toml: target_channel: no channel 'torque'"),
        (SWEEP + "dwell = 3\n", [], "mine.toml: dwell: "),
        (SWEEP, ["--preload", "9N"], "--preload: rig 'steel-lap-joint' has no preload '9N'"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(tmp_path, capsys, text, arguments, message):
    (tmp_path / "mine.toml").write_text(text)
    assert twin(tmp_path / "mine.toml", "--rig", "steel-lap-joint", "--out", tmp_path / "out", *arguments) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.parametrize("asked", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_rehearsal_keeps_what_it_has(asked, tmp_path, installed_twin):
    command = [installed_twin, "rehearse", "steel-sweeps", "--rig", "steel-lap-joint"]
    running = subprocess.Popen([*command, "--out", str(tmp_path)], stderr=subprocess.PIPE)
    try:
        recording = tmp_path / "run.mcap"
        until = time.monotonic() + 120
        # settling and measuring of the first step, settling of the second: one step at least is whole
        while time.monotonic() < until and _states_on_disk(recording, tmp_path / "so-far.mcap") < 3:
            time.sleep(0.05)
        running.send_signal(asked)
        _, error = running.communicate(timeout=120)
    finally:
        running.kill()
    assert running.returncode == 130, error.decode()
    run = read_run(recording)
    assert run.steps[-1].state == StepState.ABORTED
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["state"] == "interrupted"
    assert len(result["steps"]) > 0


@contextmanager
def two_rehearsals(folder, installed_twin):
    """Side by side, in a session of their own, each with a step at least."""
    preloads = ["--preload", "120N", "--preload", "540N"]
    command = [installed_twin, "rehearse", "steel-sweeps", "--rig", "steel-lap-joint", *preloads, "--quiet"]
    running = subprocess.Popen([*command, "--out", str(folder)], stderr=subprocess.PIPE, start_new_session=True)
    try:
        until = time.monotonic() + 240
        for name in ("120N", "540N"):
            recording = folder / name / "run.mcap"
            while time.monotonic() < until and _states_on_disk(recording, folder / "so-far.mcap") < 3:
                time.sleep(0.05)
        yield running
    finally:
        running.kill()
        running.communicate(timeout=120)


@pytest.mark.slow
@pytest.mark.parametrize("asked", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_to_the_parent_alone_ends_rehearsals_side_by_side(asked, tmp_path, installed_twin):
    with two_rehearsals(tmp_path, installed_twin) as running:
        running.send_signal(asked)
        _, error = running.communicate(timeout=120)
    assert running.returncode == 130
    assert error == b"", "asked to be quiet"
    for name in ("120N", "540N"):
        assert read_run(tmp_path / name / "run.mcap").steps[-1].state == StepState.ABORTED
        result = json.loads((tmp_path / name / "result.json").read_text())
        assert result["state"] == "interrupted"
        assert len(result["steps"]) > 0


@pytest.mark.slow
def test_rehearsals_whose_parent_is_killed_end_in_order(tmp_path, installed_twin):
    with two_rehearsals(tmp_path, installed_twin) as running:
        running.kill()
        until = time.monotonic() + 240
        written = [tmp_path / name / "result.json" for name in ("120N", "540N")]
        while time.monotonic() < until and not all(path.exists() for path in written):
            time.sleep(0.1)
        assert [json.loads(path.read_text())["state"] for path in written] == ["interrupted"] * 2


@pytest.mark.slow
def test_a_killed_rehearsal_is_told_in_one_line(tmp_path, installed_twin):
    with two_rehearsals(tmp_path, installed_twin) as running:
        listed = subprocess.run(
            [program("pgrep"), "-P", str(running.pid), "-f", "spawn_main"], capture_output=True, text=True, check=True
        )
        os.kill(int(listed.stdout.split()[0]), signal.SIGKILL)
        _, error = running.communicate(timeout=120)
    assert running.returncode == 2
    assert error.decode().count("\n") == 1
    assert "was ended from outside" in error.decode()


def test_marks_say_how_far_a_rehearsal_is():
    marks = []
    meter = Meter(3, marks.append, lambda: False)
    meter.begin("rehearsing", load_procedure("steel-sweeps"))
    meter.step(None)
    meter.time(90.0)
    assert [(mark.job, mark.text, mark.done, mark.total) for mark in marks] == [
        (3, "rehearsing, 1.5 min of rig time", 1, 3 * 41)
    ]
    with pytest.raises(KeyboardInterrupt):
        Meter(0, marks.append, lambda: True).time(1.0)


def _states_on_disk(recording, scratch):
    """How many states of steps a file that is still being written holds; kernels may be compiling before the first."""
    if not recording.exists():
        return 0
    scratch.unlink(missing_ok=True)
    try:
        recover(recording, scratch)
    except InputError:  # nothing of a run yet
        return 0
    return len(read_run(scratch).steps)


@pytest.mark.slow
def test_two_preloads_are_rehearsed_side_by_side(tmp_path, capfd):
    (tmp_path / "mine.toml").write_text(SWEEP)
    out = tmp_path / "out"
    preloads = ["--preload", "120N", "--preload", "540N"]
    assert twin(tmp_path / "mine.toml", "--rig", "steel-lap-joint", "--out", out, "--json", *preloads) == 0
    result = json.loads(capfd.readouterr().out)
    assert list(result["preloads"]) == ["120N", "540N"]
    for name, newtons in (("120N", "120"), ("540N", "540")):
        assert read_run(out / name / "run.mcap").info["preload_N"] == newtons
        assert json.loads((out / name / "result.json").read_text())["preload"] == name
