"""The terms a missing force may be made of have their textbook describing functions; the picture tells their place."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.missing import FittedTerm, ForceAtLevel, MissingForce
from twin.diagnose.missing.force import (
    LocalForce,
    force_harmonics,
    law_of,
    linear_substitute,
    named_law,
    peak_and_fundamental,
)
from twin.diagnose.missing.terms import TERMS
from twin.identify.estimate import Estimate
from twin.rigs import load_rig

A, OMEGA = np.array([2e-3, 5e-3]), np.array([160.0, 170.0])

# Fundamental of each at coefficient one, by hand.
FUNDAMENTAL = {
    "spring": A,
    "one-sided spring": 0 * A,
    "stiffening spring": 8 / (3 * np.pi) * A**2,
    "cubic spring": 3 / 4 * A**3,
    "quintic spring": 5 / 8 * A**5,
    "dry friction": 4j / np.pi + 0 * A,
    "dashpot": 1j * OMEGA * A,
    "drag": 8j / (3 * np.pi) * (OMEGA * A) ** 2,
    "cubic damper": 3j / 4 * (OMEGA * A) ** 3,
    "mass": -(OMEGA**2) * A,
}


@pytest.mark.parametrize("name", TERMS)
def test_fundamentals_are_the_textbook_ones(name):
    found = force_harmonics(TERMS[name].force, A, OMEGA, 1)[:, 0]
    size = np.array([TERMS[name].size(a, w) for a, w in zip(A, OMEGA, strict=True)])
    # A jump within the period costs the quadrature of 96 points a few ten thousandths.
    assert np.all(np.abs(found - FUNDAMENTAL[name]) < 5e-4 * size)


def test_a_one_sided_spring_shows_in_the_second_harmonic_alone():
    found = force_harmonics(TERMS["one-sided spring"].force, A, OMEGA, 7)
    assert found[:, 1] == pytest.approx(A**2 / 2)
    assert np.abs(np.delete(found, 1, axis=1)).max() < 1e-12 * A.max()


def test_a_cubic_spring_has_a_quarter_of_its_force_in_the_third_harmonic():
    assert force_harmonics(TERMS["cubic spring"].force, A, OMEGA, 3)[:, 2] == pytest.approx(A**3 / 4)


@pytest.mark.parametrize("name", TERMS)
def test_linear_substitutes_are_those_of_gaussian_motion(name):
    """By adaptive quadrature of the Gaussian density instead of Hermite's nodes."""
    sigma_u, sigma_v, omega = 2e-4, 0.05, np.array([100.0, 400.0])
    force = TERMS[name].force

    def mean(f, sigma):
        return quad(lambda x: f(x) * norm.pdf(x, scale=sigma), -8 * sigma, 8 * sigma, points=[0.0])[0]

    k = mean(lambda u: u * float(force(u, 0.0, 0.0)), sigma_u) / sigma_u**2
    c = mean(lambda v: v * float(force(0.0, v, 0.0)), sigma_v) / sigma_v**2
    m = float(force(0.0, 0.0, 1.0))
    expected = k + 1j * omega * c - omega**2 * m
    # Hermite's nodes know a jump at rest only to a per cent or two.
    assert linear_substitute(force, sigma_u, sigma_v, omega) == pytest.approx(expected, rel=0.03, abs=1e-9)


def test_a_law_of_several_terms_is_their_sum():
    terms = TERMS["cubic spring"], TERMS["dashpot"]
    label = {"law": named_law(terms)}
    assert law_of(label) == terms
    values = {"cubic spring": 3e6, "dashpot": 0.2, "position_m": 0.3}
    peak, fundamental = peak_and_fundamental(CauseHypothesis(LocalForce(), label, values, {}), A, OMEGA)
    assert fundamental == pytest.approx(3e6 * 0.75 * A**3 + 0.2j * OMEGA * A)
    assert np.all(peak >= np.abs(fundamental) * 0.9)


def test_the_picture_is_json_and_says_its_formula():
    terms = (
        FittedTerm(term=TERMS["cubic spring"], coefficient=Estimate(2e6, 1e5)),
        FittedTerm(term=TERMS["dashpot"], coefficient=Estimate(0.1, 0.02)),
    )
    level = ForceAtLevel(sweep="3N", frequency_Hz=26.0, displacement_m=2e-3, force_N=0.02, phase_deg=None)
    force = MissingForce(
        places_m=np.array([0.1, 0.4]), left=np.array([3.0, 1.0]), position_m=Estimate(0.4, 0.01), terms=terms,
        levels=(level,), before=8.0, after=0.9,
    )  # fmt: skip
    assert force.formula == "c u³ + c v"
    assert force.explains
    assert not replace(force, before=1400.0, after=320.0).explains
    assert replace(force, before=1400.0, after=40.0).explains
    assert force.force(np.array(1e-3), np.array(0.1), np.array(0.0)) == pytest.approx(2e6 * 1e-9 + 0.1 * 0.1)
    told = json.loads(json.dumps(force.to_dict()))
    assert told["along"][1] == {"position_m": 0.4, "chi2_per_dof": 1.0}
    assert told["terms"][1]["unit"] == "N_s_per_m"


def test_every_term_has_a_coefficient_of_a_believable_size():
    """Each makes a newton or two at the tip, whatever its power."""
    evidence = SimpleNamespace(
        steps=SimpleNamespace(amplitude_m=np.array([3e-3])), rig=load_rig("steel-lap-joint"), reference_omega=165.0
    )
    cause = LocalForce()
    for label in cause.labels(evidence):
        (coefficient, _) = cause.parameters(evidence, label)
        term = TERMS[coefficient.name]
        assert coefficient.scale * term.size(3e-3, 165.0) == pytest.approx(2.0)
