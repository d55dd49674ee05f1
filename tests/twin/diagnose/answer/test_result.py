"""What result.json says of the probability, of what is excluded, and of what the fit had to allow for."""

import json
from dataclasses import replace
from types import SimpleNamespace

from twin.diagnose.answer.exclusion import Exclusion
from twin.diagnose.answer.result import Diagnosis, Misfit, NamedCause
from twin.identify.residuals.error_model import SOUND

MASS = NamedCause(
    cause="added-mass", summary="a mass sits there", probability=0.6, confused_with=(), parameters={}, in_model=True
)


def test_what_data_cannot_tell_apart_is_said_in_words():
    found = Diagnosis(
        verdict="ambiguous", misfit=Misfit(chi2_per_dof=9.0, after=0.9, threshold=2.0, where=()), causes=(MASS,),
        gain=None, next_test=None, seconds=1.0, evidence=None, search=None, sweeps=(), held_out=(),
        set_95=("added-mass", "unknown"),
    )  # fmt: skip
    assert found.sentence.endswith("these data cannot tell it from something that is on no list.")
    rivals = replace(found, set_95=("added-mass", "sensor-position", "none"))
    assert rivals.sentence.endswith("these data cannot tell it from sensor-position, no cause at all.")


def test_the_set_the_limits_and_the_model_error_are_as_the_contract_has_them():
    errors = replace(SOUND, steps=replace(SOUND.steps, stiffness=4.2e-7))
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
