"""Rivals fitted with less and less discrepancy."""

import pytest

from recordings import read_run
from twin.diagnose.fitted_model import CauseHypothesis
from twin.diagnose.models import CAUSES
from twin.diagnose.successive_halving import successive_halving
from twin.identify.base_fit import fit_base
from twin.identify.baseline_parameters import TIGHT
from twin.identify.measured_data import gather_data
from twin.rigs import load_rig


@pytest.fixture(scope="module")
def swept(campaign):
    """Sweeps about one resonance, without a broadband run that would hold the moduli."""
    evidence = gather_data([read_run(campaign / "sweeps.mcap")], load_rig("steel-lap-joint"))
    return evidence, *fit_base(evidence)


@pytest.mark.parametrize("factor", [0.96, pytest.param(1.04, marks=pytest.mark.slow)])
def test_a_cause_that_begins_far_too_strong_comes_back(swept, factor):
    """Two per cent of its frequency are four widths of the resonance, and a tight fit alone ends nowhere."""
    evidence, baseline, solution = swept
    hypothesis = CauseHypothesis(CAUSES["beam-modulus"], {"beam": "lower"}, {"factor": factor}, {})
    best = successive_halving(evidence, None, baseline, [(hypothesis,)], TIGHT, lambda text: None)[0]
    assert best.chi2_per_dof < 1.5 * max(1.0, solution.chi2 / len(solution.residual))
