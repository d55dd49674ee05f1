"""A rehearsal of noise: what its report shows, and whether it lasted long enough for the lowest mode."""

import math

import numpy as np
import pytest

from recordings import read_run
from twin.procedures import Random
from twin.rehearsal import NominalRig, open_twin, rehearse, rehearse_until_clear
from twin.rehearsal.noise import noise_tables
from twin.rigs import load_rig
from twin.structure.modelled_rig import modelled_rig
from twin.views.reports.rehearsal import noise_section, noise_sentence, rehearsal_sentence

STEEL = load_rig("steel-lap-joint")
WIDTH_Hz = 2 * STEEL.damping.modal_ratio[0] * modelled_rig(STEEL).modes.frequency_Hz[0]


def bench(procedure):
    return open_twin(STEEL, procedure, preload="120N", seed=3, source="steel")


def rms_in_band(recording, channel, low_Hz, high_Hz):
    """By Parseval's theorem over the whole measured stretch."""
    run = read_run(recording)
    start, stop = (next(step.time_ns for step in run.steps if step.state == s) for s in (1, 2))
    x = run.between(channel, start, stop).astype(float)
    f = np.fft.rfftfreq(len(x), 1 / run.device_of(channel).sample_rate_Hz)
    inside = (f >= low_Hz) & (f <= high_Hz)
    return np.sqrt(2 * np.sum(np.abs(np.fft.rfft(x)[inside]) ** 2)) / len(x)


def rehearsed(tmp_path, duration_s):
    procedure = Random(band=(5.0, 1000.0), rms=0.5, duration=duration_s)
    nominal = NominalRig.of(STEEL, preload="120N")
    return rehearse(procedure, bench(procedure), tmp_path / "run.mcap", nominal=nominal)


def test_noise_shows_the_rigs_modes_with_their_damping(tmp_path):
    first = rehearsed(tmp_path, 60.0)
    assert first.clear
    (noise,) = noise_tables(first.rehearsal, first.recording)
    expected = modelled_rig(STEEL).modes.frequency_Hz[:4]
    assert [mode["frequency_Hz"] for mode in noise["modes"]] == pytest.approx(expected, rel=2e-3)
    for mode, ratio in zip(noise["modes"], STEEL.damping.modal_ratio, strict=True):
        assert mode["damping_ratio"] == pytest.approx(ratio, rel=0.3)
    assert noise["lowest_mode"]["averages"] == pytest.approx(60 * WIDTH_Hz)
    assert set(noise["density"]) == {"force", "acc1", "acc2"}
    assert math.sqrt(sum(noise["density"]["force"]) * noise["resolution_Hz"]) == pytest.approx(
        rms_in_band(first.recording, "force", 5.0, 1000.0), rel=0.05
    )
    section = noise_section(noise)
    assert len(section.pictures[0].draw().axes) == 3
    assert "7.3 averages at the width of the lowest mode" in noise_sentence(noise)


def test_noise_too_short_for_the_lowest_mode_is_told_and_lengthened(tmp_path):
    first = rehearsed(tmp_path, 0.3)
    (caution,) = first.cautions
    assert caution.kind == "too-short"
    assert caution.severity == "warning"
    (noise,) = noise_tables(first.rehearsal, first.recording)
    assert noise_section(noise).pictures[0].draw().axes
    better = rehearse_until_clear(first, bench, tmp_path / "better.mcap")
    assert better.clear
    assert better.rehearsal.procedure.duration * WIDTH_Hz >= 8.0


@pytest.mark.parametrize(
    ("severities", "ending"),
    [
        ([], "no warnings."),
        (["note"], "no warnings but 1 note on what to expect."),
        (["note", "note"], "no warnings but 2 notes on what to expect."),
    ],
)
def test_the_headline_counts_the_notes_of_its_table(severities, ending):
    result = {
        "warnings": [{"severity": each} for each in severities], "steps": [], "duration_s": 60.0, "must_not_run": False,
        "state": "done",
    }  # fmt: skip
    assert rehearsal_sentence(result).endswith(ending)
