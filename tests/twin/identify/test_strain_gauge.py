"""A strain gauge beside an accelerometer: recorded over a line and a bus, reduced, identified against, drawn."""

from __future__ import annotations

import json
import threading
from dataclasses import replace

import numpy as np
import pytest

from drivers.virtual import Addresses, VirtualRig
from recordings import read_run
from twin.bench import open_bench
from twin.cli import main
from twin.identify import gather_data
from twin.lab import load_run
from twin.rigs import Sensor, load_rig, save_rig
from twin.views.receptance import per_force, per_force_label

STEEL = load_rig("steel-lap-joint")
GAUGE = Sensor(channel="gauge", quantity="strain", position=0.02, range=2e-3, noise_density=2e-9)


def strained(*others):
    kept = [s for s in STEEL.sensor if s.channel in ("force", *others)]
    return STEEL.model_copy(update={"sensor": [*kept, GAUGE]})


def run(*words):
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return ended.value.code


@pytest.mark.parametrize(("line", "device"), [({"serial": "auto"}, "daq"), ({"serial": "auto", "can": "bus"}, "can")])
def test_it_is_recorded_over_the_line_and_over_the_bus(line, device, tmp_path):
    if "can" in line:
        line = line | {"can": f"unixbus:{tmp_path}/bus"}
    rig = VirtualRig(open_bench(strained(), seed=1), Addresses(**line))
    (tmp_path / "instruments.toml").write_text(rig.instruments_toml)
    stop = threading.Event()
    thread = threading.Thread(target=rig.serve, args=(stop.is_set,))
    thread.start()
    try:
        file = tmp_path / "instruments.toml"
        assert run("acquire", "--instruments", file, "--seconds", 1, "--out", tmp_path / "a.mcap") == 0
    finally:
        stop.set()
        thread.join(60)
    recorded = read_run(tmp_path / "a.mcap")
    gauge = recorded.channels["gauge"]
    assert (gauge.quantity, gauge.unit, gauge.device) == ("strain", "m/m", device)
    assert gauge.range == pytest.approx(2e-3)
    values = recorded.device_of("gauge").values["gauge"]
    assert np.isfinite(values).all()
    assert 0 < np.std(values) < 2e-3


@pytest.fixture(scope="module")
def noise(tmp_path_factory):
    folder = tmp_path_factory.mktemp("strain")
    (folder / "noise.toml").write_text('procedure = "random"\nband = [5.0, 1000.0]\nrms = 0.5\nduration = 30.0\n')
    save_rig(strained("acc2"), folder / "strained.toml")
    words = [folder / "noise.toml", "--rig", folder / "strained.toml", "--rounds", 0, "--out", folder / "noise"]
    assert run("rehearse", *words, "--quiet") == 0
    return folder


def test_moduli_are_identified_from_an_accelerometer_and_a_gauge(noise, capsys):
    words = [noise / "noise" / "run.mcap", "--rig", noise / "strained.toml", "--out", noise / "found.toml", "--json"]
    assert run("identify", *words) == 0
    told = capsys.readouterr()
    found, true = json.loads(told.out)["linear"], STEEL.joint.preload["120N"]
    assert found["normal_modulus"]["value"] == pytest.approx(true.normal_modulus, rel=0.02)
    assert found["shear_modulus"]["value"] == pytest.approx(true.shear_modulus, rel=0.02)
    assert "chi2" not in told.err  # the gauge agrees with the model, not the accelerometer alone
    # A gauge of ten per cent more would not.
    run_ = read_run(noise / "noise" / "run.mcap")
    device = run_.device_of("gauge")
    wrong = replace(device, values={**device.values, "gauge": 1.1 * device.values["gauge"]})
    chi2 = []
    for one in (run_, replace(run_, devices={**run_.devices, "daq": wrong})):
        evidence = gather_data([one], strained("acc2"))
        chi2.append(evidence.linear.chi2_per_dof)
    assert chi2[0] < 1 < 3 < chi2[1]


def test_it_is_drawn_in_its_unit(noise):
    recording = load_run(noise / "noise" / "run.mcap")
    rows = {row[0]: row[1:3] for row in recording.tables()[0].rows}
    assert rows["gauge"] == ("strain", "±0.002 m/m")
    assert per_force_label("gauge", "strain") == "strain at gauge per force, µm/m/N"
    assert per_force(np.array([2e-6]), "strain", np.array([10.0])) == pytest.approx(2.0)
    assert run("view", noise / "noise" / "run.mcap", "--save", noise / "run.rrd") == 0
    assert (noise / "run.rrd").stat().st_size > 10_000
