"""Plane frames as rig files draw them, each with its exact reference."""

import numpy as np
from drawn_frames import CLAMP, FLAT, THICK, beam, drawn, tie
from exact_frames import Bar, ExactFrame, at_angle

__all__ = ["FRAMES", "portal"]


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
"""Each with its number of rigid motions."""
