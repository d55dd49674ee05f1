"""The compiled harmonic balance against its plain twin, with ten sliders, a gap and a cubic spring, and its slopes."""

from __future__ import annotations

import numpy as np
import pytest
from harmonic_balance_numpy import BALANCES
from harmonic_balance_numpy import residual as plain_residual

from twin.bench import BenchSetup, JointLaw, open_bench
from twin.joint import iwan
from twin.response import kernel
from twin.response.system import SineDrive
from twin.rigs import Effect, load_rig

RIG = load_rig("steel-lap-joint")
EFFECTS = [
    Effect(cause="ground-stop", parameters={"position_m": 0.4, "gap_m": 8e-4, "stiffness_N_per_m": 60.0}),
    Effect(cause="cubic-stiffness", parameters={"position_m": 0.42, "stiffness_N_per_m3": 8e6}),
]
SHAKER = {"voltage_limit": 2.5, "half_force_stroke": 1e-4, "amplifier": "current", "current_limit": 1.2}


def sliders(which="compiled"):
    bench = open_bench(RIG, joint_law=JointLaw(iwan(1e8, 80.0)), effects=EFFECTS, setup=BenchSetup(drive="force"))
    return BALANCES[which](bench.built, harmonics=5, samples=128)


def slapping(which="compiled"):
    """A running loss that meets a static offset."""
    slap = Effect(cause="joint-slap", parameters={"gap_m": 5e-7, "stiffness_factor": 0.5})
    bench = open_bench(RIG, effects=[slap], setup=BenchSetup(drive="force"))
    return BALANCES[which](bench.built, harmonics=5, samples=128)


def shaken(which="compiled"):
    rig = RIG.model_copy(update={"drive": RIG.drive.model_copy(update=SHAKER)})
    return BALANCES[which](open_bench(rig).built, harmonics=5, samples=128)


def test_both_follow_the_same_branch():
    compiled, plain = (sliders(which).branch(25.5, 27.5, 3.0, step=0.2) for which in BALANCES)
    assert len(compiled) == len(plain)
    for a, b in zip(compiled, plain, strict=True):
        assert a.frequency_Hz == pytest.approx(b.frequency_Hz, rel=1e-12)
        assert np.abs(a.channels - b.channels).max() < 1e-10 * np.abs(b.channels).max()


@pytest.mark.parametrize("case", [sliders, slapping, shaken])
def test_residual_and_slopes_agree_and_are_exact(case):
    balance = case()
    system = balance._system
    w, amplitude = 2 * np.pi * 26.4, 2.0
    x = balance.sweep(np.linspace(27.5, 26.6, 8), amplitude)[-1].unknowns * 1.01
    locals_, n = system.D.shape[1] - 1, len(system.basis)
    found = np.empty(len(x)), np.empty((len(x), len(x))), np.empty(len(x)), np.empty((locals_, n))
    drive = SineDrive(w, amplitude)
    kernel.residual(system, x, drive, *found)
    for compiled, plain in zip(found, plain_residual(system, x, drive), strict=True):
        assert np.abs(compiled - plain).max() < 1e-10 * np.abs(plain).max()
    # slopes in proportion to the unknowns' own sizes, which differ by orders from coordinate to coordinate
    size = np.repeat(np.abs(x).reshape(locals_, n).max(axis=1), n)
    scaled = found[1] * size / size[:, None]
    d = 1e-6
    for i in range(len(x)):
        shift = d * size[i] * np.eye(len(x))[i]
        ahead, behind = (plain_residual(system, x + s * shift, drive)[0] for s in (1, -1))
        difference = (ahead - behind) / (2 * d) / size
        # a sample at a kink may fall on either side
        assert np.abs(scaled[:, i] - difference).max() < 0.02 * max(np.abs(scaled[:, i]).max(), 1.0)
        assert np.median(np.abs(scaled[:, i] - difference)) < 1e-6 * max(np.abs(scaled[:, i]).max(), 1.0)
    ahead, behind = (plain_residual(system, x, SineDrive(w * (1 + s * 1e-7), amplitude))[0] for s in (1, -1))
    np.testing.assert_allclose(
        found[2] * w / size, (ahead - behind) / 2e-7 / size, atol=1e-5 * np.abs(found[2] * w / size).max()
    )
