"""A broadband run is binned without the rig's model: what is wrong with that cannot bend the bins."""

from __future__ import annotations

import numpy as np
import pytest

from recordings import RunWriter, read_run
from twin.bench import open_bench
from twin.demo import BROADBAND, broadband
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.fitted_model import fit_model
from twin.diagnose.models import CAUSES
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.measured_data import gather_data
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.procedures import DirectAcquisition, run_procedure
from twin.rigs import Effect, load_rig

RIG = load_rig("steel-lap-joint")
LINEAR = LayerLaw.zero(np.array([1e-8, 1e-6]), np.array([1e-8, 1e-6]))


@pytest.mark.slow
def test_the_truth_explains_bins_of_a_rig_that_nobody_believed_in(tmp_path):
    """The tip sensor, which weighs 22 g, sits 14 mm from where it is assumed to be: mode 4 lies 4 % off."""
    path = tmp_path / BROADBAND
    moved = Effect(cause="sensor-position", parameters={"channel": "acc2", "offset_m": -0.014})
    acquisition = DirectAcquisition(open_bench(RIG, seed=4, effects=[moved]))
    with RunWriter(path, info={"source": "simulated"}, channels=acquisition.channels) as writer:
        run_procedure(broadband(), acquisition, writer)
    evidence = gather_data([read_run(path)], RIG)
    baseline = BaselineParameters(nominal_parameters(RIG), (LINEAR,))
    label, values = {"channel": "acc2"}, {"offset_m": -0.014, "carried": 1.0}
    found = fit_model(evidence, None, baseline, (CauseHypothesis(CAUSES["sensor-position"], label, values, {}),))
    assert found.chi2_per_dof < 1.5
    assert found.hypotheses[0].values["offset_m"] == pytest.approx(-0.014, abs=5e-5)
