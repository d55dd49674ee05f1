"""One sweep of the steel rig over every line there is: the same samples, the same reduced values, and again by replay.

All of it in one process, as python-can's virtual bus wants it; the command is `twin acquire` itself.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from two_steps import TWO_STEPS

from drivers.virtual import Addresses, Backing, RecordedSource, VirtualRig
from recordings import Run, read_run
from recordings.streams import SampleSource
from twin.bench import open_bench
from twin.cli import main
from twin.identify import SteadyState, steady_states
from twin.rigs import load_rig

LINES = {
    "serial": {"serial": "auto"},
    "tcp": {"tcp": "127.0.0.1:0"},
    "virtual": {"tcp": "127.0.0.1:0", "can": "virtual:same"},
    "udp_multicast": {"tcp": "127.0.0.1:0", "can": "udp_multicast:239.74.163.15"},
    "slcan": {"serial": "auto", "can": "slcan:auto"},
    "unixbus": {"serial": "auto", "can": "unixbus:{folder}/bus"},
    "classic": {"serial": "auto", "can": "unixbus:{folder}/classic", "can_frames": "classic"},
}


@contextmanager
def served(source: SampleSource, line: str, folder: Path) -> Iterator[Path]:
    """The instruments file of a source's virtual instruments."""
    where = {key: text.format(folder=folder) for key, text in LINES[line].items()}
    origin = "replayed" if isinstance(source, RecordedSource) else "simulated"
    rig = VirtualRig(source, Addresses(**where), backing=Backing(origin=origin))
    file = folder / f"{line}.toml"
    file.write_text(rig.instruments_toml)
    stop = threading.Event()
    thread = threading.Thread(target=rig.serve, args=(stop.is_set,))
    thread.start()
    try:
        yield file
    finally:
        stop.set()
        thread.join(60)


def acquire(source: SampleSource, line: str, folder: Path, *arguments: str) -> Run:
    folder.mkdir(exist_ok=True)
    out = folder / f"{line}.mcap"
    with served(source, line, folder) as file, pytest.raises(SystemExit) as ended:
        main(["acquire", *arguments, "--instruments", str(file), "--out", str(out)])
    assert ended.value.code == 0
    return read_run(out)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Run]:
    folder = tmp_path_factory.mktemp("lines")
    (folder / "sweep.toml").write_text(TWO_STEPS)
    rig = load_rig("steel-lap-joint")
    return {line: acquire(open_bench(rig, seed=4), line, folder, str(folder / "sweep.toml")) for line in LINES}


def samples(run: Run, channel: str) -> np.ndarray:
    return run.device_of(channel).values[channel]


def by_step(states: Sequence[SteadyState]) -> dict[tuple[str, int], SteadyState]:
    return {(state.sweep, state.index): state for state in states}


@pytest.mark.parametrize("line", [line for line in LINES if line != "serial"])
def test_the_recording_is_the_same(runs, line):
    """Of a rig as fast as it can: sample by sample over a line, to the last of 16 bits over CAN."""
    run, reference = runs[line], runs["serial"]
    assert not run.events
    assert [(step.sweep, step.index, step.time_ns, step.state) for step in run.steps] == [
        (step.sweep, step.index, step.time_ns, step.state) for step in reference.steps
    ]
    for name in ("force", "acc1", "acc2"):
        got, expected = samples(run, name), samples(reference, name)
        if run.channels[name].device == "daq":
            assert np.array_equal(got.view(np.uint32), expected.view(np.uint32))
        else:
            limit = run.channels[name].range
            assert np.max(np.abs(got - expected)) <= 0.5001 * limit / 32767


@pytest.mark.parametrize("line", [line for line in LINES if line != "serial"])
def test_the_reduced_values_are_the_same_to_noise(runs, line):
    found, expected = by_step(steady_states(runs[line])), by_step(steady_states(runs["serial"]))
    assert found.keys() == expected.keys()
    assert len(found) == 2
    for key, state in found.items():
        for name in ("force", "acc1", "acc2"):
            one, other = (each.amplitude[name][0] for each in (state, expected[key]))
            noise = np.sqrt(state.variance[name][0] + expected[key].variance[name][0])
            assert abs(one - other) < 3 * noise < 0.1 * abs(one)  # acc1 sits where the beam hardly moves


@pytest.mark.parametrize("line", list(LINES))
def test_a_replay_over_the_same_lines_is_bit_for_bit(runs, line, tmp_path):
    run = runs[line]
    again = acquire(RecordedSource(run), line, tmp_path)
    assert again.info["source"] == "replayed"
    for name in ("force", "acc1", "acc2"):
        got, expected = samples(again, name), samples(run, name)
        assert np.array_equal(got.view(np.uint32), expected.view(np.uint32))
