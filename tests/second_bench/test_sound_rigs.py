"""A sound rig of the second bench is one that the tool can identify: else its answers would judge the bench."""

import json
import subprocess
import sys

import pytest

from tests.second_bench.campaign import BROADBAND, Case, record, recording_names

LEFT_percent = 0.1
"""Residual of a sweep; seed 1 leaves 0.04."""
LEFT_chi2 = 4.0
"""Per degree of freedom; seed 1 leaves 2.4, most of it in the noise run, where friction stiffens a slipping layer."""


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [1, 2])
def test_a_sound_rig_whose_resonances_stay_is_identified(tmp_path, seed):
    folder = record(Case("none", seed, still=True), tmp_path)
    truth = json.loads((folder / "truth.json").read_text())
    runs = [str(folder / name) for name in (BROADBAND, recording_names(1)[0])]
    model = str(tmp_path / "model.toml")
    done = subprocess.run(
        [sys.executable, "-m", "twin", "identify", *runs, "--rig", str(folder / "rig.toml"), "--out", model, "--json"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    found = json.loads(done.stdout)
    assert max(found["residual_percent"].values()) < LEFT_percent
    assert found["chi2_per_dof"] < LEFT_chi2
    assert found["linear"]["normal_modulus"]["value"] == pytest.approx(truth["layer"]["normal_modulus"], rel=0.05)
    assert found["linear"]["modal_damping"][0]["value"] == pytest.approx(truth["modal_ratio"][0], rel=0.02)
