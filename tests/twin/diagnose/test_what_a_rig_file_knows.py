"""A diagnosis is held against all that the rig file says: what it knows already is not found again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from recordings import read_run
from twin.bench import draw_case
from twin.campaign import CasePlan, record_case, record_hidden
from twin.demo import BROADBAND, HELD_OUT, SWEEPS
from twin.diagnose import Diagnosis, diagnose
from twin.diagnose.models import CAUSES, DRIFTS
from twin.rigs import Effect, Rig, load_rig

RIG = load_rig("steel-lap-joint")


def diagnosed(folder: Path, rig: Rig) -> Diagnosis:
    learn = [read_run(folder / name) for name in (BROADBAND, SWEEPS)]
    return diagnose(learn, rig, held_out=[read_run(folder / HELD_OUT)], out=folder / "found")


def with_own_instruments(rig: Rig) -> Rig:
    """Another high-pass in the force cell, an accelerometer on a soft mount, a converter whose clock is off."""
    changed = {"force": {"high_pass": 0.5}, "acc2": {"mounting_frequency": 4000.0, "mounting_damping": 0.05}}
    sensors = [sensor.model_copy(update=changed.get(sensor.channel, {})) for sensor in rig.sensor]
    acquisition = rig.acquisition.model_copy(update={"clock_error_ppm": 400.0})
    return rig.model_copy(update={"sensor": sensors, "acquisition": acquisition})


@pytest.mark.slow
def test_instruments_are_as_the_rig_file_says(tmp_path):
    rig = with_own_instruments(RIG)
    record_case(CasePlan(41, ()), rig, tmp_path)
    found = diagnosed(tmp_path, rig)
    assert found.verdict == "none"
    assert not found.causes
    assert found.misfit.chi2_per_dof < 0.7


@pytest.mark.slow
def test_instruments_that_the_rig_file_does_not_know_are_found(tmp_path):
    """The same recordings against a file without them: otherwise the test above would show nothing."""
    record_case(CasePlan(41, ()), with_own_instruments(RIG), tmp_path)
    found = diagnosed(tmp_path, RIG)
    assert {cause.cause for cause in found.causes} == {"ac-coupling", "mounting-resonance", "sample-clock"}


MASS = Effect(cause="added-mass", parameters={"position_m": 0.35, "mass_kg": 0.01})
GAIN = Effect(cause="channel-gain", parameters={"channel": "acc1", "factor": 1.04})


def hidden(effects: tuple[Effect, ...], folder: Path, *, seed: int) -> None:
    """Record the rig, its moduli, damping and law a little off as ever, with these effects."""
    rng = np.random.default_rng(seed)
    record_hidden(replace(draw_case(rng, rig=RIG, causes=["none"]), effects=effects), RIG, folder, rng=rng)


@pytest.mark.slow
def test_what_is_new_is_found_beside_an_effect_of_the_rig_file(tmp_path):
    hidden((MASS, GAIN), tmp_path, seed=42)
    found = diagnosed(tmp_path, RIG.model_copy(update={"effect": [MASS]}))
    assert [cause.cause for cause in found.causes] == ["channel-gain"]
    assert found.causes[0].parameters["factor"].value == pytest.approx(1.04, abs=0.002)
    assert any("added-mass" in note for note in found.notes)
    extended = load_rig(str(tmp_path / "found" / "extended.toml"))
    assert [effect.cause for effect in extended.effect] == ["added-mass", "channel-gain"]


@pytest.mark.slow
def test_more_of_the_same_is_found_beside_what_is_known(tmp_path):
    """A gain known to be 1.04 that is 1.10: the rest is found, and the model has both."""
    more = GAIN.model_copy(update={"parameters": {"channel": "acc1", "factor": 1.10}})
    hidden((MASS, more), tmp_path, seed=43)
    found = diagnosed(tmp_path, RIG.model_copy(update={"effect": [MASS, GAIN]}))
    assert [cause.cause for cause in found.causes] == ["channel-gain"]
    assert found.causes[0].parameters["factor"].value == pytest.approx(1.10 / 1.04, abs=0.002)


@pytest.mark.nightly
@pytest.mark.parametrize("cause", sorted(set(CAUSES) - {"sample-clock"}))
def test_what_was_found_once_is_not_found_again(tmp_path, cause):
    """The same rig recorded once more, against the model that a first diagnosis extended.

    A clock that is off beside the generator's shows in the samples, is no part of the model, and is found every time.
    """
    case, _ = record_case(CasePlan(5, (cause,)), RIG, tmp_path)
    diagnosed(tmp_path, RIG)
    extended = load_rig(str(tmp_path / "found" / "extended.toml"))
    (later := tmp_path / "later").mkdir()
    record_hidden(case, RIG, later, rng=np.random.default_rng(1005), waits_too=cause in DRIFTS)
    found = diagnosed(later, extended)
    assert found.verdict == "none"
    assert not [named.cause for named in found.causes if named.in_model]
    assert load_rig(str(later / "found" / "extended.toml")).effect == extended.effect
