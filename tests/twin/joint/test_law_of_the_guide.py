"""The law of ``docs/a-new-joint-law.md``, rehearsed and recorded as the page has it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from guide_script import read_blocks
from harmonic_balance_numpy import BALANCES

from twin.bench import BenchSetup, open_bench
from twin.cli import main
from twin.joint import describing_function, law_named, load_laws
from twin.lab import load_run
from twin.rigs import load_rig, save_rig

PAGE = (Path(__file__).parents[3] / "docs" / "a-new-joint-law.md").read_text(encoding="utf-8")
FILES = {block.file: block.content for block in read_blocks(PAGE) if block.file}
LAW = '\n[joint.law.opening]\nname = "dahl"\nstiffness = 1.5e8\nslips_at = 3.0e-6\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dahl")
    for name, content in FILES.items():
        (folder / name).write_text(content)
    steel = load_rig("steel-lap-joint")
    linear = steel.with_joints([joint.model_copy(update={"law": None}) for joint in steel.joints])
    save_rig(linear, folder / "bolted.toml")
    assert LAW.strip() in PAGE
    with (folder / "bolted.toml").open("a") as stream:
        stream.write(LAW)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("twin.joint.registry._loaded", {})
        load_laws(folder / "dahl.py")
        yield folder


@pytest.fixture(scope="module")
def recorded(folder):
    words = [str(folder / "sweep.toml"), "--rig", str(folder / "bolted.toml"), "--laws", str(folder / "dahl.py")]
    with pytest.raises(SystemExit) as ended:
        main(["rehearse", *words, "--rounds", "0", "--out", str(folder / "sweeps"), "--quiet"])
    assert ended.value.code == 0
    return folder / "sweeps"


def foretold(built, frequency_Hz, force_N):
    """Fundamental of acc2 over the force, from the law's describing function alone: one harmonic, no march."""
    G = built.rig(0.0, 51200.0).transfer(np.array([frequency_Hz]))[0]
    elements, coordinate, n = built.elements_, built.coordinate, built.locals
    y = G[:n, 0] * force_N
    for _ in range(400):
        secant = np.zeros(n, complex)
        for element, a in zip(elements, coordinate, strict=True):
            secant[a] += element.scale * element.law.describing_function(np.array(max(abs(y[a]), 1e-15)))
        new = np.linalg.solve(np.eye(n) - G[:n, 1:] * secant, G[:n, 0] * force_N)
        if np.max(np.abs(new - y)) < 1e-9 * np.max(np.abs(new)):
            break
        y = 0.5 * (y + new)
    out = n + built.auxiliaries + list(built.plan.instruments).index("acc2")
    return abs(G[out, 0] * force_N + G[out, 1:] @ (secant * y)) / force_N


def test_its_describing_function_is_that_of_its_path(folder):
    law = law_named("dahl").force({"stiffness": 1.5e8, "slips_at": 3e-6})
    amplitude = np.array([2e-6, 5e-6, 2e-5])
    found = describing_function(law.force_history, amplitude, cycles=6)
    np.testing.assert_allclose(law.describing_function(amplitude), found, atol=1e-6 * 1.5e8)


@pytest.mark.slow
def test_the_recorded_fundamental_is_the_describing_functions(folder, recorded):
    built = open_bench(
        load_rig(folder / "bolted.toml"), setup=BenchSetup(drive="force", noise=False, converter=False)
    ).built
    sweeps = {sweep.name: sweep for sweep in load_run(recorded / "run.mcap").sweeps}
    at_resonance = []
    # The describing function is of one harmonic; at 6 N the others move the fundamental by half a per cent at the peak.
    for force_N, within in ((0.5, 3e-3), (2.0, 3e-3), (6.0, 8e-3)):
        sweep = sweeps[f"{force_N:g}N-up"]
        f = np.array(sweep.frequency_Hz)
        accelerance = np.array(sweep.receptance["acc2"]) * 1e-3 * (2 * np.pi * f) ** 2
        for step in range(0, len(f), 4):
            assert accelerance[step] == pytest.approx(foretold(built, f[step], force_N), rel=within)
        at_resonance.append(accelerance.max())
    assert at_resonance[2] < 0.9 * at_resonance[0]  # or the law was not there


@pytest.mark.slow
def test_the_predicted_branches_have_it(folder, recorded):
    rig = load_rig(folder / "bolted.toml")
    told = json.loads((recorded / "result.json").read_text())
    assert not any(branch["ends_early"] for branch in told["branches"])
    bench = open_bench(rig, setup=BenchSetup(drive="force", noise=False, converter=False))
    at = [channel.name for channel in bench.channels].index("acc2")
    compiled, plain = (
        BALANCES[which](bench.built, harmonics=3, samples=64).solve(26.4, 2.0) for which in ("compiled", "plain")
    )
    assert abs(compiled.channels[at][1]) / 2.0 == pytest.approx(foretold(bench.built, 26.4, 2.0), rel=5e-3)
    np.testing.assert_allclose(compiled.channels, plain.channels, rtol=1e-5, atol=1e-6)
