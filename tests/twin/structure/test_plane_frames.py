"""Frames of beams, supports and ties against the exact frequencies of their dynamic stiffness."""

import numpy as np
import pytest
from drawn_frames import CLAMP, FLAT, beam, drawn, found_Hz, reversed_part, tie, turned
from exact_frames import Bar, ExactFrame, at_angle
from plane_frames import FRAMES, portal

TURNABLE = ("inclined", "l", "t", "u", "ring", "swing")


def test_the_reference_knows_the_textbooks_cantilever_and_free_beam():
    EI, m = 198e9 * 0.0254 * 0.00636**3 / 12, 7880.0 * 0.0254 * 0.00636
    unit = np.sqrt(EI / m) / 0.3**2 / (2 * np.pi)
    corners, bars = {"o": (0, 0), "t": at_angle(0.4, 0.3, 0)}, [Bar("o", "t", **FLAT)]
    held = ExactFrame(corners, bars, {("o", m) for m in CLAMP}).frequencies_Hz(3)
    np.testing.assert_allclose(held / unit, np.array([1.8751040687, 4.6940911330, 7.8547574382]) ** 2, rtol=1e-8)
    free = ExactFrame(corners, bars)
    assert free.count(2 * np.pi * 0.5) == 3
    np.testing.assert_allclose(free.frequencies_Hz(2) / unit, np.array([4.7300407449, 7.8532046241]) ** 2, rtol=1e-7)


@pytest.mark.parametrize("name", FRAMES)
def test_first_five_elastic_frequencies_are_exact(name):
    make, rigid = FRAMES[name]
    table, exact = make()
    np.testing.assert_allclose(found_Hz(table, rigid=rigid), exact.frequencies_Hz(5), rtol=1e-3)


@pytest.mark.parametrize("name", FRAMES)
def test_frequencies_converge_to_the_exact_ones(name):
    """Euler-Bernoulli elements come from above; those of the motion along the axis decide, with the square."""
    make, rigid = FRAMES[name]
    table, exact = make()
    fine = {**table, "part": [{**part, "elements": 60} for part in table["part"]]}
    ratio = found_Hz(fine, rigid=rigid) / exact.frequencies_Hz(5)
    np.testing.assert_allclose(ratio, 1.0, rtol=3e-5)
    assert np.all(ratio > 1 - 1e-8)


@pytest.mark.parametrize("name", TURNABLE)
@pytest.mark.parametrize("angle", [0.37, 2.5, -1.2])
def test_a_turned_drawing_has_the_same_frequencies(name, angle):
    make, rigid = FRAMES[name]
    table, _ = make()
    np.testing.assert_allclose(found_Hz(turned(table, angle), rigid=rigid), found_Hz(table, rigid=rigid), rtol=1e-9)


def test_a_portal_on_its_side_has_the_same_frequencies():
    np.testing.assert_allclose(found_Hz(portal(np.pi / 2)[0]), found_Hz(portal()[0]), rtol=1e-9)


@pytest.mark.parametrize("name", FRAMES)
def test_a_part_drawn_from_its_other_end_has_the_same_frequencies(name):
    make, rigid = FRAMES[name]
    table, _ = make()
    for part in table["part"]:
        other = found_Hz(reversed_part(table, part["name"]), rigid=rigid)
        np.testing.assert_allclose(other, found_Hz(table, rigid=rigid), rtol=1e-9, err_msg=part["name"])


def test_two_beams_tied_in_line_are_the_one_beam():
    clamp = [{"part": "b", "at": 0.0, "fix": CLAMP}]
    tip, cut = at_angle(0.64, 0.3, 0), at_angle(0.64, 0.12, 0)
    one = drawn([beam("b", (0, 0), tip)], clamp)
    two = drawn(
        [beam("b", (0, 0), cut, elements=8), beam("c", tip, cut, elements=12)], clamp, [tie("c", 0.18, "b", 0.12)]
    )
    np.testing.assert_allclose(found_Hz(two), found_Hz(one), rtol=1e-9)
