"""Long channels are looked at in pieces: whatever their length, the findings are those of the whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import recordings.run
import twin.causes.clipping.finding
import twin.causes.lost_samples.finding
import twin.checks.same_run
import twin.checks.samples
from recordings import RunWriter, SampleBlock, read_run
from recordings.level import Level
from recordings.limits import Limits
from recordings.run import pieces
from twin.checks.samples import _Sizes, look_at_samples
from twin.diagnose.signals import inspect_signals, mended
from twin.identify.limits import LIMITS
from twin.identify.spectra.sine_fit import steady_states


def spoilt(samples):
    """Cut peaks, wild samples also beside missing ones, a value that is held, and zeros."""
    rng = np.random.default_rng(5)
    acc1, acc2 = samples["acc1"].copy(), np.clip(samples["acc2"], -9.0, 9.0)
    for at in (1000, 6000, 9000, 15000, 21001):
        acc1[at : at + 60] = acc1[at]
    acc1[[2047, 2048, 7000]] = [5e3, -7e3, 9e3]
    acc1[2049:2060] = np.nan
    return samples | {"acc1": acc1, "acc2": acc2, "dead": np.where(rng.random(len(acc1)) < 0.5, 0.0, acc1)}


@pytest.fixture(params=[False, True], ids=["array", "file"])
def run(request, synthetic, tmp_path):
    limits = synthetic.ranges | {"dead": 490.0}
    whole = synthetic.run(spoilt(synthetic.converted(synthetic.stepped_sine(21))), path="run.mcap", limits=limits)
    if not request.param:
        return whole
    values = whole.devices["daq"].values
    with RunWriter(tmp_path / "run.mcap", info=whole.info, channels=list(whole.channels.values())) as writer:
        for at in range(0, len(values["force"]), 300):
            block = {name: x[at : at + 300] for name, x in values.items()}
            time_ns = round(at * 1e9 / synthetic.rate_Hz)
            writer.write_block(
                SampleBlock(
                    device="daq", time_ns=time_ns, first_index=at, sample_rate_Hz=synthetic.rate_Hz, samples=block
                )
            )
        for step in whole.steps:
            writer.write_step(step)
    return read_run(tmp_path / "run.mcap", limits=Limits(held_samples=1000))


@pytest.fixture(params=[997, 2048])
def in_pieces(request, monkeypatch):
    """Sets pieces of so many samples."""
    places = [
        recordings.run,
        twin.checks.same_run,
        twin.checks.samples,
        twin.causes.clipping.finding,
        twin.causes.lost_samples.finding,
    ]

    def cut():
        for place in places:
            monkeypatch.setattr(place, "PIECE", request.param)

    return cut


def test_first_look_and_findings_are_those_of_the_whole(run, in_pieces):
    whole, told = look_at_samples(run, force="force")
    found = inspect_signals([run])
    in_pieces()
    parts, told_of_parts = look_at_samples(run, force="force")
    assert {finding.kind for finding in told} >= {"wild", "empty"}
    assert told_of_parts == told
    for one, other in zip(whole.devices["daq"].values.values(), parts.devices["daq"].values.values(), strict=True):
        assert np.array_equal(np.asarray(one), np.asarray(other), equal_nan=True)
    again = inspect_signals([run])
    assert [(f.cause, f.summary, f.values) for f in again] == [(f.cause, f.summary, f.values) for f in found]
    assert {f.cause for f in found} >= {"clipping", "lost-samples"}
    for one, other in zip(found, again, strict=True):
        assert {k: v.tolist() for k, v in one.spoilt.items()} == {k: v.tolist() for k, v in other.spoilt.items()}


def test_steps_reduced_from_the_file_are_those_of_arrays(run):
    device = run.devices["daq"]
    held = replace(device, values={name: np.asarray(x) for name, x in device.values.items()})
    findings = inspect_signals([run])
    one = steady_states(mended(run, findings))
    other = steady_states(mended(replace(run, devices={"daq": held}), findings))
    assert len(one) == len(other) > 0
    for a, b in zip(one, other, strict=True):
        for name in a.amplitude:
            assert a.amplitude[name].tolist() == b.amplitude[name].tolist()
            assert a.variance[name].tolist() == b.variance[name].tolist()


def test_a_step_fitted_in_parts_is_fitted_as_a_whole(synthetic, monkeypatch):
    run = synthetic.run(synthetic.converted(synthetic.stepped_sine(3)))
    whole = steady_states(run)
    monkeypatch.setitem(LIMITS.__dict__, "sine_fit_rows", 500)
    for a, b in zip(whole, steady_states(run), strict=True):
        for name in a.amplitude:
            largest = abs(a.amplitude[name][0])
            assert np.max(np.abs(a.amplitude[name] - b.amplitude[name])) < 1e-12 * largest
            assert b.variance[name] == pytest.approx(a.variance[name], rel=1e-6)


def test_the_usual_size_is_a_quantile(in_pieces):
    in_pieces()
    for count in (2, 3, 999, 1001, 30_000):
        x = np.random.default_rng(count).standard_normal(count).astype(np.float32)
        x[:: 50 if count > 50 else count + 1] = np.nan
        seen = _Sizes(count)
        for piece in pieces(x):
            seen.take(piece)
        sizes = np.abs(x[np.isfinite(x)].astype(float))
        assert seen.usual == np.quantile(sizes, 1 - 1e-3)
        assert seen.largest == sizes.max()


def test_level_is_that_of_all_parts(in_pieces):
    in_pieces()
    x = 1e3 + np.random.default_rng(0).standard_normal(10_000).astype(np.float32)
    x[::7] = np.nan
    level = Level.of(x[:3000], x[3000:])
    sound = x[np.isfinite(x)].astype(float)
    assert level.count == len(sound)
    assert level.std == pytest.approx(sound.std(), rel=1e-12)
    assert level.largest == np.abs(sound).max()
