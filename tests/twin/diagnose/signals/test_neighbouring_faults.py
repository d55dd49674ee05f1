"""One fault is not taken for another, and a sound channel for neither."""

import numpy as np
import pytest

from recordings import RunWriter, read_run
from twin.bench import open_bench
from twin.causes.clipping.finding import find_clipping
from twin.causes.lost_samples.finding import find_lost_samples
from twin.procedures import DirectAcquisition, SteppedSine, run_procedure
from twin.procedures.tables import Measure
from twin.rigs import Effect, load_rig


def test_an_amplifier_that_limits_before_the_converters_noise_is_seen(synthetic):
    """As the bench does it: limit, then noise; no two samples of a flat top are equal."""
    samples = synthetic.stepped_sine(25, noise=0.0)
    samples["acc2"] = np.clip(samples["acc2"], -9.0, 9.0)
    rng = np.random.default_rng(25)
    noisy = {n: x + synthetic.noise[n] * rng.standard_normal(len(x)) for n, x in samples.items()}
    (finding,) = find_clipping([synthetic.run(synthetic.converted(noisy))])
    assert finding.names == {"channel": "acc2"}
    assert finding.values["limit"] == pytest.approx(9.0, rel=0.02)


def test_the_benchs_clipping_is_seen(tmp_path):
    rig = load_rig("steel-lap-joint")
    procedure = SteppedSine(frequencies=[25.9, 26.2, 26.4, 26.6, 26.9], amplitudes=[6.0], measure=Measure(seconds=1.0))
    effect = Effect(cause="clipping", parameters={"channel": "acc2", "limit": 30.0})
    acquisition = DirectAcquisition(open_bench(rig, seed=3, effects=[effect]))
    info = {"source": "simulated", "rig": rig.name, "preload_N": "120", "stored": procedure.store}
    with RunWriter(tmp_path / "r.mcap", info=info, channels=list(acquisition.channels)) as writer:
        run_procedure(procedure, acquisition, writer)
    (finding,) = find_clipping([read_run(tmp_path / "r.mcap")])
    assert finding.names == {"channel": "acc2"}


def test_a_channel_that_limits_has_not_lost_samples_as_well(synthetic):
    samples = synthetic.converted(synthetic.stepped_sine(84))
    samples["acc2"] = np.clip(samples["acc2"], -9.0, 9.0)
    assert find_lost_samples([synthetic.run(samples)]) == []


@pytest.mark.parametrize("step", [0.05, 0.1, 0.3])
def test_a_coarse_channel_neither_limits_nor_loses_samples(synthetic, step):
    samples = synthetic.converted(synthetic.stepped_sine(61))
    samples["acc2"] = step * np.round(samples["acc2"] / step)
    assert find_clipping([synthetic.run(samples)]) == []
    assert find_lost_samples([synthetic.run(samples)]) == []


def test_converters_of_16_bits_lose_nothing(synthetic):
    """A sound recording; neighbours are often equal where two levels are as far apart as the noise is wide."""
    for seed in range(12):
        samples = synthetic.stepped_sine(seed, noise=0.4)
        assert find_lost_samples([synthetic.run(synthetic.converted(samples, 16))]) == []
        assert find_clipping([synthetic.run(synthetic.converted(samples, 16))]) == []


def test_a_clean_slow_sine_is_whole(synthetic):
    """A thousand samples a period and no noise, as in a simulation: its tops are flat to 1e-5."""
    frequencies = np.linspace(2.0, 3.0, 16)
    samples = synthetic.stepped_sine(1, noise=0.0, frequencies_Hz=frequencies)
    run = synthetic.run(synthetic.converted(samples), frequencies)
    assert find_clipping([run]) == []
    assert find_lost_samples([run]) == []
