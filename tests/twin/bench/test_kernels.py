"""The compiled integration against its plain numpy twin, and streaming against the way it is cut into blocks."""

from __future__ import annotations

import numpy as np
import pytest
from march_numpy import march_numpy

from recordings.streams import Excitation
from twin.bench import BenchSetup, open_bench
from twin.rigs import Effect, load_rig

RIG = load_rig("steel-lap-joint")
DRIVE = Excitation(kind="random", amplitude_V=2.0, seed=3)
EFFECTS = {
    "none": [],
    "three coordinates": [
        Effect(cause="joint-friction", parameters={"stiffness_N_per_m": 1e8, "slip_force_N": 5.0}),
        Effect(cause="cubic-stiffness", parameters={"position_m": 0.42, "stiffness_N_per_m3": 1e8}),
        Effect(cause="joint-slap", parameters={"gap_m": 1e-7, "stiffness_factor": 0.5}),
    ],
    "velocities": [Effect(cause="air-drag", parameters={"coefficient_Ns2_per_m3": 5.0})],
}


@pytest.mark.parametrize("name", EFFECTS)
def test_plain_twin_gives_the_same_samples(name, monkeypatch):
    compiled, plain = (open_bench(RIG, effects=EFFECTS[name], setup=BenchSetup(noise=False)) for _ in range(2))
    for bench in (compiled, plain):
        bench.set_output(DRIVE)
    a = compiled.read(150).samples
    monkeypatch.setattr("twin.bench.bench.integrate", march_numpy)
    b = plain.read(150).samples
    for channel in a:
        scale = np.abs(a[channel]).max()
        assert scale > 0
        np.testing.assert_allclose(a[channel], b[channel], rtol=0, atol=1e-6 * scale)


def test_blocks_may_be_cut_anywhere():
    whole, parts = (open_bench(RIG, seed=5) for _ in range(2))
    for bench in (whole, parts):
        bench.set_output(Excitation(kind="sine", amplitude_V=0.5, frequency_Hz=26.3))
    one = whole.read(3000).samples
    pieces = [parts.read(count).samples for count in (1, 999, 2000)]
    for channel, values in one.items():
        joined = np.concatenate([piece[channel] for piece in pieces])
        np.testing.assert_allclose(joined, values, rtol=0, atol=1e-5 * np.abs(values).max())


def test_a_seed_makes_the_same_samples_and_another_seed_does_not():
    a, b, c = (open_bench(RIG, seed=seed).read(100).samples["acc2"] for seed in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert np.any(a != c)
