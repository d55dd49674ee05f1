"""Damping and frequency of a ring-down: exact for a linear resonator, along the backbone for a stiffening one."""

import numpy as np
import pytest
from resonator import Resonator

from twin.procedures import RingDown
from twin.procedures.tables import Measure
from twin.rehearsal import NominalRig, rehearse, rehearsed_table
from twin.rehearsal.ring_down import free_decays

ASKED = RingDown(frequency=26.5, amplitudes=[0.5, 1.0], duration=8.0, measure=Measure(seconds=1.0))


def rehearsed(tmp_path, procedure=ASKED, **rig):
    return rehearse(procedure, Resonator(**rig), tmp_path / "run.mcap", nominal=NominalRig(damping_ratio=0.0023))


def test_a_linear_decay_has_the_resonators_damping_and_the_shakers(tmp_path):
    table = rehearsed_table(rehearsed(tmp_path, back_emf_ratio=0.1))
    assert [(one["index"], one["channel"]) for one in table["decays"]] == [(1, "acc"), (3, "acc")]
    for decay in table["decays"]:
        assert decay["damping_ratio"] == pytest.approx(1.1 * 0.0023, rel=1e-3)
        assert decay["frequency_Hz"] == pytest.approx(26.5, abs=1e-3)
        assert not decay["depends"]
    assert table["decays"][1]["amplitude"] == pytest.approx(2 * table["decays"][0]["amplitude"], rel=0.02)


def test_a_stiffening_decay_comes_down_in_frequency(tmp_path):
    procedure = ASKED.model_copy(update={"frequency": 26.6, "amplitudes": [4.0]})
    table = rehearsed_table(rehearsed(tmp_path, procedure, cubic=1e8, back_emf_ratio=0.0))
    (decay,) = table["decays"]
    parts = decay["parts"]
    w0 = 2 * np.pi * 26.5
    for part in parts:  # backbone of the Duffing oscillator, to first order
        x = part["amplitude"] / (2 * np.pi * part["frequency_Hz"]) ** 2
        shift = 26.5 * 3 * 1e8 * x**2 / (8 * 5.0 * w0**2)
        assert part["frequency_Hz"] - 26.5 == pytest.approx(shift, rel=0.2, abs=2e-3)
    assert parts[0]["frequency_Hz"] > parts[-1]["frequency_Hz"] + 0.02


def test_a_decay_is_followed_down_to_its_noise_only(tmp_path):
    long = ASKED.model_copy(update={"amplitudes": [0.2], "duration": 40.0})
    one = rehearsed(tmp_path, long, acc_noise=0.05)
    (decay,) = free_decays(one.rehearsal.result, one.recording, ["acc"])
    assert decay.damping_ratio == pytest.approx(1.1 * 0.0023, rel=0.01)
    assert all(part.damping_ratio > 0.0020 for part in decay.parts)


def test_other_procedures_have_no_decays(tmp_path):
    one = rehearsed(tmp_path)
    (first, *_) = [step for step in one.rehearsal.result.steps if step.target_amplitude]
    nothing = one.rehearsal.result.__class__(
        state="done", reason="", steps=(first,), duration_s=1.0, sample_rate_Hz=2048.0
    )
    assert list(free_decays(nothing, one.recording, ["acc"])) == []
