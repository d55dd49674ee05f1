"""An effect is hidden on the bench, behind instruments and a recording; the diagnosis must find it from these alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from recordings import read_run
from twin.bench import FIRST_CAUSES
from twin.campaign import CasePlan, record_case
from twin.demo import BROADBAND, HELD_OUT, SWEEPS
from twin.diagnose import Diagnosis, diagnose
from twin.rigs import load_rig

RIG = "steel-lap-joint"
PLACES = ("position_m", "gap_m", "slip_force_N", "stiffness_N_per_m3")
"""What two accelerometers and one force determine only roughly, or together with another parameter."""


def hide_and_diagnose(folder: Path, cause: str, seed: int) -> tuple[dict[str, float | str], Diagnosis]:
    """The hidden parameters, and what the diagnosis makes of the recordings."""
    nominal = load_rig(RIG)
    case, _ = record_case(CasePlan(seed, () if cause == "none" else (cause,)), nominal, folder)
    found = diagnose(
        [read_run(folder / name) for name in (BROADBAND, SWEEPS)],
        nominal,
        held_out=[read_run(folder / HELD_OUT)],
        out=folder / "found",
    )
    hidden: dict[str, float | str] = {}
    for effect in case.effects:
        hidden.update(effect.parameters)
    return hidden, found


def check(cause: str, hidden: dict[str, float | str], found: Diagnosis, folder: Path) -> None:
    """The cause is named first with its parameters, the gain is real, and the extended model is a rig."""
    assert found.verdict in ("explained", "ambiguous")
    named = found.causes[0]
    assert named.cause == cause
    for name, value in hidden.items():
        estimate = named.parameters[name]
        if isinstance(estimate, str) or isinstance(value, str):
            assert estimate == value
        elif name not in PLACES:
            departure = abs(estimate.value - value)
            # A factor's effect is its distance from one.
            size = abs(value - 1) if name.endswith("factor") else abs(value)
            assert departure <= 0.25 * size + 4 * estimate.std
    assert found.gain is not None
    # What acceptance asks at normal strength.
    assert found.gain.after < found.gain.before / 5
    assert [effect.cause for effect in load_rig(str(folder / "found" / "extended.toml")).effect] == [cause]


@pytest.mark.slow
@pytest.mark.parametrize(("cause", "seed"), [("added-mass", 11), ("joint-slap", 12)])
def test_a_hidden_effect_is_named(tmp_path, cause, seed):
    check(cause, *hide_and_diagnose(tmp_path, cause, seed), tmp_path)


@pytest.fixture(scope="module")
def soft_joint(tmp_path_factory):
    """The moduli would follow it, at eight standard deviations: nothing but their prior speaks for a cause."""
    return hide_and_diagnose(tmp_path_factory.mktemp("soft-joint"), "joint-stiffness", 1901)


@pytest.mark.slow
def test_a_soft_joint_is_named_though_the_moduli_alone_could_follow_it(soft_joint):
    hidden, found = soft_joint
    assert found.verdict == "explained"
    assert found.causes[0].cause == "joint-stiffness"
    for name, value in hidden.items():
        # Nobody knows the moduli that the factors count from better than within ten per cent.
        assert abs(found.causes[0].parameters[name].value / value - 1) < 0.25


@pytest.mark.slow
def test_a_soft_joint_is_known_as_well_as_the_moduli_are_beforehand(soft_joint):
    hidden, found = soft_joint
    for name in hidden:
        estimate = found.causes[0].parameters[name]
        assert 0.03 < estimate.std / estimate.value < 0.1


@pytest.mark.slow
def test_a_clean_rig_has_nothing_wrong(tmp_path):
    _, found = hide_and_diagnose(tmp_path, "none", 13)
    assert found.verdict == "none"
    assert not [cause for cause in found.causes if cause.in_model]
    assert found.misfit.chi2_per_dof < found.misfit.threshold
    assert found.gain is not None
    # Nothing but noise is left on a sweep that was not learnt from.
    assert found.gain.after < 2 * found.gain.noise_floor


@pytest.mark.nightly
@pytest.mark.parametrize("seed", np.arange(201, 204).tolist())
@pytest.mark.parametrize("cause", FIRST_CAUSES)
def test_every_first_cause_is_named_whatever_its_size(tmp_path, cause, seed):
    check(cause, *hide_and_diagnose(tmp_path, cause, seed), tmp_path)


@pytest.mark.nightly
def test_a_cause_that_was_found_is_not_lost_when_the_search_begins_again(tmp_path):
    """The moduli alone have a better minimum than the search began from, and no slope there towards this drift."""
    check("temperature-drift", *hide_and_diagnose(tmp_path, "temperature-drift", 2616), tmp_path)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [2609, 2611, 2616])
def test_dry_friction_stands_alone(tmp_path, seed):
    """Noise that slips at times and sticks at others is the friction's doing, not a damper's nor a high-pass's."""
    check("ground-friction", *hide_and_diagnose(tmp_path, "ground-friction", seed), tmp_path)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", np.arange(211, 215).tolist())
def test_clean_rigs_stay_clean(tmp_path, seed):
    assert hide_and_diagnose(tmp_path, "none", seed)[1].verdict == "none"
