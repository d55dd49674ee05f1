"""One procedure over two resonances is judged, improved and told about each of them, and not between them."""

import numpy as np
import pytest

from twin.procedures import SteppedSine
from twin.procedures.tables import Grid, Measure
from twin.rehearsal import NominalRig, open_twin, rehearse, rehearse_until_clear
from twin.rehearsal.bands import band_numbers
from twin.rigs import load_rig

STEEL = load_rig("steel-lap-joint")
MODES_Hz = 26.44, 155.64
"""The steel rig's first two resonances at 1 N; the second is bent, and a sweep upwards jumps there."""
LOW_Hz = [26.0, 26.2, 26.4, 26.6, 27.0, 28.0]
HIGH_Hz = [150.0, 153.0, 155.0, 156.5, 158.0, 162.0]


def receptance(frequency_Hz, natural_Hz, damping_ratio=0.003):
    """Two modes of equal stiffness."""
    f = np.asarray(frequency_Hz)[:, None]
    mode = 1 / (1 - (f / natural_Hz) ** 2 + 2j * damping_ratio * f / natural_Hz)
    return np.abs(mode.sum(axis=1))


def improved(tmp_path, procedure, rounds=1):
    nominal = NominalRig.of(STEEL, preload="120N")

    def make(_=None):
        return open_twin(STEEL, procedure, preload="120N", seed=0, source="steel")

    first = rehearse(procedure, make(), tmp_path / "run.mcap", nominal=nominal)
    return first, rehearse_until_clear(first, make, tmp_path / "improved.mcap", rounds=rounds)


def frequencies_Hz(rehearsed):
    return np.array([step.frequency_Hz for step in rehearsed.rehearsal.result.steps])


@pytest.mark.parametrize(("last_Hz", "numbers"), [(100.0, 1), (200.0, 2)])
def test_a_grid_without_a_gap_is_divided_where_the_response_is_smallest_between_peaks(last_Hz, numbers):
    frequency_Hz = np.arange(20.0, last_Hz, 1.5)
    size = receptance(frequency_Hz, np.array([26.4, 156.0]))
    found = band_numbers(frequency_Hz, size)
    assert set(found) == set(range(numbers))
    assert np.all(np.diff(found) >= 0)
    if numbers == 2:
        between = (frequency_Hz > 26.4) & (frequency_Hz < 156.0)
        assert size[np.argmax(found)] == size[between].min()


def test_a_gap_divides_downward_sweeps_too():
    frequency_Hz = np.array([*HIGH_Hz, *LOW_Hz])[::-1]
    size = receptance(frequency_Hz, np.array(MODES_Hz))
    assert band_numbers(frequency_Hz, size).tolist() == [0] * len(LOW_Hz) + [1] * len(HIGH_Hz)


def test_a_step_or_two_before_a_gap_are_no_resonance_of_their_own():
    frequency_Hz = np.array([2.0, 5.0, 10.0, 12.0, 14.0, 30.0])
    assert set(band_numbers(frequency_Hz, receptance(frequency_Hz, np.array([12.3])))) == {0}


def test_two_peaks_that_the_response_hardly_sinks_between_are_one_resonance():
    frequency_Hz = np.arange(20.0, 60.0, 0.5)
    assert set(band_numbers(frequency_Hz, 2 + np.cos(frequency_Hz * 2 * np.pi / 16) / 2)) == {0}


def test_each_resonance_is_refined_and_told_and_the_gap_left_alone(tmp_path):
    procedure = SteppedSine(
        frequencies=[*LOW_Hz, *HIGH_Hz], amplitudes=[1.0], sample_rate=1024.0, measure=Measure(seconds=1.0)
    )
    first, better = improved(tmp_path, procedure)
    for caution in first.cautions:
        assert caution.kind in ("grid-too-coarse", "jump-ahead")
    assert any("near 26.4" in caution.advice for caution in first.cautions)
    assert not np.any((frequencies_Hz(better) > max(LOW_Hz)) & (frequencies_Hz(better) < min(HIGH_Hz)))
    assert better.rehearsal.result.duration_s < 6 * first.rehearsal.result.duration_s
    up = [summary.peak_frequency_Hz for summary in better.rehearsal.summaries() if summary.sweep == "1N-up"]
    assert up == pytest.approx(MODES_Hz, rel=1e-3)


@pytest.mark.slow
def test_an_adaptive_grid_over_both_stays_coarse_between_them(tmp_path):
    procedure = SteppedSine(
        grid=Grid(kind="adaptive", start=20.0, stop=170.0, step=3.0, smallest=0.05, change=0.4),
        amplitudes=[1.0], sample_rate=1024.0, measure=Measure(seconds=1.0),
    )  # fmt: skip
    first, better = improved(tmp_path, procedure)
    between = frequencies_Hz(better)[: len(frequencies_Hz(better)) // 2]
    assert np.sum((between > 35) & (between < 120)) <= 85 / 3 + 1
    assert better.rehearsal.result.duration_s < 6 * first.rehearsal.result.duration_s


@pytest.mark.slow
def test_noise_between_the_resonances_makes_no_measurement_longer(tmp_path):
    procedure = SteppedSine(grid=Grid(start=20.0, stop=170.0, step=1.5), amplitudes=[1.0], sample_rate=1024.0)
    first, _ = improved(tmp_path, procedure, rounds=0)
    assert "noise-floor" not in {caution.kind for caution in first.cautions}
