"""`twin serve`, `twin acquire` and `twin replay` as processes, the way a user runs them."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from two_steps import TWO_STEPS

from recordings import read_run
from twin.cli import main
from twin.commands.serve import JointMeter
from twin.rigs import Effect, load_rig


@contextmanager
def running(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], list[dict[str, str]]]]:
    """A server, and the addresses it has told."""
    command = [sys.executable, "-m", "twin", *arguments]
    expected = sum(option in arguments for option in ("--serial", "--tcp", "--can", "--meter"))
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            lines = [process.stdout.readline() for _ in range(expected)]
            assert all(lines), process.stderr.read() if process.stderr else ""
            yield process, [json.loads(line) for line in lines]
        finally:
            process.kill()


def twin(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "twin", *arguments], capture_output=True, text=True, timeout=300, check=False
    )


@pytest.fixture(scope="module")
def acquired(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short sweep of the steel rig over a pseudo-terminal and CAN, as fast as it goes."""
    folder = tmp_path_factory.mktemp("acquired")
    (folder / "sweep.toml").write_text(TWO_STEPS)
    arguments = ["--serial", "auto", "--can", f"unixbus:{folder}/bus", "--speed", "fast"]
    file = str(folder / "instruments.toml")
    with running("serve", "--rig", "steel-lap-joint", *arguments, "--instruments-out", file) as (server, addresses):
        assert [address["device"] for address in addresses] == ["daq", "can"]
        run = folder / "run.mcap"
        done = twin(
            "acquire", str(folder / "sweep.toml"), "--instruments", file, "--out", str(run),
            "--rig", "steel-lap-joint", "--json",
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        result = json.loads(done.stdout)
        server.send_signal(signal.SIGINT)
        assert server.wait(60) == 0
    assert result["state"] == "done"
    assert result["steps"] == 2
    assert result["events"] == {}
    return run


def test_a_sweep_over_serial_and_can_is_recorded_whole(acquired):
    run = read_run(acquired)
    assert run.info["source"] == "simulated"
    assert run.info["rig"] == "steel-lap-joint"
    assert set(run.attachments) == {"rig.toml", "procedure.toml"}
    assert {name: channel.device for name, channel in run.channels.items()} == {
        "force": "daq", "acc1": "daq", "acc2": "can",
    }  # fmt: skip
    assert not any(device.gaps for device in run.devices.values())
    samples = run.devices["daq"].values["force"][-512:]
    spectrum = np.abs(np.fft.rfft(samples * np.hanning(512)))
    assert np.argmax(spectrum) * 2.0 == pytest.approx(41.0, abs=2.0)
    assert samples.max() == pytest.approx(1.5, rel=0.05)


@pytest.mark.parametrize("kind", ["serial", "tcp"])
def test_a_replayed_run_comes_back_bit_for_bit(acquired, kind, tmp_path):
    address = str(tmp_path / "line") if kind == "serial" else "127.0.0.1:0"
    file, again = str(tmp_path / "instruments.toml"), tmp_path / "again.mcap"
    arguments = [f"--{kind}", address, "--speed", "fast", "--instruments-out", file]
    with running("replay", str(acquired), *arguments) as (server, _):
        done = twin("acquire", "--instruments", file, "--out", str(again), "--json")
        assert done.returncode == 0, done.stderr
        server.send_signal(signal.SIGTERM)
        assert server.wait(60) == 0
    assert not (tmp_path / "line").is_symlink()
    before, after = read_run(acquired), read_run(again)
    assert after.info["source"] == "replayed"
    for name, channel in before.channels.items():
        old = before.devices[channel.device].values[name]
        new = after.devices["daq"].values[name]
        assert np.array_equal(old.view(np.uint32), new.view(np.uint32))


@pytest.mark.slow
def test_a_meter_tells_preload_and_temperature_in_the_recording(tmp_path):
    file, out = str(tmp_path / "instruments.toml"), tmp_path / "run.mcap"
    arguments = ["--tcp", "127.0.0.1:0", "--meter", "127.0.0.1:0", "--speed", "10", "--instruments-out", file]
    with running("serve", "--rig", "steel-lap-joint", "--preload", "540N", *arguments) as (_, addresses):
        assert [address["device"] for address in addresses] == ["daq", "meter"]
        done = twin("acquire", "--seconds", "20", "--instruments", file, "--out", str(out))
    assert done.returncode == 0, done.stderr
    run = read_run(out)
    assert float(run.info["preload_N"]) == pytest.approx(540.0, abs=0.2)
    assert set(run.channels) == {"force", "acc1", "acc2"}
    for name, unit, value in (("preload", "N", 540.0), ("temperature", "degC", 21.0)):
        found = [each for each in run.indicators if each.name == name]
        assert len(found) >= 3
        assert {each.unit for each in found} == {unit}
        assert all(each.value == pytest.approx(value, abs=0.2) for each in found)


def test_what_makes_the_moduli_fall_shows_on_the_meter():
    rig = load_rig("steel-lap-joint")
    moduli = {float(name[:-1]): state.normal_modulus for name, state in rig.joint.preload.items()}
    (low, high), rate = sorted(moduli), 1e-3
    fading = rig.model_copy(update={"effect": [Effect(cause="preload-loss", parameters={"rate_per_s": rate})]})
    # When the modulus has fallen to that of the lower preload, so has the preload.
    until_s = (1 - moduli[low] / moduli[high]) / rate
    assert JointMeter(fading, f"{high:g}N").read(until_s)[0] == pytest.approx(low)
    assert JointMeter(rig, f"{high:g}N").read(until_s) == pytest.approx([high, 21.0])
    warm = rig.model_copy(update={"effect": [Effect(cause="temperature-drift", parameters={"rate_per_s": 3e-6})]})
    assert JointMeter(warm, f"{low:g}N").read(100.0) == pytest.approx([low, 22.0])


def test_the_preload_that_shows_is_that_of_the_joint_that_loses_it():
    rig = load_rig("two-lap-joints")

    def states(joint, lower):
        high = joint.preload["120N"]
        return joint.model_copy(
            update={"preload": {"120N": high, "60N": high.model_copy(update={"normal_modulus": lower})}}
        )

    rig = rig.with_joints([states(joint, lower) for joint, lower in zip(rig.joints, (1e8, 3e8), strict=True)])
    losing = rig.joints[1]
    falls = Effect(cause="preload-loss", parameters={"rate_per_s": 1e-4, "joint": losing.name})
    fading = rig.model_copy(update={"effect": [falls]})
    until_s = (1 - 3e8 / losing.preload["120N"].normal_modulus) / 1e-4
    assert JointMeter(fading, "120N").read(until_s)[0] == pytest.approx(60.0)


def test_the_manual_of_the_instruments_is_what_the_code_says(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["serve", "--commands"])
    assert ended.value.code == 0
    printed = capsys.readouterr().out
    assert "| `ACQuire:STARt` |" in printed
    page = Path(__file__).parents[3] / "docs" / "instruments.md"
    assert page.read_text() == printed, "write it anew: twin serve --commands > docs/instruments.md"


def test_what_went_wrong_is_in_the_file_and_told(tmp_path):
    file, out = str(tmp_path / "instruments.toml"), tmp_path / "run.mcap"
    arguments = ["--tcp", "127.0.0.1:0", "--speed", "fast", "--fault", "drop:probability=0.15"]
    with running("serve", "--rig", "steel-lap-joint", *arguments, "--instruments-out", file):
        done = twin("acquire", "--seconds", "3", "--instruments", file, "--out", str(out), "--json")
    assert done.returncode == 0, done.stderr
    assert "lost-samples (daq)" in done.stderr
    result = json.loads(done.stdout)
    assert result["lost_samples"]["daq"] > 0
    run = read_run(out)
    assert {"lost-samples", "lost-frames"} <= {event.kind for event in run.events}
    assert sum(gap.count for gap in run.devices["daq"].gaps) == result["lost_samples"]["daq"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["serve", "--rig", "no-such-rig"], "no-such-rig"),
        (["serve", "--rig", "steel-lap-joint", "--preload", "9N"], "has no preload '9N'"),
        (["serve", "--rig", "steel-lap-joint", "--tcp", "5025"], "not HOST:PORT"),
        (["serve", "--rig", "steel-lap-joint", "--tcp", "203.0.113.1:1"], "cannot listen there"),
        (["serve", "--rig", "steel-lap-joint", "--can", "nonsense:0"], "no CAN interface 'nonsense'"),
        (["serve", "--rig", "steel-lap-joint", "--speed", "warp"], "--speed"),
        (["serve", "--rig", "steel-lap-joint", "--fault", "gremlins"], "no such kind of fault"),
        (["serve", "--rig", "steel-lap-joint", "--fault", "drop:probability=2"], "probability"),
        (["serve", "--rig", "steel-lap-joint", "--fault", "stuck:channel=acc9"], "no channel 'acc9'"),
        (["serve", "--rig", "steel-lap-joint", "--fault", "noise:device=daq"], "only a CAN bus"),
        (["serve", "--rig", "steel-lap-joint", "--bitrate", "5"], "--bitrate"),
        (["serve", "--rig", "steel-lap-joint", "--can", "virtual:x", "--can-channels", "a/b/c"], "not NAME,..."),
        (["serve", "--rig", "steel-lap-joint", "--can", "virtual:x", "--can-frames", "xl"], "--can-frames"),
        (["serve", "--rig", "steel-lap-joint", "--can", "slcan:."], "no serial port"),
        (["serve", "--rig", "steel-lap-joint", "--meter", "."], "no serial port"),
        (["serve", "--rig", "steel-lap-joint", "--serial", "."], "no serial port"),
        (["serve", "--rig", "steel-lap-joint", "--serial", "/dev/ttyNONE7"], "no such device"),
        (["replay", "none.mcap"], "none.mcap"),
        (["acquire", "--instruments", "none.toml", "--out", "run.mcap"], "none.toml"),
        (["acquire", "none.toml", "--instruments", "none.toml", "--out", "run.mcap"], "none.toml"),
    ],
)
def test_a_mistake_is_one_line_and_status_2(arguments, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    out, err = capsys.readouterr()
    assert ended.value.code == 2, err
    assert words in err
    assert err.count("\n") == 1
    assert out == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_drive_that_is_connected_is_the_one_that_is_recorded(tmp_path):
    """Two shakers, each with a force cell: the one that was asked for moves the arm, and the other is taken off."""
    table = tomllib.loads((files("twin.rigs") / "l-frame.toml").read_text())
    own, cell = table["drive"], next(sensor for sensor in table["sensor"] if sensor["channel"] == "force")
    there = {"part": "arm", "at": 0.2, "direction": "+y"}
    table["drive"] = [{**own, "name": "column"}, {**own, **there, "name": "arm"}]
    table["sensor"].append({**cell, **there, "channel": "force-arm"})
    rig, sweep, run, file = (tmp_path / name for name in ("rig.toml", "sweep.toml", "run.mcap", "instruments.toml"))
    rig.write_text(tomli_w.dumps(table))
    sweep.write_text('drive = "arm"\n' + TWO_STEPS.replace('"force"', '"force-arm"', 1))
    line = ["--tcp", "127.0.0.1:0", "--speed", "fast", "--instruments-out", str(file)]
    with running("serve", "--rig", str(rig), "--drive", "arm", *line):
        done = twin("acquire", str(sweep), "--instruments", str(file), "--rig", str(rig), "--out", str(run))
        assert done.returncode == 0, done.stderr
    recorded = read_run(run)
    assert recorded.info["drive"] == "arm"
    assert "force" not in recorded.channels
    assert recorded.devices["daq"].values["force-arm"][-512:].max() == pytest.approx(1.5, rel=0.05)
    asked = twin("serve", "--rig", str(rig), "--drive", "leg", *line)
    assert asked.returncode == 2
    assert "leg" in asked.stderr
