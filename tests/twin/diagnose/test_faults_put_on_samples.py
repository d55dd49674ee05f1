"""Faults that a test puts on one channel's recorded samples, by other means than the bench's instruments, are named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal
from short_campaign import record_campaign

from recordings import read_run
from twin.diagnose import diagnose
from twin.rigs import load_rig

CHANNEL, OTHER = "acc1", "acc2"


def filtered(x, rate_Hz, response):
    """`x` through a frequency response, a second of nothing before and behind it."""
    padded = np.pad(x, round(rate_Hz))
    frequency = np.fft.rfftfreq(len(padded), 1 / rate_Hz)
    return np.fft.irfft(np.fft.rfft(padded) * response(frequency), len(padded))[round(rate_Hz) : -round(rate_Hz)]


def with_gaps(x, rate_Hz):
    """A stretch of up to 60 ms every three seconds holds its first value."""
    x, rng = x.copy(), np.random.default_rng(5)
    for start in rng.integers(10, len(x) - 400, round(len(x) / rate_Hz / 3)):
        x[start : start + rng.integers(20, round(0.06 * rate_Hz))] = x[start - 1]
    return x


def high_passed(x, rate_Hz):
    b, a = signal.bilinear([1, 0], [1, 2 * np.pi * 0.9], rate_Hz)
    return signal.lfilter(b, a, x)


FAULTS = {
    "channel-gain": (lambda x, rate, run: 1.05 * x, {"factor": 1.05}),
    "channel-polarity": (lambda x, rate, run: -x, {}),
    "channel-delay": (
        lambda x, rate, run: filtered(x, rate, lambda f: np.exp(-2j * np.pi * f * 6e-5)),
        {"delay_s": 6e-5},
    ),
    "ac-coupling": (lambda x, rate, run: high_passed(x, rate), {"corner_Hz": 0.9}),
    "mounting-resonance": (
        lambda x, rate, run: filtered(x, rate, lambda f: 1 / (1 - (f / 2200) ** 2 + 2j * 0.03 * f / 2200)),
        {"frequency_Hz": 2200.0, "damping_ratio": 0.03},
    ),
    "cross-talk": (lambda x, rate, run: x + 0.02 * np.nan_to_num(run.device_of(OTHER).values[OTHER]), {"factor": 0.02}),
    "clipping": (lambda x, rate, run: np.clip(x, -12.0, 12.0), {"limit": 12.0}),
    "lost-samples": (lambda x, rate, run: with_gaps(x, rate), {}),
    "mains-hum": (
        lambda x, rate, run: x + 0.3 * np.sin(2 * np.pi * 60.0 / rate * np.arange(len(x))),
        {"amplitude": 0.3},
    ),
    "quantisation": (lambda x, rate, run: 0.1 * np.round(x / 0.1), {"step": 0.1}),
}
QUICK = {"clipping"}


@pytest.fixture
def recordings(request, campaign, true_rig, tmp_path):
    """A campaign; where the fault remembers what was before a step, one with the waits between steps."""
    return record_campaign(tmp_path, true_rig, store="all") if request.param == "ac-coupling" else campaign


def spoilt(run, name):
    """The run with the fault on one channel."""
    device = run.device_of(CHANNEL)
    x = FAULTS[name][0](device.values[CHANNEL].astype(float), device.sample_rate_Hz, run)
    changed = replace(device, values={**device.values, CHANNEL: x.astype(np.float32)})
    return replace(run, devices={**run.devices, device.device: changed})


@pytest.mark.parametrize(
    ("name", "recordings"),
    [pytest.param(name, name, marks=() if name in QUICK else pytest.mark.slow) for name in FAULTS],
    indirect=["recordings"],
)
def test_a_fault_put_on_recorded_samples_is_named_alone(recordings, name):
    runs = [spoilt(read_run(recordings / f"{run}.mcap"), name) for run in ("random", "sweeps", "heldout")]
    found = diagnose(runs[:2], load_rig("steel-lap-joint"), held_out=runs[2:])
    assert found.verdict == "explained"
    (cause,) = [cause for cause in found.causes if cause.in_model]
    assert cause.cause == name
    assert cause.parameters["channel"] == CHANNEL
    for parameter, true in FAULTS[name][1].items():
        assert cause.parameters[parameter].value == pytest.approx(true, rel=0.05)
    assert found.misfit.after < found.misfit.threshold
