"""Frames of beams, supports and ties against the exact frequencies of their dynamic stiffness."""

import numpy as np
import pytest
from drawn_frames import CLAMP, FLAT, THICK, beam, drawn, found_Hz, reversed_part, tie, turned
from exact_frames import Bar, ExactFrame, at_angle


def inclined():
    tip = at_angle(0.64, 0.3, 0.0)
    table = drawn([beam("b", (0, 0), tip)], [{"part": "b", "at": 0.0, "fix": CLAMP}])
    return table, ExactFrame({"o": (0, 0), "t": tip}, [Bar("o", "t", **FLAT)], {("o", m) for m in CLAMP})


def l_frame():
    table = drawn(
        [beam("post", (0, 0), (0, 0.3)), beam("arm", (0, 0.3), (0.2, 0.3), THICK)],
        [{"part": "post", "at": 0.0, "fix": CLAMP}],
        [tie("post", 0.3, "arm", 0.0)],
    )
    corners = {"o": (0, 0), "c": (0, 0.3), "t": (0.2, 0.3)}
    bars = [Bar("o", "c", **FLAT), Bar("c", "t", **THICK)]
    return table, ExactFrame(corners, bars, {("o", m) for m in CLAMP})


def t_frame():
    """The arm is tied to the middle of the post, both ends of which are held."""
    table = drawn(
        [beam("arm", (0.2, 0.13), (0, 0.13), THICK), beam("post", (0, 0), (0, 0.3))],
        [{"part": "post", "at": 0.3, "fix": ["x", "y"]}, {"part": "post", "at": 0.0, "fix": CLAMP}],
        [tie("arm", 0.2, "post", 0.13)],
    )
    corners = {"o": (0, 0), "c": (0, 0.13), "e": (0, 0.3), "t": (0.2, 0.13)}
    bars = [Bar("o", "c", **FLAT), Bar("c", "e", **FLAT), Bar("c", "t", **THICK)]
    return table, ExactFrame(corners, bars, {("o", m) for m in CLAMP} | {("e", "x"), ("e", "y")})


def u_frame():
    """Hung free; the second leg is drawn from its tip."""
    table = drawn(
        [
            beam("left", (0, 0.25), (0, 0)),
            beam("foot", (0, 0), (0.2, 0.03), THICK),
            beam("right", (0.25, 0.3), (0.2, 0.03)),
        ],
        [],
        [
            tie("foot", float(np.hypot(0.2, 0.03)), "right", float(np.hypot(0.05, 0.27))),
            tie("left", 0.25, "foot", 0.0),
        ],
    )
    corners = {"a": (0, 0.25), "b": (0, 0), "c": (0.2, 0.03), "d": (0.25, 0.3)}
    return table, ExactFrame(corners, [Bar("a", "b", **FLAT), Bar("b", "c", **THICK), Bar("c", "d", **FLAT)])


def ring():
    """A closed rectangle, hung free."""
    corners = {"a": (0, 0), "b": (0.3, 0), "c": (0.3, 0.2), "d": (0, 0.2)}
    sides, sections = [("a", "b"), ("b", "c"), ("c", "d"), ("d", "a")], [FLAT, THICK, FLAT, FLAT]
    parts = [beam(a + b, corners[a], corners[b], s) for (a, b), s in zip(sides, sections, strict=True)]
    lengths = [0.3, 0.2, 0.3, 0.2]
    ties = [tie(parts[n]["name"], lengths[n], parts[(n + 1) % 4]["name"], 0.0) for n in range(4)]
    bars = [Bar(a, b, **s) for (a, b), s in zip(sides, sections, strict=True)]
    return drawn(parts, [], ties), ExactFrame(corners, bars)


def portal(angle=0.0):
    """On feet that cannot slide, on springs up and in rotation: softer than the columns, and unequal."""
    points = {"a": (0, 0), "b": (0, 0.25), "c": (0.35, 0.25), "d": (0.35, 0)}
    corners = {name: at_angle(angle, *xy) for name, xy in points.items()}
    slide, up = ("x", "y") if angle == 0 else ("y", "x")
    supports = [
        {"part": "left", "at": 0.0, "fix": [slide], "stiffness": {up: 2e5, "rz": 40.0}},
        {"part": "right", "at": 0.25, "fix": [slide], "stiffness": {"rz": 90.0, up: 5e4}},
    ]
    parts = [
        beam("left", corners["a"], corners["b"]),
        beam("lintel", corners["b"], corners["c"], THICK),
        beam("right", corners["c"], corners["d"]),
    ]
    table = drawn(parts, supports, [tie("left", 0.25, "lintel", 0.0), tie("right", 0.0, "lintel", 0.35)])
    bars = [Bar("a", "b", **FLAT), Bar("b", "c", **THICK), Bar("c", "d", **FLAT)]
    springs = {("a", up): 2e5, ("a", "rz"): 40.0, ("d", up): 5e4, ("d", "rz"): 90.0}
    return table, ExactFrame(corners, bars, {("a", slide), ("d", slide)}, springs)


def pinned():
    """Held in y and rz at the start and pinned at a place that is no node of an even mesh."""
    supports = [{"part": "b", "at": 0.1137, "fix": ["x", "y"]}, {"part": "b", "at": 0.0, "fix": ["y", "rz"]}]
    corners = {"o": (0, 0), "p": (0.1137, 0), "t": (0.3, 0)}
    held = {("o", "y"), ("o", "rz"), ("p", "x"), ("p", "y")}
    bars = [Bar("o", "p", **FLAT), Bar("p", "t", **FLAT)]
    return drawn([beam("b", (0, 0), (0.3, 0))], supports), ExactFrame(corners, bars, held)


def swing():
    """On one pin alone: it turns about it."""
    table = drawn([beam("b", (0, 0), at_angle(1.1, 0.3, 0))], [{"part": "b", "at": 0.1137, "fix": ["x", "y"]}])
    corners = {"o": (0, 0), "p": at_angle(1.1, 0.1137, 0), "t": at_angle(1.1, 0.3, 0)}
    return table, ExactFrame(corners, [Bar("o", "p", **FLAT), Bar("p", "t", **FLAT)], {("p", "x"), ("p", "y")})


FRAMES = {
    "inclined": (inclined, 0), "l": (l_frame, 0), "t": (t_frame, 0), "u": (u_frame, 3), "ring": (ring, 3),
    "portal": (portal, 0), "pinned": (pinned, 0), "swing": (swing, 1),
}  # fmt: skip
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
