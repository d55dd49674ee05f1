"""Identification uses no sample that is spoilt, and says what it found wrong with the recordings."""

from __future__ import annotations

from pathlib import Path

import pytest

import twin
from twin.campaign import CasePlan, record_case
from twin.demo import BROADBAND, SWEEPS
from twin.lab.identified_joint import IdentifiedJoint
from twin.rigs import load_rig

RIG = "steel-lap-joint"


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["clipping", "lost-samples", "mains-hum", "sample-clock"])
def test_a_fault_of_the_samples_is_told_and_moves_no_modulus(tmp_path: Path, fault: str) -> None:
    case, _ = record_case(CasePlan(7, (fault,)), load_rig(RIG), tmp_path)
    model = twin.load_rig(RIG).identify([tmp_path / BROADBAND, tmp_path / SWEEPS])
    assert isinstance(model, IdentifiedJoint)
    true, found = (rig.joint.preload[model.found.preload] for rig in (case.rig, model.found.rig))
    assert found.normal_modulus == pytest.approx(true.normal_modulus, rel=0.01)
    assert found.shear_modulus == pytest.approx(true.shear_modulus, rel=0.01)
    assert any(warning.startswith(f"{fault}: ") for warning in model.warnings)
    # Cut peaks alone once left 12 % of the largest sweep, and a clock a chi2 of 13.
    assert model.found.chi2_per_dof < 1.0
    assert max(model.found.residual_percent.values()) < 0.2
