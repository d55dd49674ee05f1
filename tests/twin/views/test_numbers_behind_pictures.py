"""The numbers that pictures show, against closed forms and sampling."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from recorded_views import LEVELS_N, FREQUENCIES_Hz, fitted_model, sdof_receptance

from recordings import Run
from twin.diagnose.answer.result import Diagnosis
from twin.diagnose.fit_problem import CauseHypothesis, modification_of
from twin.diagnose.models import CAUSES
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.measured_data import MeasuredData
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.residuals.residual_model import ResidualModel
from twin.structure import drawn_parts
from twin.views.curves import (
    broadband_responses,
    compared_models,
    law_bands,
    law_in_lowest_mode,
    modelled_by,
    stepped_sweeps,
)
from twin.views.operating import modal_motion
from twin.views.reports.answer import residual_rows
from twin.views.style import ticks


def test_receptances_of_a_run_are_those_of_its_resonance(run: Run) -> None:
    sweeps = stepped_sweeps(run)
    assert [sweep.name for sweep in sweeps] == [f"{level:g}N-up" for level in LEVELS_N]
    assert [sweep.level for sweep in sweeps] == ["1 N", "2 N"]
    exact = [1e3 * abs(sdof_receptance(frequency)) for frequency in FREQUENCIES_Hz]
    for sweep in sweeps:
        assert sweep.frequency_Hz == pytest.approx(FREQUENCIES_Hz)
        assert sweep.receptance["acc1"] == pytest.approx(exact, rel=1e-4)
        assert sweep.harmonics["acc1"][:, 1] / sweep.harmonics["acc1"][:, 0] == pytest.approx(0.01, rel=1e-3)


def test_the_laws_bands_are_the_scatter_of_its_knots(diagnosis: Diagnosis) -> None:
    fitted_model = diagnosis.search.model
    softening, loss = law_bands(diagnosis.evidence, fitted_model)
    law, generator = fitted_model.baseline.laws[0], np.random.default_rng(1)
    for band, knots, basis in (
        (softening, law.softening, law.softening_basis(softening.amplitude_m)),
        (loss, law.loss, law.loss_basis(loss.amplitude_m)),
    ):
        scatter = np.std((knots + 1e5 * generator.normal(size=(4000, len(knots)))) @ basis.T, axis=0)
        assert band.std == pytest.approx(scatter, rel=0.06)
    assert softening.value == pytest.approx(law.softening_at(softening.amplitude_m))
    assert loss.value == pytest.approx(law.loss_at(loss.amplitude_m))


def test_a_law_is_shaded_where_no_step_reached(diagnosis: Diagnosis) -> None:
    """The layer's points move as the measured steps say; beyond the farthest of them nothing was measured."""
    evidence, model = diagnosis.evidence, diagnosis.search.model
    residual_model = ResidualModel(evidence, modification_of(evidence, model.hypotheses))
    motion = np.abs(residual_model.step_receptance(model.baseline)[2].motion)
    points = len(residual_model.points)
    for band, part in zip(
        law_bands(evidence, model), (motion[:, :points], motion[:, points : 2 * points]), strict=True
    ):
        farthest = part.max(axis=1)
        assert band.reach_m == pytest.approx((farthest.min(), farthest.max()), rel=1e-6)
        first, last = band.amplitude_m[[0, -1]]
        shaded = [(low, high) for low, high in ((first, farthest.min()), (farthest.max(), last)) if low < high]
        assert band.unmeasured_m == [pytest.approx(ends, rel=1e-6) for ends in shaded] != []


def test_uniform_moduli_as_the_mode_sees_them_answer_as_the_layers_points_do(diagnosis: Diagnosis) -> None:
    """Near the resonance the moduli at each step's own amplitude and the points' own stiffness move the tip alike."""
    evidence, model = diagnosis.evidence, diagnosis.search.base
    seen, residual_model, base = law_in_lowest_mode(evidence, model), ResidualModel(evidence), model.baseline.base
    omega, omega_1 = evidence.steps.omega, evidence.reference_omega
    assert seen.number == 1
    X = evidence.steps.amplitude_m * (omega / omega_1) ** 2
    g1, g2 = (np.interp(X, seen.amplitude_m, seen.value[name]) for name in ("softening", "loss"))
    nothing = replace(model.baseline, laws=(LayerLaw.zero(*(np.array([1e-8, 1e-6]),) * 2),))
    own, plain = (residual_model.responses(*residual_model.step_receptance(u)[:2]) for u in (model.baseline, nothing))
    R = residual_model.model.receptance(omega, base, dE=-g1[:, None], dG=1j * g2[:, None])
    uniform, without = (np.abs(H / own - 1)[:, evidence.reference] for H in (residual_model.responses(R, omega), plain))
    assert np.max(uniform) < 0.02 * np.max(without)


def test_the_band_of_a_law_in_a_mode_is_what_its_knots_move_it_by(diagnosis: Diagnosis) -> None:
    evidence, model = diagnosis.evidence, diagnosis.search.model
    baseline, step = model.baseline, 1e4
    seen = law_in_lowest_mode(evidence, model, points=5)
    variance = {name: np.zeros(5) for name in seen.std}
    for i in range(baseline.of_laws.start, baseline.of_laws.stop):
        vector = baseline.vector
        vector[i] += step
        moved = law_in_lowest_mode(evidence, replace(model, baseline=baseline.with_vector(vector)), points=5)
        for name in variance:
            variance[name] += ((moved.value[name] - seen.value[name]) / step * 1e5) ** 2
    for name, std in seen.std.items():
        assert std == pytest.approx(np.sqrt(variance[name]), rel=0.02)


def test_the_first_mode_is_clamped_at_the_root_and_opens_the_joint_where_the_beams_part(diagnosis: Diagnosis) -> None:
    evidence, model = diagnosis.evidence, diagnosis.search.model
    assert modelled_by(evidence, model).modes.frequency_Hz[0] == pytest.approx(26.5, rel=0.05)
    motion, (lower, upper) = modal_motion(evidence, model), drawn_parts(evidence.model.structure)
    (joint,), (below, above) = motion.joints, (part[1] for part in motion.parts)
    assert below[0] == 0.0
    assert abs(above[-1]) == pytest.approx(1.0, rel=1e-3)
    apart = np.interp(joint.x, upper.points[:, 0], above) - np.interp(joint.x, lower.points[:, 0], below)
    # between nodes the beams are cubic, the interpolation is not: alike, not equal
    assert np.corrcoef(joint.opening, apart)[0, 1] > 0.97
    assert np.ptp(joint.opening) == pytest.approx(np.ptp(apart), rel=0.1)


def test_the_true_model_meets_the_broadband_run_and_the_base_does_not(diagnosis: Diagnosis) -> None:
    data = diagnosis.evidence.broadband[0]
    error = {
        kind: np.max(np.abs(broadband_responses(diagnosis.evidence, model, 0) / data.H - 1))
        for kind, model in compared_models(diagnosis).items()
    }
    assert error["after"] < 1e-9
    assert error["before"] > 0.1


def test_a_nonlinear_models_broadband_response_is_the_one_that_was_fitted(
    unmeasured: tuple[MeasuredData, BaselineParameters],
) -> None:
    """A spring that stiffens is stiffer under noise; data that such a picture shows leave the fit no residual."""
    blank, baseline = unmeasured
    hypothesis = CauseHypothesis(CAUSES["cubic-stiffness"], {}, {"stiffness_N_per_m3": 3e8, "position_m": 0.4}, {})
    model, linear = fitted_model(baseline, (hypothesis,), (1.0,)), fitted_model(baseline, (), (1.0,))
    (data,) = blank.broadband
    evidence = replace(blank, broadband=(replace(data, force_power=np.full(len(data.omega), 20.0)),))
    for _ in range(60):
        H = broadband_responses(evidence, model, 0)
        evidence = replace(evidence, broadband=(replace(evidence.broadband[0], H=H),))
    assert np.max(np.abs(H / broadband_responses(evidence, linear, 0) - 1)) > 0.02
    fit = ResidualModel(evidence, modification_of(evidence, model.hypotheses)).evaluate(baseline, sensitivities=False)
    rows = dict(fit.blocks)["broadband 0"]
    assert np.max(np.abs(fit.residual[rows])) < 1e-3


def test_residuals_fall_to_the_noise_when_the_cause_is_named(diagnosis: Diagnosis) -> None:
    for _, _, before, after in residual_rows(diagnosis.sweeps):
        assert after < 1.0 < before


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6))
def test_ticks_lie_on_the_axis_evenly(low: float, width: float) -> None:
    found = ticks(low, low + width)
    assert 2 <= len(found) <= 9
    assert min(found) >= low - 1e-6 * width
    assert max(found) <= low + width * (1 + 1e-6)
    assert np.diff(found) == pytest.approx(np.diff(found)[0], rel=1e-3)


def test_logarithmic_ticks_are_round() -> None:
    assert ticks(0.05, 300, log=True) == [0.1, 1.0, 10.0, 100.0]
    assert ticks(1, 20, log=True) == [1, 2, 5, 10, 20]
