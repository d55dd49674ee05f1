"""Reports of identifications: what was true of the rig is in them, with how well it is known."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from recordings import InputError
from twin.identify.estimate import Estimate
from twin.identify.linear.linear_fit import MODULI_STD
from twin.lab import load_rig
from twin.lab.identified_joint import IdentifiedJoint
from twin.lab.identified_mode import IdentifiedMode
from twin.lab.identified_moduli import IdentifiedModuli
from twin.views import page as pages
from twin.views.reports.identified import determined, file_law_bands, law_table

BRAKE_REUSS = Path(__file__).parents[2] / "data" / "brake-reuss" / "response_control.csv"


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of few pixels, where nobody looks at them."""
    monkeypatch.setattr(pages, "DPI", 30)


def text_of(path: Path) -> str:
    """What a reader sees: tags and pictures left out."""
    body = re.sub(r"<style>.*?</style>", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    return " ".join(re.sub(r"<[^>]*>", " ", body).split())


def test_the_truth_is_within_what_the_report_says(identified: IdentifiedJoint) -> None:
    nominal = identified.evidence.rig.joint.preload[identified.found.preload]
    rows = {row.name: row for row in determined(identified.found, identified.evidence)}
    for name, true in (
        ("normal modulus E′", 1e-6 * nominal.normal_modulus), ("shear modulus G′", 1e-6 * nominal.shear_modulus)
    ):  # fmt: skip
        estimate = rows[name].estimate
        assert abs(estimate.value - true) < 3 * estimate.std
        assert estimate.std < 0.02 * true


def test_what_the_data_do_not_tell_is_called_believed(identified: IdentifiedJoint) -> None:
    """The sweeps go through mode 1; modes 4 and 5, at 887 and 1013 Hz, lie above the band of 20 to 500 Hz."""
    rows = {row.name: row for row in determined(identified.found, identified.evidence)}
    assert not rows["damping ratio of mode 1"].little
    assert rows["damping ratio of mode 4"].little
    assert rows["damping ratio of mode 5"].little


def test_a_parameter_is_narrowed_by_the_ratio_of_its_spreads(identified: IdentifiedJoint) -> None:
    found = identified.found
    wide = {**found.linear, "normal_modulus": Estimate(3.9e8, MODULI_STD * 3.9e8)}  # as it was assumed
    row = determined(replace(found, linear=wide), identified.evidence)[0]
    assert row.narrowed == pytest.approx(1.0)
    assert row.little


def test_correlations_are_those_of_the_covariance(identified: IdentifiedJoint) -> None:
    row = determined(identified.found, identified.evidence)[0]
    C = identified.found.solution.covariance
    assert row.partner == "shear modulus G′"
    assert row.correlation == pytest.approx(C[0, 1] / np.sqrt(C[0, 0] * C[1, 1]))


@pytest.mark.usefixtures("coarse")
def test_the_report_holds_law_residuals_and_regularisation(identified: IdentifiedJoint, tmp_path: Path) -> None:
    identified.report(tmp_path / "report.html", commands=["twin identify random.mcap --rig mine.toml"])
    text = text_of(tmp_path / "report.html")
    found = identified.found
    assert identified.sentence in text
    assert found.polynomials is not None
    curve = found.polynomials.together.l_curve
    assert f"corner is at λ = {curve.corner:.2g}" in text
    assert f"least at λ = {curve.cross_validated:.2g}" in text
    assert all(f"{sweep} {percent:.3f} %" in text for sweep, percent in found.residual_percent.items())
    assert "twin identify random.mcap --rig mine.toml" in text
    assert (tmp_path / "report.html").read_text().count("<img") == 6


def test_the_law_is_told_in_numbers_as_far_as_the_layer_moved(identified: IdentifiedJoint) -> None:
    softening, loss = file_law_bands(identified.found, identified.evidence)
    table, law = law_table(softening, loss), identified.found.baseline.laws[0]
    largest = (softening.reach_m[1], loss.reach_m[1])
    opening, s, slip, lost = table.rows[-1]
    assert (float(opening), float(slip)) == pytest.approx([1e6 * amplitude for amplitude in largest], rel=5e-3)
    base = identified.found.baseline.base
    for text, value in (
        (s, law.softening_at(largest[0])), (lost, base.G * base.loss_G + law.loss_at(largest[1]))
    ):  # fmt: skip
        shown, std = (float(part) for part in text.split(" ± "))
        assert abs(shown - 1e-6 * value) < 0.2 * std


@pytest.mark.usefixtures("coarse")
def test_a_model_that_misses_something_says_so_first(identified: IdentifiedJoint, tmp_path: Path) -> None:
    poor = replace(identified, found=replace(identified.found, chi2_per_dof=7.3))
    poor.report(tmp_path / "report.html")
    text = text_of(tmp_path / "report.html")
    assert "Identification of a bolted joint The model misses something: chi² per degree of freedom is 7.3" in text


@pytest.mark.usefixtures("coarse")
def test_moduli_that_the_frequencies_leave_open_are_told(tmp_path: Path) -> None:
    """Two frequencies of low modes hardly feel the shear modulus."""
    table = tmp_path / "frequencies.csv"
    table.write_text("mode,frequency_Hz\n1,26.50\n2,157.60\n")
    found = load_rig("steel-lap-joint").identify(table, preload="120N")
    assert isinstance(found, IdentifiedModuli)
    found.report(tmp_path / "report.html")
    text = text_of(tmp_path / "report.html")
    assert found.sentence in text
    assert "157.6" in text
    assert "The last of these combinations is open" in text


@pytest.mark.usefixtures("coarse")
def test_a_mode_that_was_shifted_is_named(tmp_path: Path) -> None:
    found = load_rig("brake-reuss").identify(BRAKE_REUSS)
    assert isinstance(found, IdentifiedMode)
    found.report(tmp_path / "report.html")
    text = text_of(tmp_path / "report.html")
    assert "except sweep 3, which was shifted as a whole" in found.sentence
    assert found.sentence in text
    assert "3, shifted" in text


def test_a_report_without_a_place_is_refused_before_it_is_drawn(identified: IdentifiedJoint, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no folder"):
        identified.report(tmp_path / "nowhere" / "report.html")
