"""A converter coarser than 16 bits is seen by its steps; the usual ones are not."""

from __future__ import annotations

import numpy as np
import pytest

from twin.causes.quantisation.finding import find_quantisation


@pytest.mark.parametrize("step", [0.06, 0.5])
def test_a_coarse_channel_is_named_with_its_step(synthetic, step):
    samples = synthetic.converted(synthetic.stepped_sine(61))
    samples["acc2"] = step * np.round(samples["acc2"] / step)
    (finding,) = find_quantisation([synthetic.run(samples)])
    assert finding.cause == "quantisation"
    assert finding.names == {"channel": "acc2"}
    assert finding.values["step"] == pytest.approx(step, rel=1e-3)
    assert f"{step:g}" in finding.summary


@pytest.mark.parametrize("bits", [12, 10])
def test_a_converter_of_few_bits_is_named_with_its_own_step(synthetic, bits):
    samples = synthetic.stepped_sine(62)
    coarse = synthetic.converted(samples) | {"acc1": synthetic.converted(samples, bits)["acc1"]}
    (finding,) = find_quantisation([synthetic.run(coarse)])
    assert finding.values["step"] == pytest.approx(2 * synthetic.ranges["acc1"] / 2**bits, rel=1e-3)


def test_converters_of_16_and_24_bits_are_no_alarm(synthetic, clean_runs):
    for seed, runs in enumerate(clean_runs):
        assert find_quantisation(runs) == []
        assert find_quantisation([synthetic.run(synthetic.converted(synthetic.stepped_sine(seed), 16))]) == []


def test_a_channel_without_a_known_range_is_left_alone(synthetic):
    samples = synthetic.converted(synthetic.stepped_sine(63))
    samples["acc1"] = 0.5 * np.round(samples["acc1"] / 0.5)
    limits = synthetic.ranges | {"acc1": None}
    assert find_quantisation([synthetic.run(samples, limits=limits)]) == []
