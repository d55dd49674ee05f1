"""A fitted model as a rig file: the law with its constant loss, all of the damping, and how well both are known."""

from dataclasses import replace

import numpy as np
import pytest

from recordings import InputError
from recordings.numbers import LARGEST
from twin.bench.layer import law_from_table
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.gauss_newton import Solution
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.updated_rig import updated_rig
from twin.structure import normal_modes


@pytest.fixture
def baseline(other_base):
    law = LayerLaw(
        np.geomspace(5e-8, 5e-6, 6), np.geomspace(2e-8, 2e-6, 5),
        1e7 * np.array([0.1, 0.4, 1.0, 3.0, 7.0, 12.0]), 1e7 * np.array([0.0, 0.2, 1.0, 8.0, 60.0]),
    )  # fmt: skip
    return BaselineParameters(other_base, (law,))


@pytest.fixture
def evidence(steel_model, build):
    omega = 2 * np.pi * np.array([26.0, 26.5])
    return build.evidence(steel_model, build.steps(omega, np.ones((2, 1)), np.ones((2, 2, 1))))


def solved(baseline):
    """A minimum with a covariance that ties everything to everything."""
    x = baseline.vector
    scale = np.concatenate([np.full(len(x) - 11, 1e-3), np.full(11, 1e6)])
    A = np.random.default_rng(2).normal(size=(3 * len(x), len(x))) / scale
    return Solution(x, 1.0, 0.0, A.T @ A, np.zeros(1), np.zeros((1, len(x))), ())


def test_a_file_has_the_fitted_law_with_the_constant_loss_in_it(evidence, baseline):
    law = updated_rig(evidence, baseline, solved(baseline)).joint.law
    opening, slip = np.array(law.opening_m), np.array(law.slip_m)
    assert law.softening == pytest.approx(baseline.laws[0].softening_at(opening))
    constant = baseline.base.G * baseline.base.loss_G
    assert law.loss == pytest.approx(constant + baseline.laws[0].loss_at(slip))
    assert law.loss[0] == pytest.approx(constant)
    between = np.geomspace(1e-8, slip[-1], 300)
    on_the_bench = law_from_table(law, E=baseline.base.E).loss
    assert on_the_bench.modulus(between) == pytest.approx(constant + baseline.laws[0].loss_at(between), rel=0.02)


def test_damping_beyond_the_identified_modes_stays_as_it_is_believed(evidence, baseline):
    ratios = [0.001, 0.002, 0.003, 0.004, 0.005, 0.006, 0.007]
    rig = evidence.rig.model_copy(
        update={"damping": evidence.rig.damping.model_copy(update={"modal_ratio": ratios})}
    )  # fmt: skip
    written = updated_rig(replace(evidence, rig=rig), baseline, solved(baseline))
    assert written.damping.modal_ratio == [*baseline.base.zeta.tolist(), 0.006, 0.007]
    assert list(written.joint.preload) == [evidence.preload]
    assert written.joint.preload[evidence.preload].shear_modulus == baseline.base.G


def test_standard_deviations_are_those_of_what_a_response_feels(evidence, baseline):
    """By drawing models: E' - s(o), and l(q) with the constant loss and the damping of mode 1 in its units."""
    solution = solved(baseline)
    written = updated_rig(evidence, baseline, solution)
    law = written.joint.law
    opening, slip = np.array(law.opening_m), np.array(law.slip_m)
    root = np.linalg.cholesky(np.linalg.inv(solution.information))
    drawn = np.random.default_rng(7).normal(size=(6000, len(solution.x))) @ root.T
    structure = evidence.model.structure
    modes = normal_modes(structure.M, structure.stiffness(baseline.base.E, baseline.base.G), 1)
    omega_1, sheared = modes.omega[0], np.sum((structure.joints[0].B_G @ modes.Phi[:, 0]) ** 2)
    stiff, lossy, damped = [], [], []
    for change in drawn:
        other = baseline.with_vector(baseline.vector + 1e-2 * change)
        damped.append(other.base.zeta)
        stiff.append(other.base.E - other.laws[0].softening_at(opening))
        damping = 2 * omega_1**2 * other.base.zeta[0] / sheared
        lossy.append(other.base.G * other.base.loss_G + other.laws[0].loss_at(slip) + damping)
    assert law.softening_std == pytest.approx(1e2 * np.std(stiff, axis=0), rel=0.05)
    assert law.loss_std == pytest.approx(1e2 * np.std(lossy, axis=0), rel=0.05)
    assert written.damping.modal_ratio_std == pytest.approx(1e2 * np.std(damped, axis=0), rel=0.05)


def test_what_the_data_say_nothing_of_has_the_largest_deviation_that_a_file_can_have(evidence, baseline):
    information = solved(baseline).information.copy()
    loss = baseline.loss(0)
    information[loss, :] = information[:, loss] = 0.0
    information[loss, loss] = 1e-40 * np.eye(loss.stop - loss.start)
    law = updated_rig(evidence, baseline, replace(solved(baseline), information=information)).joint.law
    assert max(law.loss_std) == LARGEST
    assert max(law.softening_std) < LARGEST


def test_without_sweeps_the_law_is_the_constant_loss(evidence, baseline):
    silent = evidence.without_steps()
    none = replace(baseline, laws=(LayerLaw.zero(baseline.laws[0].opening_knots, baseline.laws[0].slip_knots),))
    law = updated_rig(silent, none, solved(none)).joint.law
    assert law.softening == [0.0, 0.0]
    assert law.loss == pytest.approx([float(baseline.base.G[0] * baseline.base.loss_G[0])] * 2)
    assert law.softening_std[0] == law.softening_std[1]


def test_a_law_that_no_layer_has_is_refused_in_one_line(evidence, baseline):
    law = baseline.laws[0]
    absurd = BaselineParameters(baseline.base, (replace(law, loss=1e9 * law.loss),))
    with pytest.raises(InputError, match="joint joint, law: the fit comes to values that no layer has"):
        updated_rig(evidence, absurd, solved(absurd))
