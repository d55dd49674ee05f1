"""`twin demo`: what is hidden stays hidden, what is measured is kept, and the answer is the hidden cause."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

import twin.demo
from recordings import RunWriter, check_run, read_run
from twin.bench import FIRST_CAUSES, open_bench
from twin.commands.common.served import ServedRig, ServedRigError
from twin.commands.common.stages import Stages
from twin.commands.demo import _measure
from twin.demo import broadband, draw_demo_case, planned_sweeps, recording_names, resonance
from twin.procedures import DirectAcquisition, run_procedure
from twin.rigs import load_rig, save_rig
from twin.structure import assemble, normal_modes

RIG = load_rig("steel-lap-joint")


def test_a_seed_always_hides_the_same():
    one, same, other = (draw_demo_case(RIG, seed=seed) for seed in (5, 5, 6))
    assert one == same
    assert one != other


def test_every_first_cause_is_drawn_by_some_seed():
    assert {draw_demo_case(RIG, seed=seed).hidden["cause"] for seed in range(60)} == set(FIRST_CAUSES)


def test_nothing_hidden_is_told_as_none():
    case = draw_demo_case(RIG, seed=1, cause="none")
    assert case.hidden == {"cause": "none", "parameters": {}}
    assert case.rig.effect == []


def test_sweeps_move_with_the_resonance():
    here, there = planned_sweeps(RIG, 26.3), planned_sweeps(RIG, 24.0)
    for name in here:
        assert np.asarray(there[name].frequencies) == pytest.approx(
            np.asarray(here[name].frequencies) * 24.0 / 26.3, abs=1e-4
        )
        assert min(here[name].frequencies) < 26.3 < max(here[name].frequencies)


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_sweeps_about_every_mode_enclose_its_resonance(mode):
    structure, moduli = assemble(RIG), RIG.joint.preload["120N"]
    K = structure.stiffness(moduli.normal_modulus, moduli.shear_modulus)
    natural_Hz = normal_modes(structure.M, K, count=3).omega[mode - 1] / (2 * np.pi)
    planned = planned_sweeps(RIG, natural_Hz, mode)
    assert tuple(planned) == recording_names(mode)
    for procedure in planned.values():
        assert min(procedure.frequencies) < 0.99 * natural_Hz
        assert max(procedure.frequencies) > 1.01 * natural_Hz
        assert procedure.sample_rate > 7 * natural_Hz


def test_mode_1_is_read_off_a_broadband_run(tmp_path):
    noise = broadband().model_copy(update={"duration": 20.0})
    acquisition = DirectAcquisition(open_bench(RIG, seed=3))
    path = tmp_path / "noise.mcap"
    with RunWriter(path, info={"source": "simulated", "stored": "settled"}, channels=acquisition.channels) as writer:
        assert run_procedure(noise, acquisition, writer).state == "done"
    structure = assemble(RIG)
    moduli = RIG.joint.preload["120N"]
    K = structure.stiffness(moduli.normal_modulus, moduli.shear_modulus)
    frequency_Hz = normal_modes(structure.M, K, count=1).omega[0] / (2 * np.pi)
    found = resonance(read_run(path), RIG)
    assert found == pytest.approx(frequency_Hz, abs=0.25)  # the shaker and its stinger pull a little


@pytest.mark.slow
def test_runs_are_measured_through_instruments_and_tell_nothing_of_the_truth(tmp_path, monkeypatch):
    case = draw_demo_case(RIG, seed=2, cause="added-mass")
    hidden, out = tmp_path / "hidden", tmp_path / "out"
    hidden.mkdir()
    out.mkdir()
    save_rig(case.rig, hidden / "truth.toml")
    short = {
        name: p.model_copy(update={"frequencies": p.frequencies[:2]}) for name, p in planned_sweeps(RIG, 20.0).items()
    }
    monkeypatch.setattr(twin.demo, "broadband", lambda: broadband().model_copy(update={"duration": 5.0}))
    monkeypatch.setattr(twin.demo, "planned_sweeps", lambda rig, resonance_Hz: short)
    with Stages() as stages, ServedRig(hidden / "truth.toml", folder=hidden, seed=1) as served:
        served.wait_ready()
        runs = _measure(served.instruments, RIG, out, stages)
    assert sorted(path.name for path in out.iterdir()) == ["broadband.mcap", "held-out.mcap", "run.mcap"]
    for name, run in runs.items():
        assert check_run(out / name).sound
        assert b"effect" not in run.attachments["rig.toml"]
        assert b"added-mass" not in (out / name).read_bytes()
        assert {channel.device for channel in run.channels.values()} == {"daq", "can"}
        assert not any(device.gaps for device in run.devices.values())
    targets = [step.target_amplitude for step in runs["run.mcap"].steps if step.state.name == "MEASURING"]
    assert targets == [1.5, 1.5, 3.0, 3.0, 6.0, 6.0]


def test_instruments_that_do_not_start_are_told_with_their_reason(tmp_path):
    with (
        pytest.raises(ServedRigError, match="no-such"),
        ServedRig(Path("no-such.toml"), folder=tmp_path, seed=0) as rig,
    ):
        rig.wait_ready()


@pytest.mark.slow
def test_an_interrupted_demonstration_stops_its_instruments(tmp_path, installed_twin):
    out = tmp_path / "out"
    command = [installed_twin, "demo", "--out", str(out), "--seed", "2"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            give_up = time.monotonic() + 120
            # Until something has been measured: an interrupt while the file is being opened has nothing to keep.
            while not (out / "run.mcap").exists() or (out / "run.mcap").stat().st_size < 50_000:
                assert process.poll() is None
                assert time.monotonic() < give_up
                time.sleep(0.1)
            children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
            process.send_signal(signal.SIGINT)
            assert process.wait(120) == 130
        finally:
            process.kill()
        assert process.stderr is not None
        assert process.stderr.read().strip().endswith("twin: interrupted")
    assert children
    give_up = time.monotonic() + 5
    while any(Path(f"/proc/{child}").exists() for child in children):  # those of Python's own pools notice it
        assert time.monotonic() < give_up
        time.sleep(0.05)
    assert check_run(out / "run.mcap").sound  # what was measured until then
    assert not (out / "result.json").exists()


@pytest.mark.slow
def test_the_demonstration_names_what_was_hidden(tmp_path, installed_twin):
    command = [installed_twin, "demo", "--out", str(tmp_path / "out"), "--seed", "3", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200, check=False)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert json.loads((tmp_path / "out" / "result.json").read_text()) == result
    assert result["seed"] == 3
    assert result["hidden"]["cause"] == result["found"]["causes"][0]["cause"]
    held = result["found"]["gain"]["held_out"]
    assert held["before"] > 5 * held["after"]
    assert all((tmp_path / "out" / name).stat().st_size for name in result["files"].values())
