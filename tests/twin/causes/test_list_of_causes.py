"""The list of causes: names and parameters as the recording contract fixes them, and no effect at their null."""

from __future__ import annotations

import numpy as np
import pytest
from contract_causes import CONTRACT, SEEN_IN_SAMPLES

from recordings.errors import InputError
from twin.bench import draw_case
from twin.diagnose.cause import strengths_of
from twin.diagnose.effects import acting_effects
from twin.diagnose.fit_problem import modification_of
from twin.diagnose.models import CAUSES
from twin.identify.model_modification import ModelModification
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.residual_model import ResidualModel
from twin.rigs import Effect

MODELLED = {name: parameters for name, parameters in CONTRACT.items() if name not in SEEN_IN_SAMPLES}

CHOSEN = {"joint-friction": {"layer_element"}}
"""Names beside the contract's first version, without which the bench takes one for itself."""


@pytest.fixture(scope="module")
def evidence(by_hand, dense, omega):
    """Amplitudes at which every nonlinear cause would act, and some of each higher harmonic."""
    response = dense.response(omega)
    force = 5e-4 * np.minimum(omega, omega[len(omega) // 4])[:, None] ** 2 / np.abs(response[:, 1:2])
    rng = np.random.default_rng(8)
    size = 1e-3 * np.abs(response * force)[:, :, None]
    higher = size * (rng.standard_normal((*response.shape, 6)) + 1j * rng.standard_normal((*response.shape, 6)))
    return by_hand.evidence(omega, response, force=force[:, 0], with_harmonics=higher)


def values_of(parameters):
    """Strengths at their null, places where a search begins."""
    return {p.name: (p.starts[0] if p.is_location else p.null) for p in parameters}


def every(evidence):
    """Every cause with every label."""
    return [(cause, label) for cause in CAUSES.values() for label in cause.labels(evidence)]


def test_the_list_is_the_contracts():
    assert set(CAUSES) == set(MODELLED)
    assert all(cause.name == name for name, cause in CAUSES.items())


def test_reports_have_the_contracts_parameters_and_no_others(evidence):
    for cause, label in every(evidence):
        values = values_of(cause.parameters(evidence, label))
        reported, std = cause.reported(values, dict.fromkeys(values, 1.0))
        assert set(reported) == set(std), cause.name
        names = MODELLED[cause.name] | CHOSEN.get(cause.name, set())
        assert set(reported) | set(label) == names, cause.name


def test_what_is_reported_is_enough_to_rebuild_the_effect(evidence):
    """A rig file carries the contract's parameters; the forward model takes the search's."""
    for cause, label in every(evidence):
        parameters = cause.parameters(evidence, label)
        reported, _ = cause.reported({p.name: p.starts[0] for p in parameters}, {})
        rebuilt = cause.from_reported(reported)
        assert set(rebuilt) == {p.name for p in parameters}, cause.name
        assert cause.reported(rebuilt, {})[0] == pytest.approx(reported), cause.name


@pytest.mark.parametrize("name", sorted(CAUSES))
def test_an_effect_in_a_rig_file_acts_in_the_forward_model(evidence, name):
    """Whatever the bench can hide under a contract's name, the model's extension takes from a rig file."""
    case = draw_case(np.random.default_rng(7), rig=evidence.rig, causes=[name])
    modification = modification_of(evidence, acting_effects(evidence, case.effects))
    assert modification != ModelModification()


@pytest.mark.parametrize(("given", "meant"), [({}, "3"), ({"layer_element": 1}, "1"), ({"layer_element": "2"}, "2")])
def test_a_slider_of_another_programs_rig_file_sits_in_the_element_it_names_or_in_the_last(evidence, given, meant):
    effect = Effect(cause="joint-friction", parameters={"stiffness_N_per_m": 1e8, "slip_force_N": 100.0, **given})
    (hypothesis,) = acting_effects(evidence, [effect])
    assert hypothesis.label == {"layer_element": meant}
    assert hypothesis.cause.reported(hypothesis.values, {})[0] == pytest.approx(
        {"stiffness_N_per_m": 1e8, "slip_force_N": 100.0}
    )


def test_a_slider_in_an_element_that_is_not_there_is_refused(evidence):
    effect = Effect(
        cause="joint-friction", parameters={"stiffness_N_per_m": 1e8, "slip_force_N": 100.0, "layer_element": 4}
    )
    with pytest.raises(InputError, match="not one of its choices"):
        acting_effects(evidence, [effect])


def test_parameters_begin_inside_their_limits(evidence):
    for cause, label in every(evidence):
        for p in cause.parameters(evidence, label):
            assert p.lower < p.upper, (cause.name, p.name)
            assert p.scale > 0
            assert p.starts, (cause.name, p.name)
            assert all(p.lower <= start <= p.upper for start in p.starts), (cause.name, p.name)
            if not p.is_location:
                assert p.lower <= p.null <= p.upper, (cause.name, p.name)


def test_extensions_that_remake_the_structure_say_so(evidence):
    """Fits take their differences over longer steps there."""
    for cause, label in every(evidence):
        values = {p.name: p.starts[0] for p in cause.parameters(evidence, label)}
        modification = cause.modification(evidence, label, values)
        nominal, extended = (ResidualModel(evidence, e).model.structure for e in (None, modification))
        parts = ((s.M, s.K0, s.joints[0].B_E, s.joints[0].B_G) for s in (nominal, extended))
        same = (np.array_equal(one, other) for one, other in zip(*parts, strict=True))
        assert modification.changes_structure != all(same), cause.name


def test_every_cause_but_a_sign_has_a_strength_that_may_vanish(evidence):
    without = {
        cause.name for cause, label in every(evidence) if all(p.is_location for p in cause.parameters(evidence, label))
    }
    assert without == {"channel-polarity"}


def test_a_slip_force_is_stiffness_times_the_displacement_at_which_it_slips():
    values, std = {"stiffness_N_per_m": 3e6, "slip_m": 2e-7}, {"stiffness_N_per_m": 3e5, "slip_m": 1e-8}
    reported, errors = CAUSES["joint-friction"].reported(values, std)
    assert reported == pytest.approx({"stiffness_N_per_m": 3e6, "slip_force_N": 0.6})
    draws = np.random.default_rng(3).standard_normal((2, 200_000))
    drawn = (3e6 + 3e5 * draws[0]) * (2e-7 + 1e-8 * draws[1])
    assert errors["slip_force_N"] == pytest.approx(np.std(drawn), rel=0.02)


@pytest.fixture(scope="module")
def harmonics(evidence, baseline):
    return harmonic_residuals(ResidualModel(evidence), baseline)


@pytest.fixture(scope="module")
def change(evidence, harmonics, baseline):
    """Largest change of any residual, in standard deviations, that a cause makes with its values."""
    before = ResidualModel(evidence, None, harmonics).evaluate(baseline, sensitivities=False).residual

    def change(cause, label, values):
        residual_model = ResidualModel(evidence, cause.modification(evidence, label, values), harmonics)
        return np.max(np.abs(residual_model.evaluate(baseline, sensitivities=False).residual - before))

    return change


APART = ("channel-polarity", "transverse-shear")
"""A sign has no strength; Timoshenko's elements have rotary inertia however stiff they are in shear."""


@pytest.mark.parametrize("name", [name for name in CAUSES if name not in APART])
def test_a_cause_of_no_strength_changes_nothing(evidence, change, name):
    """Or a small part of what a sound rig is allowed, where limits keep the null off nothing at all."""
    cause = CAUSES[name]
    for label in cause.labels(evidence):
        parameters = cause.parameters(evidence, label)
        null = change(cause, label, values_of(parameters))
        begun = change(cause, label, {p.name: p.starts[0] for p in parameters})
        main = strengths_of(parameters)[0]
        allowed = change(cause, label, {**values_of(parameters), main.name: main.null + main.tolerance * main.scale})
        assert null < (0.1 * allowed if name == "clamp-compliance" else 1e-9)
        # Where a search begins there is an effect.
        assert begun > max(1e-3, 100 * null)


@pytest.mark.parametrize("beam", ["lower", "upper"])
def test_a_beam_stiff_in_shear_keeps_its_rotary_inertia(evidence, beam):
    """Rayleigh's correction of the frequencies, in part of what shear does where a search begins."""
    cause = CAUSES["transverse-shear"]
    modifications = [cause.modification(evidence, {"beam": beam}, {"modulus_ratio": ratio}) for ratio in (1e-3, 10.0)]
    nominal, rayleigh, timoshenko = (ResidualModel(evidence, e).model.basis.omega[:4] for e in (None, *modifications))
    assert np.all(rayleigh < nominal)
    assert np.all(nominal - rayleigh < 0.25 * (nominal - timoshenko))
