"""The rule's numbers come back from cases drawn with them, and probabilities are judged as others judge them."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.calibration import calibration_curve

from twin.campaign import CasePlan, CaseResult, calibrate
from twin.campaign.calibration import RuleNumbers, calibration_error
from twin.diagnose.posterior import Weighed

NAMES = ("none", "added-mass", "cubic-stiffness", "viscous-damper", "unknown")


def drawn(seed: int, *, temperature: float, learnable: bool = True) -> CaseResult:
    """A case whose truth is drawn with the probabilities that log evidence has at a temperature."""
    rng = np.random.default_rng([seed, 7])
    evidence = 6.0 * temperature * rng.standard_normal(len(NAMES)) - 50.0
    evidence[-1] -= 1e3
    prior = RuleNumbers()
    hypotheses = [
        Weighed(name, int(name not in ("none", "unknown")), float(e), prior.log_odds_of_a_cause * (name[0] in "acv"))
        for name, e in zip(NAMES, evidence, strict=True)
    ]
    p = RuleNumbers(temperature=temperature).probabilities(hypotheses)
    hidden = str(rng.choice(NAMES, p=p))
    causes = () if hidden == "none" else (hidden,)
    found = {
        "verdict": "explained" if causes else "none",
        "causes": [],
        "model_error": {"inferred": 1e-6 * 2 ** (seed % 3), "sound": 2e-6},
        "hypotheses": [vars(each) for each in hypotheses] if learnable else [],
    }
    return CaseResult(plan=CasePlan(seed, causes), rig="r", hidden=[], found=found, aborted=[], recording_s=0.0)


@pytest.mark.parametrize("temperature", [1.0, 3.0, 12.0])
def test_the_temperature_that_cases_were_drawn_with_is_learnt(temperature):
    found = calibrate([drawn(seed, temperature=temperature) for seed in range(800)])
    assert found.learnt.temperature == pytest.approx(temperature, rel=0.25)
    assert found.learnt_judged.calibration_error < 0.06
    assert found.learnt_judged.in_set_95 > 0.94
    assert found.learnt_from == found.in_use_judged.cases == 400


def test_overstated_evidence_is_seen_on_cases_that_nothing_was_learnt_from():
    found = calibrate([drawn(seed, temperature=12.0) for seed in range(800)])
    assert found.in_use_judged.calibration_error > 2 * found.learnt_judged.calibration_error
    assert found.in_use_judged.in_set_95 < found.learnt_judged.in_set_95


def test_the_calibration_error_is_the_one_of_a_library():
    rng = np.random.default_rng(3)
    p = rng.uniform(0.0, 1.0, 4000)
    right = rng.uniform(0.0, 1.0, 4000) < p**2
    true, mean = calibration_curve(right, p, n_bins=10)
    counts = np.histogram(p, bins=10, range=(0.0, 1.0))[0] / len(p)
    assert calibration_error(p, right) == pytest.approx(float(counts @ np.abs(true - mean)), rel=1e-9)


def test_what_clean_rigs_need_is_their_median_and_spread():
    clean = [case for seed in range(900) if not (case := drawn(seed, temperature=3.0)).plan.causes]
    others = [drawn(seed, temperature=3.0) for seed in range(900, 960)]
    median, factor = calibrate([*clean, *others]).model_error
    assert median == pytest.approx(2e-6)
    assert 1.5 < factor < 2.0


def test_too_few_cases_are_told():
    few = [drawn(seed, temperature=3.0) for seed in range(12)]
    with pytest.raises(ValueError, match=r"6 and 6 cases .* 10 of each"):
        calibrate([*few, drawn(99, temperature=3.0, learnable=False)])
