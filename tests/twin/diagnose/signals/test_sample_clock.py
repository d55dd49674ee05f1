"""A converter's clock that is off shows in the sines themselves, and is set right before any fit."""

from __future__ import annotations

import numpy as np
import pytest

from twin.causes.sample_clock.finding import find_sample_clock
from twin.diagnose.signals.clock import with_clock
from twin.identify.spectra.sine_fit import steady_states


def sampled(synthetic, seed, error_ppm):
    """The same sweep by a converter that is fast by `error_ppm` and does not know it."""
    samples = synthetic.stepped_sine(seed)
    length = len(samples["acc1"]) // len(synthetic.frequencies_Hz)
    t = np.arange(length) / synthetic.rate_Hz
    turned = {}
    for name, values in samples.items():
        out = np.empty(len(values))
        for k, frequency in enumerate(synthetic.frequencies_Hz):
            own = slice(k * length, (k + 1) * length)
            phase = 2 * np.pi * frequency * t
            carrier = 2 / length * np.sum(values[own] * np.exp(-1j * phase))
            late = phase / (1 + error_ppm * 1e-6)
            out[own] = values[own] - (carrier * np.exp(1j * phase)).real + (carrier * np.exp(1j * late)).real
        turned[name] = out
    return synthetic.run(synthetic.converted(turned))


@pytest.mark.parametrize("error_ppm", [-1500.0, 120.0, 1900.0])
def test_a_clock_error_is_measured_and_mended(synthetic, error_ppm):
    run = sampled(synthetic, 81, error_ppm)
    (finding,) = find_sample_clock([run])
    assert finding.cause == "sample-clock"
    assert abs(finding.values["error_ppm"] - error_ppm) < max(4 * finding.std["error_ppm"], 2.0)
    mended = with_clock(run, error_ppm=finding.values["error_ppm"])
    before, after = (abs(np.median([s.drift["acc1"].imag for s in steady_states(r)])) for r in (run, mended))
    assert after < 0.05 * before
    assert find_sample_clock([mended]) == []


def test_good_clocks_are_no_alarm(clean_runs, synthetic):
    for runs in clean_runs:
        assert find_sample_clock(runs) == []
    assert find_sample_clock([sampled(synthetic, 82, 20.0)]) == []
