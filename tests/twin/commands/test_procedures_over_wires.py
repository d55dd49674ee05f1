"""Broadband procedures over a pseudo-terminal and CAN: what the generator was told, it puts out."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from recordings import Run, read_run

MULTISINE = """
procedure = "multisine"
band = [10.0, 200.0]
rms = 0.5
period = 0.5
periods = 8
sample_rate = 1024.0
settle = { seconds = 4.0 }
store = "settled"
"""
PERIOD = 512


@pytest.fixture(scope="module")
def multisine(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("wires")
    (folder / "multisine.toml").write_text(MULTISINE)
    file, run = folder / "instruments.toml", folder / "run.mcap"
    twin = [sys.executable, "-m", "twin"]
    serve = [
        *twin, "serve", "--rig", "steel-lap-joint", "--serial", "auto", "--can", f"unixbus:{folder}/bus",
        "--speed", "fast", "--instruments-out", str(file),
    ]  # fmt: skip
    with subprocess.Popen(serve, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            assert all(server.stdout.readline() for _ in range(2))
            acquire = [*twin, "acquire", str(folder / "multisine.toml"), "--instruments", str(file), "--json"]
            done = subprocess.run([*acquire, "--out", str(run)], capture_output=True, text=True, timeout=300)
            assert done.returncode == 0, done.stderr
            assert json.loads(done.stdout)["events"] == {}
            server.send_signal(signal.SIGINT)
            assert server.wait(60) == 0
        finally:
            server.kill()
    return read_run(Path(run))


def test_a_multisine_repeats_on_every_device(multisine):
    for device in multisine.devices.values():
        for values in device.values.values():
            periods = values[: 8 * PERIOD].astype(float).reshape(8, PERIOD)
            assert np.std(np.diff(periods, axis=0)) < 0.1 * np.std(periods)


def test_its_lines_are_the_multiples_of_one_over_its_period_in_the_band(multisine):
    force = multisine.devices["daq"].values["force"][: 8 * PERIOD].astype(float)
    assert np.std(force) == pytest.approx(0.5, rel=0.05)
    size = np.abs(np.fft.rfft(force))
    frequency = np.fft.rfftfreq(8 * PERIOD, 1 / 1024)
    on_lines = np.zeros(len(size), bool)
    on_lines[::8] = True
    between = size[(frequency > 10) & (frequency < 200) & ~on_lines]
    assert np.median(size[(frequency >= 10) & (frequency <= 200) & on_lines]) > 20 * np.median(between)
