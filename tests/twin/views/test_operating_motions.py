"""Operating shapes, loops, residuals and L-curves that a diagnosis's view draws, each against another way to it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recorded_views import columns, value_at

from twin.diagnose.comparison import predicted_steps
from twin.diagnose.fitted_model import modification_of
from twin.diagnose.result import Diagnosis
from twin.identify.gauss_newton import Solution
from twin.identify.residual_model import ResidualModel
from twin.structure import drawn_position
from twin.views import save_diagnosis
from twin.views.operating import Motion, operating_motions
from twin.views.rerun_fit import l_curve_of


@pytest.fixture(scope="module")
def motions(diagnosis: Diagnosis) -> list[Motion]:
    model = diagnosis.search.model
    modification = modification_of(diagnosis.evidence, model.hypotheses)
    return operating_motions(diagnosis.evidence, model, diagnosis.sweeps, modification=modification)


def test_the_shape_passes_through_the_sensors(diagnosis: Diagnosis, motions: list[Motion]) -> None:
    """The beam's deflection where a sensor sits is what the model predicts of that sensor."""
    evidence, layout = diagnosis.evidence, diagnosis.evidence.rig.layout()
    predicted = predicted_steps(evidence, diagnosis.search.model) * np.abs(evidence.steps.force[:, :1])
    for motion, sweep in zip(motions, diagnosis.sweeps, strict=True):
        rows = np.array([state.sweep == sweep.sweep for state in evidence.steps.states])
        top = int(np.argmax(np.where(rows, np.abs(evidence.steps.response[:, evidence.reference, 0]), 0.0)))
        omega = evidence.steps.omega[top]
        for o, output in enumerate(evidence.outputs):
            upper = motion.beams[1]
            deflection = np.interp(drawn_position(layout, output.place), upper.x, upper.value) * 1e-3
            assert deflection == pytest.approx(predicted[top, o] / (1j * omega) ** 2, rel=1e-3)


def test_near_resonance_the_shape_is_that_of_the_mode(motions: list[Motion]) -> None:
    first, last = (np.concatenate([beam.value for beam in motion.beams]) for motion in (motions[0], motions[-1]))
    likeness = abs(np.vdot(first, last)) ** 2 / (np.vdot(first, first).real * np.vdot(last, last).real)
    assert likeness > 0.9999
    assert np.all(np.diff(np.abs(motions[-1].beams[1].value)) > 0), "the tip moves most"
    assert abs(motions[0].beams[0].value[0]) < 1e-9, "the clamp does not move"


def test_the_upper_beam_lies_over_the_lower_by_the_opening(motions: list[Motion]) -> None:
    motion = motions[-1]
    lower, upper = motion.beams
    inside = (upper.x > motion.layer_x[0]) & (upper.x < motion.layer_x[-1])
    x = upper.x[inside]
    gap = upper.value[inside] - np.interp(x, lower.x, lower.value)
    assert gap == pytest.approx(np.interp(x, motion.layer_x, motion.opening), abs=0.05 * np.abs(motion.opening).max())


def test_a_loop_never_gives_energy_back(motions: list[Motion]) -> None:
    for motion in motions:
        assert np.imag(motion.shear_N * np.conj(motion.farthest)) > 0
        assert np.imag(motion.peel_N * np.conj(motion.widest)) > -1e-12, "no loss across, by default"


def test_the_fit_stands_on_its_l_curve_at_strength_one(diagnosis: Diagnosis) -> None:
    """A linear problem solved with the prior by the normal equations."""
    model, evidence = diagnosis.search.model, diagnosis.search.evidence
    mean, precision = ResidualModel(evidence).prior(model.baseline)
    random = np.random.default_rng(5)
    J = 0.2 * random.normal(size=(300, len(mean))) @ np.linalg.cholesky(precision).T
    b = J @ mean + 3.0 * random.normal(size=300)
    x = np.linalg.solve(J.T @ J + precision, J.T @ b + precision @ mean)
    residual = J @ x - b
    solved = Solution(x, float(residual @ residual), 0.0, J.T @ J + precision, residual, J, ())
    curve = l_curve_of(evidence, replace(model, solution=solved))
    departure = np.sqrt((x - mean) @ precision @ (x - mean))
    at_one = np.interp(0.0, np.log(curve.strength), curve.solution_norm)
    assert at_one == pytest.approx(departure, rel=5e-3)
    assert np.interp(0.0, np.log(curve.strength), curve.residual_norm) == pytest.approx(
        np.linalg.norm(residual), rel=5e-3
    )


def test_residuals_are_drawn_from_before_to_after(diagnosis: Diagnosis, tmp_path: Path) -> None:
    save_diagnosis(diagnosis, tmp_path / "view.rrd")
    found = columns(tmp_path / "view.rrd")
    assert found["/residuals/names/1"]["Points2D:labels"] == [["acc2, harmonic 1"]]
    for k, sweep in enumerate(diagnosis.sweeps):
        for name, sizes in (("before", sweep.residual_before), ("after", sweep.residual_after)):
            (point,) = found[f"/residuals/1/{k}/{name}"]["Points2D:positions"][0]
            drawn = value_at(found["/residuals/axes/x"], point[0], axis=0, log=True)
            assert drawn == pytest.approx(np.sqrt(np.mean(sizes[:, 1] ** 2)), rel=0.01)
