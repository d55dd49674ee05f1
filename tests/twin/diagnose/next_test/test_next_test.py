"""Where two causes explain the data alike, the next test is the shortest that is expected to part them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from beam_rows import deflection

from recordings import read_run
from recordings.errors import InputError
from twin.diagnose.fit_problem import CauseHypothesis, FitProblem, modification_of
from twin.diagnose.fitted_model import FitOptions, fit_model
from twin.diagnose.limits import LIMITS
from twin.diagnose.models import CAUSES
from twin.diagnose.next_test import plan_next_test, sensor_place
from twin.diagnose.next_test.limits import LIMITS as NEXT_TEST_LIMITS
from twin.diagnose.next_test.predicted_data import PredictedData, predict_test_data
from twin.diagnose.next_test.predicted_noise import predicted_bins
from twin.diagnose.next_test.proposal import propose
from twin.diagnose.next_test.sensor_place import best_sensor_place
from twin.diagnose.next_test.separation import enough, least_promise, separation
from twin.identify.base_fit import fit_base
from twin.identify.forward.broadband_response import broadband_response
from twin.identify.measured_data import gather_data
from twin.identify.residuals.residual_model import ResidualModel
from twin.procedures import Random, SteppedSine, load_procedure
from twin.rigs import load_rig

RIG = load_rig("steel-lap-joint")
DRIVE = RIG.drive.position


@pytest.fixture(scope="module")
def learnt(campaign):
    runs = tuple(read_run(campaign / f"{name}.mcap") for name in ("random", "sweeps"))
    return runs, gather_data(runs, RIG)


@pytest.fixture(scope="module")
def baseline(learnt):
    return fit_base(learnt[1]).baseline


@pytest.fixture(scope="module")
def believe(learnt, baseline):
    """A model that names one cause at given values, knowing what the recordings leave open, `behind` in evidence."""

    def fitted_model(name, behind=0.0, label=None, **values):
        hypothesis = CauseHypothesis(CAUSES[name], label or {}, values, {})
        fit = fit_model(learnt[1], None, baseline, (hypothesis,), options=FitOptions(iterations=1))
        return replace(fit, hypotheses=(hypothesis,), baseline=baseline, log_evidence=-behind)

    return fitted_model


@pytest.fixture(scope="module")
def plain(believe):
    """The base family, but for a milligram."""
    return believe("added-mass", mass_kg=1e-6, position_m=0.3)


def noise(proposals):
    return [p for p in proposals if isinstance(p.procedure, Random)]


def sweeps(proposals):
    return [p for p in proposals if isinstance(p.procedure, SteppedSine)]


def test_proposals_are_bands_levels_and_lengths_the_shortest_first(learnt, plain):
    found = propose(*learnt, plain, drifting=False)
    times = [p.rig_time_s for p in found]
    assert times == sorted(times)
    assert len({p.procedure.band for p in noise(found)}) >= 5
    assert len({p.procedure.amplitudes[0] for p in sweeps(found)}) >= 2
    assert {p.procedure.direction for p in sweeps(found)} == {"up"}
    assert {p.longer for p in found} >= {1.0, 4.0, 16.0}


def test_a_drift_is_sought_both_ways(learnt, plain):
    assert {p.procedure.direction for p in sweeps(propose(*learnt, plain, drifting=True))} == {"both"}


def test_a_part_of_the_band_is_driven_harder_as_far_as_the_response_allows(learnt, plain):
    """The joint answers to the response: its rms is kept."""
    data = learnt[1].broadband[0]
    response = np.sum(np.abs(data.H) ** 2, axis=1) * data.force_power
    density, moved = {}, {}
    for proposal in noise(propose(*learnt, plain, drifting=False)):
        band, rms = proposal.procedure.band, proposal.procedure.rms
        inside = (data.frequency_Hz >= band[0]) & (data.frequency_Hz <= band[1])
        density[band] = rms**2 / data.force_power[inside].sum()
        moved[band] = density[band] * response[inside].sum()
    assert max(density.values()) > 2.0
    assert min(density.values()) > 0.95
    assert max(moved.values()) < 1.1 * response.sum()


def test_what_a_sweep_reaches_stays_within_the_converters(learnt, plain):
    runs, evidence = learnt
    deaf = [s.model_copy(update={"range": 60.0}) if s.channel == "acc2" else s for s in RIG.sensor]
    quiet = propose(runs, replace(evidence, rig=RIG.model_copy(update={"sensor": deaf})), plain, drifting=False)
    largest = max(p.procedure.amplitudes[0] for p in sweeps(propose(runs, evidence, plain, drifting=False)))
    assert all(p.procedure.amplitudes[0] < largest for p in sweeps(quiet))


def about_mode_2(proposals):
    return [p for p in sweeps(proposals) if "mode 2" in p.what]


def test_another_mode_is_swept_as_far_as_its_layer_opens_no_farther_than_was_measured(learnt, plain):
    """Its resonance lies within the band at every force, and the law is known at all of its steps."""
    _, evidence = learnt
    measured = ResidualModel(evidence).step_receptance(plain.baseline, inner=False)[2]
    proposed = [p for p in about_mode_2(propose(*learnt, plain, drifting=False)) if p.longer == 1.0]
    assert len(proposed) == 2
    opened = []
    for proposal in proposed:
        steps = predict_test_data(evidence, plain, proposal).evidence.steps
        assert 5 <= np.argmax(steps.amplitude_m) < len(steps) - 5
        there = ResidualModel(replace(evidence, broadband=(), steps=steps))
        motion = np.abs(there.step_receptance(plain.baseline, inner=False)[2].motion).max(axis=0)
        opened.append(np.max(motion / np.abs(measured.motion).max(axis=0)))
    assert 0.1 < min(opened) < max(opened) < 1.0


def test_two_masses_that_are_one_to_mode_1_are_parted_by_mode_2(learnt, believe):
    """Their modal masses there are the same; about mode 2 the farther one sits near a node."""
    model = learnt[1].model
    here, there = (deflection(model.structure, x) @ model.basis.Phi[:, 0] for x in (0.30, 0.40))
    near = believe("added-mass", mass_kg=0.004, position_m=0.30)
    far = believe("added-mass", mass_kg=0.004 * float(here / there) ** 2, position_m=0.40)
    found = [p for p in sweeps(propose(*learnt, near, drifting=False)) if p.longer == 1.0]
    parted = {p.what: separation(predict_test_data(learnt[1], near, p), far) for p in found}
    other = [value for what, value in parted.items() if "mode" in what]
    same = [value for what, value in parted.items() if "mode" not in what]
    assert max(other) > 5 * max(same)


@pytest.mark.parametrize("gap", [0.0, 5.0, 20.0])
def test_enough_leaves_nine_in_ten_beyond_the_gap(gap):
    """The gain of log evidence is normal with the separation as mean and twice that as variance."""
    D = enough(gap)
    gains = D + np.sqrt(2 * D) * np.random.default_rng(1).standard_normal(100_000)
    assert np.mean(gains > gap) == pytest.approx(0.9, abs=0.005)


def test_no_test_parts_a_model_from_itself(learnt, believe, plain):
    model = believe("added-mass", mass_kg=0.006, position_m=0.3)
    for proposal in (
        noise(propose(*learnt, plain, drifting=False))[0],
        sweeps(propose(*learnt, plain, drifting=False))[0],
    ):
        predicted_data = predict_test_data(learnt[1], model, proposal)
        assert separation(predicted_data, model) < 1e-3


def test_a_model_within_another_is_told_from_it_by_the_larger_ones_data_alone(learnt, believe, plain):
    """Whatever the smaller one makes the larger one fits as well: to exclude a cause is to know what it would do."""
    hidden = CauseHypothesis(CAUSES["viscous-damper"], {}, {"damping_Ns_per_m": 0.5, "position_m": 0.42}, {})
    larger = replace(plain, hypotheses=(*plain.hypotheses, hidden), log_evidence=-1.35)
    proposal = noise(propose(*learnt, plain, drifting=False))[0]
    data = [predict_test_data(learnt[1], truth, proposal) for truth in (plain, larger)]
    promise = least_promise(plain, [larger], data, margin=NEXT_TEST_LIMITS.needed_log_evidence)
    assert promise.separation == separation(data[1], plain) > 1.0
    assert promise.needed == enough(NEXT_TEST_LIMITS.needed_log_evidence + 1.35 / LIMITS.posterior_temperature)


def test_longer_noise_parts_two_places_of_a_mass_farther(learnt, believe, plain):
    here, there = (believe("added-mass", mass_kg=0.004, position_m=x) for x in (0.30, 0.33))
    whole = [
        p
        for p in noise(propose(*learnt, plain, drifting=False))
        if p.procedure.band[0] < 20.0 < 900.0 < p.procedure.band[1]
    ]
    parted = [separation(predict_test_data(learnt[1], here, p), there) for p in sorted(whole, key=lambda p: p.longer)]
    assert len(parted) == 5
    assert np.all(np.diff(parted) > 0)
    # The model's own error does not fall with time.
    assert parted[-1] < 16 * parted[0]


def test_a_predicted_sweep_has_the_resonance_of_the_recorded_one(learnt, believe, plain):
    _, evidence = learnt
    model = believe("added-mass", mass_kg=1e-6, position_m=0.3)
    largest = max(s.target_amplitude for s in evidence.steps.states)
    (same, *_) = [
        p
        for p in sweeps(propose(*learnt, plain, drifting=False))
        if p.procedure.amplitudes == [largest] and "mode" not in p.what
    ]
    predicted_data = predict_test_data(evidence, model, same).evidence.steps
    recorded = evidence.steps.select(np.array([s.target_amplitude == largest for s in evidence.steps.states]))
    place = np.argmin(np.abs(predicted_data.omega[:, None] - recorded.omega), axis=0)
    near = np.abs(predicted_data.omega[place] - recorded.omega) < 1e-3 * recorded.omega
    assert near.sum() >= 5
    np.testing.assert_allclose(predicted_data.amplitude_m[place[near]], recorded.amplitude_m[near], rtol=0.03)


@pytest.mark.slow
def test_the_plan_is_a_procedure_that_can_be_run_with_what_it_promises(learnt, believe, tmp_path):
    best = believe("added-mass", mass_kg=0.009, position_m=0.30)
    other = believe("stiffness-loss", behind=2.0, factor=0.8, position_m=0.2)
    found = plan_next_test(*learnt, (best, other), RIG, tmp_path)
    assert found is not None
    assert "added-mass from stiffness-loss" in found.why
    procedure = load_procedure(tmp_path / found.procedure)
    assert isinstance(procedure, Random | SteppedSine)
    assert (
        found.separation
        >= found.needed
        >= enough(NEXT_TEST_LIMITS.needed_log_evidence - 2.0 / LIMITS.posterior_temperature)
    )
    assert found.rig_time_s > 5.0


def test_without_a_rival_no_test_is_planned(learnt, believe, tmp_path):
    best = believe("added-mass", mass_kg=0.009, position_m=0.30)
    assert plan_next_test(*learnt, (best,), RIG, tmp_path) is None
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def swept(campaign):
    """Without a broadband run."""
    runs = (read_run(campaign / "sweeps.mcap"),)
    return runs, gather_data(runs, RIG)


def test_where_there_are_only_sweeps_noise_is_proposed_quieter_than_they_were(swept, learnt, plain):
    runs, evidence = swept
    found = noise(propose(runs, evidence, plain, drifting=False))
    rate = runs[0].device_of("force").sample_rate_Hz
    assert len(found) > 1
    for proposal in found:
        assert proposal.procedure.rms == pytest.approx(0.5)
        assert proposal.procedure.band[1] < rate / 2
    whole = {p.procedure.band for p in noise(propose(*learnt, plain, drifting=False))}
    assert not whole & {p.procedure.band for p in found}


def test_the_first_noise_is_predicted_as_it_was_when_it_was_recorded(swept, learnt, believe):
    """Responses and scatter of the run that the sweeps' model has not seen, away from the modes that it is wrong of."""
    recorded = learnt[1].broadband[0]
    model = believe("added-mass", mass_kg=1e-6, position_m=0.3)
    procedure = Random(band=(5.0, 1000.0), duration=30.0, rms=0.5)
    predicted_data = predicted_bins(swept[1], model, procedure, recorded.time_s)
    assert len(predicted_data.frequency_Hz) == pytest.approx(len(recorded.frequency_Hz), rel=0.5)

    def differ(row):
        there, own = (np.log(row(data)) for data in (predicted_data, recorded))
        return np.median(np.abs(np.interp(recorded.frequency_Hz, predicted_data.frequency_Hz, there) - own))

    assert differ(lambda data: np.abs(data.H[:, 1])) < 0.1
    # Of one line; within a factor of two.
    assert differ(lambda data: np.sqrt(data.relative_covariance[:, 1, 1].real * data.force_power)) < np.log(2)


@pytest.mark.slow
def test_sweeps_that_two_masses_explain_alike_call_for_noise(swept, believe, tmp_path):
    best = believe("added-mass", mass_kg=0.009, position_m=0.30)
    other = believe("stiffness-loss", behind=2.0, factor=0.8, position_m=0.2)
    found = plan_next_test(*swept, (best, other), RIG, tmp_path)
    assert found is not None
    assert isinstance(load_procedure(tmp_path / found.procedure), Random)
    assert found.separation >= found.needed


@pytest.mark.slow
@pytest.mark.parametrize("error", [
    InputError("extended.toml", "", "joint.law: it is not the law of a passive layer"),
    ArithmeticError("the joint's equations had no solution in 1 of 1408 steps"),
], ids=["refused", "fallen-apart"])  # fmt: skip
def test_a_model_that_cannot_be_marched_still_proposes_its_test_and_says_so(
    learnt, believe, tmp_path, monkeypatch, error
):  # fmt: skip
    def refuse(*arguments, **options):
        raise error

    monkeypatch.setattr("twin.diagnose.next_test.plan.open_twin", refuse)
    best = believe("added-mass", mass_kg=0.009, position_m=0.30)
    other = believe("stiffness-loss", behind=2.0, factor=0.8, position_m=0.2)
    found = plan_next_test(*learnt, (best, other), RIG, tmp_path)
    assert found is not None
    reason = error.reason if isinstance(error, InputError) else str(error)
    assert f"not rehearsed, for {reason}" in found.why
    assert load_procedure(tmp_path / found.procedure)


def test_a_further_sensor_goes_where_the_rivals_differ_most(learnt, believe):
    """A damper near the tip beside one farther in, worked out again with each response that a sensor would read."""
    _, evidence = learnt
    one = believe("viscous-damper", damping_Ns_per_m=0.05, position_m=0.41)
    two = believe("viscous-damper", damping_Ns_per_m=0.055, position_m=0.40)
    found, _ = best_sensor_place(evidence, one, [two], margin=NEXT_TEST_LIMITS.needed_log_evidence)
    layout, structure = RIG.layout(), evidence.model.structure
    taken = [layout.position(output.place) for output in evidence.outputs]
    assert min(abs(layout.position(found) - x) for x in taken) > 0.01
    worst = [
        place
        for x in (0.02, 0.05)
        if np.linalg.norm(structure.row(place := layout.place(x))) > 0
    ]  # fmt: skip
    at = {place: sensor_place._predict_test_data(evidence, one, place) for place in (found, *worst)}
    gains = {place: separation(predicted_data, two) for place, predicted_data in at.items()}
    assert gains[found] == max(gains.values())
    without = separation(predict_noise_again(evidence, one), two)
    assert gains[found] > without


def predict_noise_again(evidence, truth):
    """The same run with the sensors that were there."""
    data = evidence.broadband[-1]
    there = replace(evidence.without_steps(), broadband=(data,))
    predicted = broadband_response(ResidualModel(there, modification_of(there, truth.hypotheses)), data, truth.baseline)
    there = replace(there, broadband=(replace(data, H=predicted),))
    own = FitProblem(there, None, truth.baseline, truth.hypotheses)
    return PredictedData(there, None, own.residual_model(own.x0).evaluate(truth.baseline, sensitivities=False).residual)
