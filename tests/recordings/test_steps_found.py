"""Steps of a stepped sine are found in the signals themselves, and nothing else is taken for one."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from recordings.importing.steps import found_steps
from recordings.run import Channel, DeviceSamples, Run, StepState
from recordings.sweeps import Sweep, sweeps

RATE_Hz = 2000.0


def run_of(**signals: NDArray[np.float64]) -> Run:
    quantities = {"force": ("force", "N"), "acc1": ("acceleration", "m/s^2")}
    channels = {
        name: Channel(name=name, quantity=quantities[name][0], unit=quantities[name][1], device="daq")
        for name in signals
    }
    device = DeviceSamples(
        device="daq", sample_rate_Hz=RATE_Hz, values={k: v.astype(np.float32) for k, v in signals.items()},
        block_start=np.zeros(1, dtype=np.int64), block_time_ns=np.zeros(1, dtype=np.int64), overload={},
    )  # fmt: skip
    return Run(path="test", info={}, channels=channels, devices={"daq": device}, steps=(), events=())


def found(excitation: str = "found", **signals: NDArray[np.float64]) -> list[Sweep]:
    run = run_of(**signals)
    steps, _ = found_steps(run, excitation, "force")
    return list(sweeps(Run(**{**vars(run), "steps": steps})))


def sine(frequency_Hz: list[float], seconds: float, *, sizes: list[float] | None = None, noise: float = 1e-3):
    """A generator that changes frequency without a jump of phase."""
    count = int(seconds * RATE_Hz)
    phase = 2 * np.pi * np.cumsum(np.repeat(frequency_Hz, count)) / RATE_Hz
    size = np.repeat(sizes or [1.0] * len(frequency_Hz), count)
    return size * np.sin(phase) + noise * np.random.default_rng(1).normal(size=len(phase))


def told(found_sweeps: list[Sweep]) -> list[list[float]]:
    return [[each.step.frequency_Hz for each in sweep.stretches] for sweep in found_sweeps]


@pytest.mark.parametrize("noise", [1e-4, 1e-2])
@pytest.mark.parametrize(
    ("first", "ratio", "seconds"),
    [(20.0, 1.004, 2.0), (25.0, 1.0012, 1.5), (300.0, 1.001, 0.5), (12.0, 1.3, 2.0), (5.0, 1.05, 4.0)],
)
def test_steps_have_their_frequency_and_their_place(noise: float, first: float, ratio: float, seconds: float) -> None:
    frequency = [first * ratio**n for n in range(12)]
    (sweep,) = found(force=sine(frequency, seconds, noise=noise))
    assert told([sweep]) == [pytest.approx(frequency, rel=2e-4)]
    for number, stretch in enumerate(sweep.stretches):
        begin, end = stretch.start_ns * 1e-9, stretch.stop_ns * 1e-9
        assert begin >= number * seconds - 4 / frequency[number]
        assert end <= (number + 1) * seconds + 4 / frequency[number] + 1e-9 or number < 11
        assert end - begin > 0.4 * seconds
    assert sweep.state is StepState.DONE


def test_up_and_down_and_other_levels_are_sweeps_of_their_own() -> None:
    grid = [25.0, 25.2, 25.4, 25.6]
    frequency = [*grid, *grid[-2::-1], *grid]
    three = found(force=sine(frequency, 2.0, sizes=[1.5] * 7 + [3.0] * 4))
    assert [each.name for each in three] == ["force-1.5-up", "force-1.5-down", "force-3-up"]
    assert told(three) == [pytest.approx(part, rel=1e-4) for part in (grid, grid[-2::-1], grid)]
    assert [each.stretches[0].step.target_amplitude for each in three] == pytest.approx([1.5, 1.5, 3.0], rel=0.01)


def test_a_step_is_measured_from_when_the_response_has_settled() -> None:
    time = np.arange(int(8 * RATE_Hz)) / RATE_Hz
    force = np.sin(2 * np.pi * 25 * time) + 1e-4 * np.random.default_rng(2).normal(size=len(time))
    response = np.sin(2 * np.pi * 25 * time) * (1 - np.exp(-time / 0.4))
    (sweep,) = found(force=force, acc1=response + 1e-4 * np.random.default_rng(3).normal(size=len(time)))
    (stretch,) = sweep.stretches
    assert 1.5 < stretch.start_ns * 1e-9 < 4.5
    assert stretch.settle_start_ns is not None
    assert stretch.settle_start_ns * 1e-9 < 1 / 25


RNG = np.random.default_rng(4)
TIME = np.arange(int(20 * RATE_Hz)) / RATE_Hz
NO_STEPS = {
    "noise": RNG.normal(size=len(TIME)),
    "narrow noise": np.convolve(RNG.normal(size=len(TIME)), np.sin(2 * np.pi * 25 * TIME[:800]), "same"),
    "a sweep without steps": np.sin(2 * np.pi * (10 * TIME + 2 * TIME**2)),
    "nothing": np.zeros(len(TIME)),
    "a constant": np.ones(len(TIME)),
    "a pulse": np.where(np.arange(len(TIME)) == 9, 1e30, 0.0),
    "three samples": np.array([0.0, 1.0, 0.0]),
}


@pytest.mark.parametrize("what", NO_STEPS)
def test_what_has_no_steps_is_one_broadband_stretch(what: str) -> None:
    (sweep,) = found(force=NO_STEPS[what])
    assert told([sweep]) == [[0.0]]
    with pytest.raises(ValueError, match="no steps of a stepped sine"):
        found("stepped-sine", force=NO_STEPS[what])


def test_a_response_that_rings_makes_noise_no_stepped_sine() -> None:
    ringing = np.convolve(NO_STEPS["noise"], np.exp(-TIME / 2) * np.sin(2 * np.pi * 26 * TIME))[: len(TIME)]
    (sweep,) = found(force=NO_STEPS["noise"], acc1=ringing)
    assert told([sweep]) == [[0.0]]


def test_broadband_is_believed_where_the_mapping_says_so() -> None:
    (sweep,) = found("broadband", force=sine([25.0, 26.0], 3.0))
    assert told([sweep]) == [[0.0]]


def test_lost_samples_break_no_step() -> None:
    signal = sine([25.0, 25.3, 25.6], 3.0)
    signal[[100, 101, 7000, 7001, 7002]] = np.nan
    assert told(found(force=signal)) == [pytest.approx([25.0, 25.3, 25.6], rel=1e-4)]
