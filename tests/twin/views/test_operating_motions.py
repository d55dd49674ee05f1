"""Operating shapes, loops, residuals and L-curves that a diagnosis's view draws, each against another way to it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recorded_views import columns, value_at

from twin.diagnose.answer.comparison import predicted_steps
from twin.diagnose.answer.result import Diagnosis
from twin.diagnose.fit_problem import modification_of
from twin.diagnose.models import CAUSES
from twin.identify.gauss_newton import Solution
from twin.identify.residuals.residual_model import ResidualModel
from twin.structure import drawn_parts
from twin.views.operating import Motion, operating_motions
from twin.views.rerun.diagnosis import save_diagnosis
from twin.views.rerun.fit import l_curve_of


@pytest.fixture(scope="module")
def motions(diagnosis: Diagnosis) -> list[Motion]:
    model = diagnosis.search.model
    modification = modification_of(diagnosis.evidence, model.hypotheses)
    return operating_motions(diagnosis.evidence, model, diagnosis.sweeps, modification=modification)


def test_the_shape_passes_through_the_sensors(diagnosis: Diagnosis, motions: list[Motion]) -> None:
    """The displacement where a sensor sits is what the model predicts of that sensor."""
    evidence = diagnosis.evidence
    predicted = predicted_steps(evidence, diagnosis.search.model) * np.abs(evidence.steps.force[:, :1])
    for motion, sweep in zip(motions, diagnosis.sweeps, strict=True):
        rows = np.array([state.sweep == sweep.sweep for state in evidence.steps.states])
        top = int(np.argmax(np.where(rows, np.abs(evidence.steps.response[:, evidence.reference, 0]), 0.0)))
        omega = evidence.steps.omega[top]
        for o in range(len(evidence.outputs)):
            deflection = motion.sensors[1, o] * 1e-3
            assert deflection == pytest.approx(predicted[top, o] / (1j * omega) ** 2, rel=1e-3)


def test_near_resonance_the_shape_is_that_of_the_mode(motions: list[Motion]) -> None:
    first, last = (np.concatenate([part.ravel() for part in motion.parts]) for motion in (motions[0], motions[-1]))
    likeness = abs(np.vdot(first, last)) ** 2 / (np.vdot(first, first).real * np.vdot(last, last).real)
    assert likeness > 0.9999
    lower, upper = (part[1] for part in motions[-1].parts)
    assert np.all(np.diff(np.abs(upper)) > 0), "the free end moves most"
    assert abs(lower[0]) < 1e-9, "the clamp does not move"


def test_the_upper_beam_lies_over_the_lower_by_the_opening(diagnosis: Diagnosis, motions: list[Motion]) -> None:
    (joint,), (lower, upper) = motions[-1].joints, drawn_parts(diagnosis.evidence.model.structure)
    below, above = (part[1] for part in motions[-1].parts)
    inside = (upper.points[:, 0] > joint.x[0]) & (upper.points[:, 0] < joint.x[-1])
    x = upper.points[inside, 0]
    gap = above[inside] - np.interp(x, lower.points[:, 0], below)
    assert gap == pytest.approx(np.interp(x, joint.x, joint.opening), abs=0.05 * np.abs(joint.opening).max())


def test_a_clamp_that_turns_is_drawn_with_its_degree_of_freedom(diagnosis: Diagnosis) -> None:
    """A soft clamp has one more than the assumed structure, on which the sensors' places are known."""
    evidence, model = diagnosis.evidence, diagnosis.search.base
    clamp = CAUSES["clamp-compliance"]
    (compliance,) = clamp.parameters(evidence, {})
    soft = clamp.modification(evidence, {}, {compliance.name: compliance.starts[0]})
    for motion in operating_motions(evidence, model, diagnosis.sweeps, modification=soft):
        lower = motion.parts[0]
        assert abs(lower[1, 1]) > abs(lower[1, 0]), "the beam turns about its clamp"
        assert motion.sensors.shape == (3, len(evidence.outputs))


def test_a_loop_never_gives_energy_back(motions: list[Motion]) -> None:
    for motion in motions:
        (joint,) = motion.joints
        assert np.imag(joint.shear_N * np.conj(joint.farthest)) > 0
        assert np.imag(joint.peel_N * np.conj(joint.widest)) > -1e-12, "no loss across, by default"


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
