"""Recordings of the second bench keep to the contract, and say what the tests did."""

from dataclasses import replace

import numpy as np
import pytest

from recordings import StepState, check_run, read_run
from tests.second_bench.believed import BELIEVED, TRANSDUCERS
from tests.second_bench.channels import Wiring
from tests.second_bench.plans import Noise, sweeps_of
from tests.second_bench.recorder import Campaign

NOISE = Noise(seconds=2)
SWEEPS = replace(sweeps_of(1, 26.45)[0], frequencies_Hz=(25.0, 25.2), forces_N=(1.5, 3.0), measured_s=1.0)


def campaign(*, stored, specimen=BELIEVED):
    rng = np.random.default_rng(5)
    return Campaign(specimen, {t.channel: Wiring.drawn(rng, t) for t in TRANSDUCERS}, rng, stored)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("second-bench")
    one = campaign(stored="settled")
    one.record_noise(folder / "noise.mcap", NOISE)
    one.record_sweeps(folder / "sweeps.mcap", SWEEPS)
    return folder


@pytest.mark.parametrize("name", ["noise.mcap", "sweeps.mcap"])
def test_they_are_sound(recorded, name):
    report = check_run(recorded / name)
    assert report.sound, report


def test_steps_are_named_and_held(recorded):
    run = read_run(recorded / "sweeps.mcap")
    measured = [step for step in run.steps if step.state == StepState.MEASURING]
    assert [step.sweep for step in measured] == ["1.5N-up"] * 2 + ["3N-up"] * 2
    for step in measured:
        force = run.between("force", step.time_ns, step.time_ns + 10**9)
        assert np.sqrt(2) * force.std() == pytest.approx(step.target_amplitude, rel=0.01)


def test_waits_are_stored_where_the_run_says_so(tmp_path, recorded):
    path = tmp_path / "all.mcap"
    campaign(stored="all").record_sweeps(path, SWEEPS)
    whole, settled = read_run(path), read_run(recorded / "sweeps.mcap")
    assert (whole.info["stored"], settled.info["stored"]) == ("all", "settled")
    assert len(settled.devices["daq"]) == 4 * SWEEPS.stored_Hz
    assert len(whole.devices["daq"]) > 12 * SWEEPS.stored_Hz
    assert {step.state for step in whole.steps} == {StepState.SETTLING, StepState.MEASURING, StepState.DONE}


def test_the_force_has_the_rms_that_was_asked_for(recorded):
    run = read_run(recorded / "noise.mcap")
    assert np.std(run.devices["daq"].values["force"]) == pytest.approx(NOISE.rms, rel=0.05)


def test_what_drifts_drifts_by_recorded_time(tmp_path):
    one = campaign(stored="settled", specimen=replace(BELIEVED, moduli_rate=1e-3))
    one.record_sweeps(tmp_path / "sweeps.mcap", SWEEPS)
    assert one.clock_s == pytest.approx(4.0)
