"""Rivals fitted with less and less slack."""

import pytest

from recordings import read_run
from twin.diagnose.candidate import Blame
from twin.diagnose.models import CAUSES
from twin.diagnose.tournament import tournament
from twin.identify.base_fit import fit_base
from twin.identify.evidence import gather_evidence
from twin.identify.unknowns import TIGHT
from twin.rigs import load_rig


@pytest.fixture(scope="module")
def swept(campaign):
    """Sweeps about one resonance, without a broadband run that would hold the moduli."""
    evidence = gather_evidence([read_run(campaign / "sweeps.mcap")], load_rig("steel-lap-joint"))
    return evidence, *fit_base(evidence)


@pytest.mark.parametrize("factor", [0.96, pytest.param(1.04, marks=pytest.mark.slow)])
def test_a_cause_that_begins_far_too_strong_comes_back(swept, factor):
    """Two per cent of its frequency are four widths of the resonance, and a tight fit alone ends nowhere."""
    evidence, unknowns, solution = swept
    blame = Blame(CAUSES["beam-modulus"], {"beam": "lower"}, {"factor": factor}, {})
    best = tournament(evidence, None, unknowns, [(blame,)], TIGHT, lambda text: None)[0]
    assert best.chi2_per_dof < 1.5 * max(1.0, solution.chi2 / len(solution.residual))
