"""What a look at the samples found spoilt is missing from then on, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.signals import Finding, inspect_signals, mended
from twin.identify.spectra.sine_fit import steady_states


def test_spoilt_samples_become_missing_in_their_channel_only(synthetic):
    run = synthetic.run(synthetic.converted(synthetic.stepped_sine(81)), path="a.mcap")
    spoilt = np.array([3, 4, 500])
    finding = Finding(cause="clipping", summary="", names={"channel": "acc1"}, spoilt={"a.mcap": spoilt})
    cleaned = mended(run, [finding])
    before, after = run.devices["daq"].values, cleaned.devices["daq"].values
    assert np.flatnonzero(np.isnan(after["acc1"])).tolist() == spoilt.tolist()
    sound = np.setdiff1d(np.arange(len(before["acc1"])), spoilt)
    assert np.array_equal(after["acc1"][sound], before["acc1"][sound])
    assert np.array_equal(after["acc2"], before["acc2"])
    # The recording itself is as it was.
    assert np.isfinite(before["acc1"]).all()


def test_findings_of_one_channel_add_up(synthetic):
    run = synthetic.run(synthetic.converted(synthetic.stepped_sine(82)), path="a.mcap")
    findings = [
        Finding(cause=cause, summary="", names={"channel": "acc2"}, spoilt={"a.mcap": np.array(positions)})
        for cause, positions in (("clipping", [10, 11]), ("lost-samples", [11, 12]))
    ]
    assert np.flatnonzero(np.isnan(mended(run, findings).devices["daq"].values["acc2"])).tolist() == [
        10,
        11,
        12,
    ]


def test_findings_of_other_runs_spoil_nothing(synthetic):
    run = synthetic.run(synthetic.converted(synthetic.stepped_sine(83)), path="a.mcap")
    finding = Finding(cause="clipping", summary="", names={"channel": "acc1"}, spoilt={"b.mcap": np.array([3])})
    assert np.isfinite(mended(run, [finding]).devices["daq"].values["acc1"]).all()


def test_what_clipped_peaks_hide_is_known_as_badly_as_the_variances_say(synthetic):
    """A gap in every period is where the highest harmonics fit anything: noise grows there, and tells of it."""
    noise, cycles = 0.01, np.arange(len(synthetic.frequencies_Hz))
    length = round(synthetic.rate_Hz)
    t = np.arange(length) / synthetic.rate_Hz
    clean = np.concatenate(
        [10.0 * np.cos(2 * np.pi * (f * t + 0.1 * k)) for k, f in enumerate(synthetic.frequencies_Hz)]
    )
    samples = clean + noise * np.random.default_rng(85).standard_normal(length * len(cycles))
    torn = np.where(np.abs(clean) > 9.7, np.nan, samples)
    run = synthetic.run({"force": samples, "acc1": torn})
    whole, cut = (
        [
            (state.amplitude[name][0], state.variance[name][0])
            for state in steady_states(run, channels=["force", "acc1"])
        ]
        for name in ("force", "acc1")
    )
    true = 10.0 * np.exp(0.2j * np.pi * cycles)
    for found, grown in ((whole, 1.0), (cut, 3.0)):
        amplitude, variance = np.array(found).T
        assert np.sqrt(np.mean(np.abs(amplitude - true) ** 2 / variance.real)) == pytest.approx(1.0, abs=0.35)
        assert np.sqrt(np.mean(variance.real)) >= 0.9 * grown * 2 * noise / np.sqrt(length)


def test_a_run_with_two_faults_has_both_found(synthetic):
    samples = synthetic.converted(synthetic.stepped_sine(84))
    samples["acc2"] = np.clip(samples["acc2"], -9.0, 9.0)
    samples["acc1"][3000:3100] = samples["acc1"][2999]
    found = {(f.cause, f.names["channel"]) for f in inspect_signals([synthetic.run(samples)])}
    assert {("clipping", "acc2"), ("lost-samples", "acc1")} <= found


def test_recordings_of_a_sound_rig_are_no_alarm(campaign):
    """At the bench's own rate, a thousand samples a period, and through its converter."""
    runs = [read_run(campaign / f"{name}.mcap") for name in ("random", "sweeps", "heldout")]
    assert inspect_signals(runs) == []
