"""Each warning is provoked by a procedure that deserves it, silent on a good one, and cleared by its own advice."""

import pytest
from resonator import Resonator

from recordings import read_run
from twin.procedures import Multisine, Random, SteppedSine, SweptSine
from twin.procedures.tables import Grid, Limits, Measure, Settle
from twin.rehearsal import NominalRig, rehearse, rehearse_until_clear

GOOD = SteppedSine(
    grid=Grid(kind="adaptive", start=26.0, stop=27.0, step=0.12, smallest=0.02, change=0.4),
    amplitudes=[1.5],
    measure=Measure(seconds=1.0),
)
DAMPING, Q = 0.0023, 1 / (2 * 0.0023)
SHORT = {"settle": Settle(seconds=0.2), "measure": Measure(seconds=0.2)}
FINE = [round(26.2 + 0.05 * i, 2) for i in range(13)]


def changed(**fields):
    return SteppedSine(**{**GOOD.model_dump(exclude_defaults=True), **fields})


def rehearsed(tmp_path, procedure, bits=24, **rig):
    nominal = NominalRig(rig_name="resonator", damping_ratio=DAMPING, bits=bits)

    def make():
        return Resonator(bits=bits, **rig)

    first = rehearse(procedure, make(), tmp_path / "run.mcap", nominal=nominal)
    return first, lambda: rehearse_until_clear(first, lambda _: make(), tmp_path / "improved.mcap")


def kinds(one):
    return {caution.kind for caution in one.cautions}


def test_a_good_procedure_raises_nothing(tmp_path):
    first, improve = rehearsed(tmp_path, GOOD)
    assert first.clear
    assert first.cautions == ()
    assert improve() is None
    run = read_run(tmp_path / "run.mcap")
    assert run.info["stored"] == "all"
    assert "procedure.toml" in run.attachments


def test_too_short_a_dwell_falsifies_the_damping_until_it_is_lengthened(tmp_path):
    procedure = changed(grid=None, frequencies=FINE, direction="both", **SHORT)
    first, improve = rehearsed(tmp_path, procedure)
    assert "dwell-too-short" in kinds(first)
    up = next(first.rehearsal.summaries())
    assert not 0.5 * Q < up.quality_factor < 2 * Q
    assert "false hysteresis" in next(c for c in first.cautions if c.kind == "dwell-too-short").reason
    better = improve()
    assert better.clear
    for summary in better.rehearsal.summaries():
        assert summary.quality_factor == pytest.approx(Q, rel=0.05)


@pytest.mark.slow
def test_a_wait_cut_off_too_early_is_too_short_as_well(tmp_path):
    first, improve = rehearsed(tmp_path, changed(settle=Settle(tolerance=1e-3, maximum=4.0)))
    assert "dwell-too-short" in kinds(first)
    assert improve().clear


@pytest.mark.slow
def test_a_coarse_grid_hides_the_peak_until_it_is_refined(tmp_path):
    coarse = changed(grid=Grid(start=25.87, stop=27.2, step=0.25))
    first, improve = rehearsed(tmp_path, coarse)
    assert kinds(first) == {"grid-too-coarse"}
    better = improve()
    assert better.clear
    exact = 1.5 / (2 * DAMPING * 5.0)  # acceleration at resonance: F / (2 zeta m)
    peaks = [next(one.rehearsal.summaries()).peak_response for one in (first, better)]
    assert peaks[0] < 0.6 * exact
    assert peaks[1] == pytest.approx(exact, rel=0.03)


@pytest.mark.parametrize("acc_range", [40.0, 68.0])
def test_overload_is_seen_and_avoided(tmp_path, acc_range):
    first, improve = rehearsed(tmp_path, GOOD, acc_range=acc_range)  # the peak is 65 m/s2
    assert kinds(first) == {"overload"}
    assert first.must_not_run == (acc_range < 65)
    better = improve()
    assert better.clear
    assert 0.5 < max(step.peak["acc"] for step in better.rehearsal.result.steps) / acc_range < 0.9


def test_a_guard_that_trips_lowers_the_amplitudes(tmp_path):
    procedure = changed(amplitudes=[0.5, 1.0, 4.0], limits=Limits(peak={"acc": 100.0}))
    first, improve = rehearsed(tmp_path, procedure)
    assert kinds(first) == {"limit-reached"}
    assert first.must_not_run
    assert first.cautions[0].sweep == "4N-up"
    better = improve()
    assert better.clear
    assert better.rehearsal.procedure.amplitudes[:2] == [0.5, 1.0]
    assert max(step.peak["acc"] for step in better.rehearsal.result.steps) < 90.0


def test_coming_near_a_limit_is_a_warning(tmp_path):
    first, _ = rehearsed(tmp_path, changed(limits=Limits(peak={"acc": 68.0})))
    assert [(c.kind, c.severity) for c in first.cautions] == [("limit-reached", "warning")]


def test_a_force_that_drops_out_is_what_the_generator_cannot_give(tmp_path):
    procedure = changed(limits=Limits(voltage=0.8))
    first, improve = rehearsed(tmp_path, procedure, back_emf_ratio=2.0)  # 1.5 N at resonance takes 1.1 V
    assert kinds(first) == {"force-drop-out"}
    assert "0.8 V" in first.cautions[0].reason
    better = improve()
    assert better.clear
    assert 0.9 < better.rehearsal.procedure.amplitudes[0] < 1.1


def test_a_jump_is_announced_and_then_recorded_from_both_sides(tmp_path):
    grid = Grid(start=26.1, stop=26.5, step=0.02)
    first, improve = rehearsed(tmp_path, changed(amplitudes=[4.0], grid=grid), cubic=-1e8, back_emf_ratio=0.01)
    assert kinds(first) == {"jump-ahead"}
    assert first.cautions[0].frequency_Hz == pytest.approx(26.33, abs=0.03)
    better = improve()
    assert better.clear
    (note,) = better.cautions
    assert note.severity == "note"
    assert {case.sweep for case in note.cases} == {"4N-up", "4N-down"}


def test_noise_is_measured_away(tmp_path):
    first, improve = rehearsed(tmp_path, GOOD, acc_noise=2.0)
    assert "noise-floor" in kinds(first)
    better = improve()
    assert better.clear
    assert better.rehearsal.procedure.measure.seconds > 2.0


def test_a_few_converter_steps_are_too_few(tmp_path):
    procedure = changed(amplitudes=[0.02, 1.5])
    first, improve = rehearsed(tmp_path, procedure, bits=16)
    assert kinds(first) == {"quantisation"}
    better = improve()
    assert better.clear
    assert min(better.rehearsal.procedure.amplitudes) > 0.05


def test_random_excitation_is_judged_by_its_peaks(tmp_path):
    random = Random(band=(5.0, 500.0), rms=0.5, duration=10.0, sample_rate=2048.0)
    first, _ = rehearsed(tmp_path, random)
    assert first.clear
    first, improve = rehearsed(tmp_path, random, force_range=1.0)
    assert kinds(first) == {"overload"}
    better = improve()
    assert better.clear
    assert better.rehearsal.procedure.rms < 0.3


def test_a_multisine_measured_too_early_is_given_time(tmp_path):
    multisine = Multisine(band=(10.0, 100.0), rms=0.2, period=2.0, sample_rate=2048.0)
    assert rehearsed(tmp_path, multisine)[0].cautions == ()
    hasty = multisine.model_copy(update={"settle": Settle(seconds=6.0)})
    first, improve = rehearsed(tmp_path, hasty)
    assert kinds(first) == {"dwell-too-short"}
    assert improve().clear


def test_a_swept_sine_that_passes_too_fast_is_slowed_until_the_peak_is_whole(tmp_path):
    fast = SweptSine(start=25.5, stop=27.5, rate=0.2, voltages=[0.1])
    first, improve = rehearsed(tmp_path, fast, back_emf_ratio=0.0)
    assert kinds(first) == {"sweep-too-fast"}
    better = improve()
    assert better.clear
    exact = 4.0 * 0.1 / (2 * DAMPING * 5.0)  # acceleration at resonance: force per volt times V / (2 zeta m)
    peaks = [one.rehearsal.result.steps[0].peak["acc"] for one in (first, better)]
    assert peaks[0] < 0.8 * exact
    assert peaks[1] == pytest.approx(exact, rel=0.05)
