"""No answer hangs on the last bit: other kernels of linear algebra, other rounding, one process or two."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from short_campaign import record_campaign

from twin.rigs import Effect

SCRIPT = Path(__file__).parents[2] / "helpers" / "diagnose_perturbed.py"
HIDDEN = {
    "nothing": (),
    "mass": (Effect(cause="added-mass", parameters={"position_m": 0.3, "mass_kg": 0.004}),),
    "friction": (
        Effect(
            cause="joint-friction",
            parameters={"layer_element": "2", "stiffness_N_per_m": 1.5e8, "slip_force_N": 70.0},
        ),
    ),
}
PERTURBED = {
    "rounding, one process": ({}, 1e-12, 1),
    "Haswell": ({"OPENBLAS_CORETYPE": "Haswell"}, 0.0, 2),
    "Nehalem": ({"OPENBLAS_CORETYPE": "Nehalem"}, 0.0, 2),
}


def answer(folder: Path, environment: dict[str, str], noise: float, processes: int) -> dict:
    command = [sys.executable, str(SCRIPT), str(folder), str(noise), str(processes)]
    done = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
@pytest.mark.parametrize("hidden", HIDDEN)
def test_the_same_data_have_the_same_answer(tmp_path, true_rig, hidden):
    record_campaign(tmp_path, true_rig, effects=HIDDEN[hidden])
    plain = answer(tmp_path, {}, 0.0, 2)
    assert list(plain["causes"]) == [effect.cause for effect in HIDDEN[hidden]]
    for how in PERTURBED:
        other = answer(tmp_path, *PERTURBED[how])
        assert other["verdict"] == plain["verdict"], how
        assert list(other["causes"]) == list(plain["causes"]), how
        assert other["chi2"] == pytest.approx(plain["chi2"], rel=0.01), how
        for cause, parameters in plain["causes"].items():
            for name, (value, std) in parameters.items():
                assert abs(other["causes"][cause][name][0] - value) < 0.1 * std, (how, name)
