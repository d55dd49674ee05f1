"""A multisine as it is measured: whole periods that repeat, without leakage, and with the response of the rig."""

import numpy as np
import pytest
from resonator import ListSink, Resonator

from recordings.errors import InputError
from recordings.run import StepState
from twin.procedures import DirectAcquisition, Multisine, parse_procedure, run_procedure
from twin.procedures.tables import Settle

PROCEDURE = Multisine(band=(10.0, 100.0), rms=0.5, period=4.0, periods=3, sample_rate=2048.0, store="settled")
PERIOD = 4 * 2048


def measured(rig, procedure=PROCEDURE):
    sink = ListSink()
    result = run_procedure(procedure, DirectAcquisition(rig), sink)
    series = {name: np.concatenate([b.samples[name] for b in sink.blocks]).astype(float) for name in ("force", "acc")}
    return result, sink, series


def test_it_is_measured_for_whole_periods_at_the_wanted_rms():
    result, sink, series = measured(Resonator())
    (step,) = result.steps
    assert step.amplitude == pytest.approx(0.5, rel=0.02)
    assert len(series["force"]) == 3 * PERIOD
    assert np.std(series["force"]) == pytest.approx(step.amplitude, rel=1e-6)
    assert [one.state for one in sink.steps] == [StepState.SETTLING, StepState.MEASURING, StepState.DONE]
    assert all(one.frequency_Hz == 0.0 for one in sink.steps)


def test_its_lines_give_the_receptance_and_nothing_lies_between_them():
    rig = Resonator(noise=1e-5, acc_noise=1e-5)
    _, _, series = measured(rig)
    lines = {name: np.fft.rfft(values)[::3] for name, values in series.items()}
    frequency = np.fft.rfftfreq(3 * PERIOD, 1 / 2048.0)[::3]
    near = (frequency >= 20) & (frequency <= 40)
    found = (lines["acc"] / lines["force"])[near]
    exact = -((2 * np.pi * frequency[near]) ** 2) * rig.receptance(frequency[near])
    assert np.max(abs(found / exact - 1)) < 5e-3  # at most what may be left of the transient, at the sharpest line
    between = np.abs(np.delete(np.fft.rfft(series["acc"]), np.s_[::3]))
    assert between.max() < 2e-3 * np.abs(lines["acc"]).max()


def test_the_wait_lasts_until_the_periods_repeat():
    slow, fast = (measured(Resonator(damping_ratio=ratio))[0].steps[0] for ratio in (0.002, 0.02))
    assert slow.settled
    assert fast.settled
    tau_s = 1 / (2 * np.pi * 26.5 * 0.002)
    assert slow.settle_s - fast.settle_s > tau_s
    assert slow.remaining < 2e-3


def test_short_periods_do_not_hide_a_slow_decay():
    """A quarter second is a twelfth of the time constant: the response changes little from one period to the next."""
    procedure = PROCEDURE.model_copy(update={"period": 0.25, "band": (10.0, 100.0)})
    step = measured(Resonator(noise=1e-6, acc_noise=1e-6), procedure)[0].steps[0]
    assert step.settled
    tau_s = 1 / (2 * np.pi * 26.5 * 0.0023)
    assert step.settle_s > 4 * tau_s


def test_a_noisy_channel_does_not_hide_the_transient_of_another():
    quiet, noisy = (measured(Resonator(noise=noise, damping_ratio=0.001))[0].steps[0] for noise in (1e-5, 0.05))
    assert noisy.settled
    assert noisy.settle_s == pytest.approx(quiet.settle_s, abs=PROCEDURE.period)


def test_a_fixed_wait_is_kept():
    procedure = PROCEDURE.model_copy(update={"settle": Settle(seconds=9.0), "control": "voltage"})
    step = measured(Resonator(), procedure)[0].steps[0]
    assert step.settle_s == pytest.approx(9.0, abs=1e-3)
    assert step.settled is None


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ("band = [10.0, 100.0]\nperiod = 0.30001", "no whole number of samples"),
        ("band = [10.5, 10.9]\nperiod = 1.0", "no multiple of 1/period"),
        ("band = [10.0, 100.0]\nperiod = 101.0", "less than or equal to 100"),
        ("band = [10.0, 3000.0]\nperiod = 1.0", "sample_rate 5120 Hz is too low"),
    ],
)
def test_what_cannot_be_a_multisine_is_refused(fields, reason):
    with pytest.raises(InputError, match=reason):
        parse_procedure(f'procedure = "multisine"\nrms = 0.5\n{fields}\n'.encode(), source="mine.toml")
