"""The composite beam's hammer test: shear found by evidence, and what the printed moduli contradict."""

import numpy as np
import pytest

from studies.composite_beam import composite_frequencies, reproduce_composite_beam
from studies.tables import load_study


@pytest.fixture(scope="module")
def result():
    return reproduce_composite_beam()


def test_transverse_shear_is_the_cause_and_cuts_the_error_threefold(result):
    assert [cause["cause"] for cause in result.causes] == ["transverse-shear"]
    assert result.rms_percent["euler_bernoulli"] > 3 * result.rms_percent["this_model"]
    assert result.rms_percent["published_model"] > 3 * result.rms_percent["this_model"]
    assert result.free_parameters == 2
    ranking = sorted((c for c in result.candidates if c.free_parameters < 4), key=lambda c: c.bic)
    assert ranking[0].cause == "transverse-shear"
    assert {c.cause for c in ranking} == {"none", "transverse-shear", "added-mass", "thickness"}


def test_euler_bernoulli_leaves_a_pattern_that_falls_with_the_mode_and_shear_does_not(result):
    pattern = result.error_percent["euler_bernoulli"]["free"]
    assert np.all(np.diff(pattern) < 0)
    assert not np.all(np.diff(result.error_percent["this_model"]["free"]) < 0)


def test_stated_size_and_density_with_the_printed_modulus_contradict_the_printed_frequency():
    """First mode of a free beam from the textbook: 4.73004^2 / (2 pi L^2) sqrt(E h^2 / (12 rho))."""
    study = load_study("composite-beam")
    textbook = 4.730040744862704**2 / (2 * np.pi * 0.353**2) * np.sqrt(25e9 * 0.00885**2 / (12 * 1200.0))
    found = composite_frequencies(study, youngs_modulus=25e9)[0]
    assert found == pytest.approx(textbook, rel=1e-5)
    assert found == pytest.approx(333.2, abs=0.1)
    assert study.condition["free, before updating"].published_model[0] == 212.8


def test_modulus_from_size_and_density_is_far_below_all_three_printed_ones(result):
    modulus = result.details["modulus"]
    entry = result.parameters["youngs_modulus"]
    assert entry["value"] == pytest.approx(14.4e9, rel=0.03)
    assert all(entry["value"] + 10 * entry["std"] < E for E in modulus["printed_Pa"].values())
    assert modulus["density_needed_by_printed"]["before"] == pytest.approx(1200 * 25e9 / entry["value"])
    assert all("cannot confirm" in note or note in load_study("composite-beam").note for note in result.notes)


def test_shear_modulus_of_the_laminate_is_a_plausible_one(result):
    """Through-thickness shear of carbon and epoxy lies between about 1 and 6 GPa."""
    assert 0.8e9 < result.details["shear_modulus_Pa"] < 6e9
