"""A harmonic that meets another mode is told; the same harmonic without a mode there, or a small one, is not."""

import pytest

from recordings.run import Channel
from twin.procedures import ProcedureResult, SteppedSine, StepResult
from twin.procedures.tables import Settle
from twin.rehearsal import NominalRig, Rehearsal, judge

FREQUENCIES = [25.0, 26.0, 27.0]
CHANNELS = {
    "force": Channel(name="force", quantity="force", unit="N", range=50.0, device="daq"),
    "acc": Channel(name="acc", quantity="acceleration", unit="m/s2", range=490.0, device="daq"),
}


def told(*, third, mode_Hz):
    """What a sweep about 26 Hz raises, whose third harmonic is that share of the fundamental at its peak."""
    steps = tuple(
        StepResult(
            sweep="1N-up", index=index, frequency_Hz=f, target_channel="force", target_amplitude=1.0, voltage_V=0.1,
            amplitude=1.0, settle_s=20.0, measure_s=2.0, std={"force": 1e-5, "acc": 1e-5},
            phasors={"force": 1.0, "acc": -10j if f == 26.0 else 1.0},
            harmonics={"force": (1.0, 0.0, 0.0), "acc": (10.0, 0.0, 10.0 * third) if f == 26.0 else (1.0, 0.0, 0.0)},
        )
        for index, f in enumerate(FREQUENCIES)
    )  # fmt: skip
    result = ProcedureResult(
        state="done", reason="", steps=steps, duration_s=66.0, sample_rate_Hz=2048.0, last_step=None
    )
    asked = SteppedSine(frequencies=FREQUENCIES, amplitudes=[1.0], settle=Settle(seconds=20.0))
    nominal = NominalRig(damping_ratio=0.02, modes=((26.0, 0.02), (mode_Hz, 0.02)))
    cautions = judge(Rehearsal(procedure=asked, result=result, channels=CHANNELS, nominal=nominal))
    return [caution for caution in cautions if caution.kind == "internal-resonance"]


def test_a_third_harmonic_that_meets_the_second_mode_is_noted_with_both():
    (note,) = told(third=0.3, mode_Hz=80.0)
    assert (note.severity, note.channel, note.frequency_Hz, note.steps) == ("note", "acc", 26.0, 1)
    assert "harmonic 3 of acc is 30 % of the fundamental: at 78 Hz it meets mode 2 (80 Hz)" in note.reason


@pytest.mark.parametrize(("third", "mode_Hz"), [(0.3, 110.0), (0.02, 80.0)])
def test_a_harmonic_without_a_mode_near_it_or_a_small_one_is_not(third, mode_Hz):
    assert told(third=third, mode_Hz=mode_Hz) == []
