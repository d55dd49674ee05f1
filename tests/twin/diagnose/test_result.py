"""What result.json says of the probability, of what is excluded, and of what the fit had to allow for."""

import json
from types import SimpleNamespace

from twin.diagnose.exclusion import Exclusion
from twin.diagnose.result import Diagnosis, Misfit
from twin.identify.error_model import SOUND


def test_the_set_the_limits_and_the_model_error_are_as_the_contract_has_them():
    errors = SOUND.with_value("steps", "stiffness", 4.2e-7)
    found = Diagnosis(
        verdict="none", misfit=Misfit(chi2_per_dof=0.9, after=0.9, threshold=2.0, where=()), causes=(), gain=None,
        next_test=None, seconds=1.0, evidence=None, search=SimpleNamespace(model=SimpleNamespace(errors=errors)),
        sweeps=(), held_out=(), set_95=("none", "added-mass + ground-stop"),
        excluded=(
            Exclusion("cubic-stiffness", "stiffness_N_per_m3", 4.1e5, {"position_m": 0.42}),
            Exclusion("channel-gain", "factor", None, {"channel": "acc1"}),
        ),
    )  # fmt: skip
    told = json.loads(json.dumps(found.to_dict()))
    assert told["set_95"] == ["none", "added-mass + ground-stop"]
    assert told["excluded"] == [
        {
            "cause": "cubic-stiffness", "parameter": "stiffness_N_per_m3", "limit_95": 4.1e5,
            "where": {"position_m": 0.42},
        },
        {"cause": "channel-gain", "parameter": "factor", "limit_95": None, "where": {"channel": "acc1"}},
    ]  # fmt: skip
    assert told["model_error"] == {"inferred": 4.2e-7, "sound": SOUND.steps.stiffness}
