"""`--view`, `--view-to` and `--save-view`: whatever becomes of the viewer, the run is recorded whole."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "views"))  # reading views

from recorded_views import columns, value_at, verify

from recordings import InputError, read_run
from twin.cli import main
from twin.views.rerun.viewer import Viewer, open_viewer, viewer_url

SWEEP = """
procedure = "stepped-sine"
frequencies = [26.0, 26.4]
amplitudes = [0.2]
settle = { tolerance = 0.005 }
measure = { seconds = 1.0 }
"""
DWELLS = """
procedure = "stepped-sine"
store = "all"
sample_rate = 2048.0
frequencies = [30.0, 30.1, 30.2, 30.3, 30.4, 30.5, 30.6, 30.7]
amplitudes = [0.5]
settle = { seconds = 0.5 }
measure = { seconds = 0.5 }
"""


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    """What listens as a viewer does, without the graphics."""
    viewer = open_viewer("--serve-grpc")
    yield viewer
    os.killpg(viewer.process.pid, signal.SIGKILL)
    viewer.process.wait(60)


def address(viewer: Viewer) -> str:
    return viewer.url.removeprefix("rerun+http://").removesuffix("/proxy")


def call(*arguments: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main([*map(str, arguments)])
    return int(ended.value.code or 0)


@pytest.mark.slow
def test_a_rehearsal_keeps_its_live_view(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.toml").write_text(SWEEP)
    view, out = tmp_path / "live.rrd", tmp_path / "out"
    assert call(
        "rehearse", tmp_path / "mine.toml", "--rig", "steel-lap-joint", "--out", out, "--rounds", 0,
        "--save-view", view, "--json",
    ) == 0  # fmt: skip
    step = json.loads(capsys.readouterr().out)["steps"][-1]
    verify(view)
    found = columns(view)
    assert "/sweeps/branches/0" in found
    (x, y) = found["/sweeps/0.2N-up/steps"]["Points2D:positions"][-1][-1]
    acceleration, force = (step["phasors"][name]["amplitude"] for name in ("acc2", "force"))
    receptance = 1e3 * acceleration / force / (2 * np.pi * step["frequency_Hz"]) ** 2
    assert value_at(found["/sweeps/axes/y"], y) == pytest.approx(receptance, rel=5e-3)
    assert value_at(found["/sweeps/axes/x"], x, axis=0) == pytest.approx(step["frequency_Hz"], rel=1e-4)


@pytest.mark.nightly
@pytest.mark.parametrize("ending", [signal.SIGSTOP, signal.SIGKILL])
def test_an_acquisition_loses_nothing_with_its_viewer(ending: signal.Signals, viewer: Viewer, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(DWELLS)
    instruments, run = tmp_path / "instruments.toml", tmp_path / "run.mcap"
    twin = [sys.executable, "-m", "twin"]
    serve = [*twin, "serve", "--rig", "steel-lap-joint", "--serial", "auto", "--instruments-out", str(instruments)]
    with subprocess.Popen(serve, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as server:
        try:
            assert server.stdout is not None
            server.stdout.readline()
            acquire = [*twin, "acquire", str(tmp_path / "mine.toml"), "--instruments", str(instruments), "--out"]
            acquire += [str(run), "--view-to", address(viewer), "--json"]
            with subprocess.Popen(acquire, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as acquiring:
                until = time.monotonic() + 120
                while time.monotonic() < until and not (run.exists() and run.stat().st_size > 50_000):
                    time.sleep(0.05)
                os.killpg(viewer.process.pid, ending)
                told, said = acquiring.communicate(timeout=300)
        finally:
            server.kill()
    result = json.loads(told)
    assert result["state"] == "done"
    assert result["lost_samples"] == {"daq": 0}
    assert "Traceback" not in said
    recorded = read_run(run).devices["daq"]
    assert len(recorded) == result["samples"]["daq"]
    assert not recorded.gaps


def test_a_viewer_listens_on_loopback_alone(viewer: Viewer) -> None:
    port = int(address(viewer).rpartition(":")[2])
    elsewhere = [ip for *_, (ip, *_) in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)]
    for ip in {*elsewhere, "127.0.0.2"} - {"127.0.0.1"}:  # one that listens on all addresses answers on these too
        with socket.socket() as asked:
            asked.settimeout(2.0)
            assert asked.connect_ex((ip, port)) != 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--view"], "no display here"),
        (["--view-to", "nowhere"], "is no viewer's address"),
        (["--view-to", "127.0.0.1:9"], "no viewer listens there"),
        (["--view", "--view-to", "127.0.0.1:9"], "goes not with --view-to"),
        (["--save-view", "live.txt"], "must end in .rrd"),
        (["--save-view", "nowhere/live.rrd"], "its folder does not exist"),
    ],
)
def test_what_cannot_be_shown_is_told_before_anything_moves(
    options: list[str],
    message: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(SWEEP)
    if message == "no display here" and sys.platform in ("darwin", "win32"):
        pytest.skip("has a screen of its own")
    assert call("rehearse", "mine.toml", "--rig", "steel-lap-joint", "--out", "out", *options) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("rubbish", ["", ":", "a:b", "host:99999", "http://host:80/elsewhere", "rerun+http://:1/proxy"])
def test_rubbish_is_no_address(rubbish: str) -> None:
    with pytest.raises(InputError, match="no viewer's address"):
        viewer_url(rubbish)
