"""A broadband run that was binned against a wrong model is binned anew against the right one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from recordings import RunWriter, read_run
from twin.bench import open_bench
from twin.demo import BROADBAND, broadband
from twin.diagnose.fitted_model import CauseHypothesis, fit_model, modification_of
from twin.diagnose.models import CAUSES
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.measured_data import gather_data
from twin.identify.model_modification import ModelModification
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.residuals.rebinning import rebinned
from twin.procedures import DirectAcquisition, run_procedure
from twin.rigs import Effect, load_rig

RIG = load_rig("steel-lap-joint")
LINEAR = LayerLaw.zero(np.array([1e-8, 1e-6]), np.array([1e-8, 1e-6]))


@pytest.fixture(scope="module")
def evidence(tmp_path_factory):
    """Of a rig whose tip sensor, which weighs 22 g, sits 14 mm from where it is assumed to be."""
    path = tmp_path_factory.mktemp("run") / BROADBAND
    moved = Effect(cause="sensor-position", parameters={"channel": "acc2", "offset_m": -0.014})
    acquisition = DirectAcquisition(open_bench(RIG, seed=4, effects=[moved]))
    with RunWriter(path, info={"source": "simulated"}, channels=acquisition.channels) as writer:
        run_procedure(broadband(), acquisition, writer)
    return gather_data([read_run(path)], RIG)


@pytest.mark.slow
def test_bins_that_a_wrong_reference_bent_come_straight(evidence):
    baseline = BaselineParameters(nominal_parameters(RIG), (LINEAR,))
    label, values = {"channel": "acc2"}, {"offset_m": -0.014, "carried": 1.0}
    hypotheses = (CauseHypothesis(CAUSES["sensor-position"], label, values, {}),)
    bent = fit_model(evidence, None, baseline, hypotheses)
    anew = rebinned(evidence, modification_of(evidence, bent.hypotheses), bent.baseline)
    straight = fit_model(anew, None, bent.baseline, bent.hypotheses)
    assert bent.chi2_per_dof > 10
    assert straight.chi2_per_dof < 1.5
    assert straight.hypotheses[0].values["offset_m"] == pytest.approx(-0.014, abs=5e-5)
    # What is seen of each run stays: its noise, and the force's power.
    for old, new in zip(evidence.broadband, anew.broadband, strict=True):
        assert new.force_power.sum() == pytest.approx(old.force_power.sum(), rel=0.05)
        assert new.noise_density["force"] < 2 * old.noise_density["force"]


@pytest.mark.slow
def test_bins_of_a_right_model_stay(evidence):
    """Against its own reference a sound run's bins do not move beyond their noise."""
    baseline = BaselineParameters(nominal_parameters(RIG), (LINEAR,))
    label, values = {"channel": "acc2"}, {"offset_m": -0.014, "carried": 1.0}
    model = fit_model(evidence, None, baseline, (CauseHypothesis(CAUSES["sensor-position"], label, values, {}),))
    for _ in range(2):
        evidence = rebinned(evidence, modification_of(evidence, model.hypotheses), model.baseline)
        model = fit_model(evidence, None, model.baseline, model.hypotheses)
    again = rebinned(evidence, modification_of(evidence, model.hypotheses), model.baseline)
    moved = fit_model(replace(evidence, broadband=again.broadband), None, model.baseline, model.hypotheses)
    assert abs(moved.chi2_per_dof - model.chi2_per_dof) < 0.1


def test_what_a_right_model_explains_it_explains_anew(campaign):
    """The decays of the record's ends have the model's own poles, or they stay in the sharpest resonance's bins."""
    evidence = gather_data([read_run(campaign / "random.mcap")], RIG)
    baseline = BaselineParameters(nominal_parameters(RIG), (LINEAR,))
    before = fit_model(evidence, None, baseline, ())
    after = fit_model(rebinned(evidence, ModelModification(), before.baseline), None, before.baseline, ())
    assert after.chi2_per_dof == pytest.approx(before.chi2_per_dof, rel=0.05)
    assert after.baseline.base.zeta[0] == pytest.approx(before.baseline.base.zeta[0], rel=0.01)
