"""Thin layers and ties, however they are drawn: format 1's lap joint, three beams in a row, rigid arms, repetition."""

import tomllib

import numpy as np
import pytest
import tomli_w
from drawn_frames import CLAMP, FLAT, THICK, beam, drawn, found_Hz, lowest_modes, read, reversed_part, tie, turned
from exact_frames import Bar, ExactFrame, at_angle, energies
from scipy.linalg import eigh

from twin.rigs import RIG_FILES, load_rig, moduli_at, parse_rig
from twin.structure import assemble
from twin.structure.mesh import mesh_beams, mesh_layers

STEEL = """width = 0.0254
thickness = 0.00636
youngs_modulus = 198e9
density = 7880.0
"""
BY_HAND = f"""
format = 2
name = "lap-joint-by-hand"
[[part]]
name = "lower"
kind = "beam"
start = [0.0, 0.0]
end = [0.235, 0.0]
{STEEL}elements = 20
[[part]]
name = "upper"
kind = "beam"
start = [0.185, 0.00636]
end = [0.42, 0.00636]
{STEEL}elements = 21
[[joint]]
name = "lap"
kind = "thin-layer"
between = ["lower", "upper"]
from = 0.185
to = 0.235
layer_height = 0.00636
layer_elements = 3
[joint.preload."120N"]
normal_modulus = 3.9e8
shear_modulus = 7.6e7
[joint.preload."540N"]
normal_modulus = 5.9e8
shear_modulus = 7.4e7
[[support]]
part = "lower"
at = 0.0
fix = ["x", "y", "rz"]
[damping]
modal_ratio = [0.0023, 0.002, 0.002, 0.003]
[drive]
part = "lower"
at = 0.05
direction = "+y"
armature_mass = 0.020
suspension_stiffness = 3150.0
force_factor = 5.5
coil_resistance = 1.5
coil_inductance = 0.0002
stinger_stiffness = 1.0e6
[[sensor]]
channel = "force"
quantity = "force"
part = "lower"
at = 0.05
range = 50.0
[[sensor]]
channel = "acc1"
quantity = "acceleration"
part = "upper"
at = 0.115
direction = "+y"
mass = 0.002
range = 490.0
[[sensor]]
channel = "acc2"
quantity = "acceleration"
part = "upper"
at = 0.235
direction = "+y"
mass = 0.022
range = 490.0
"""
UPPER = {"thickness": 0.0095, "width": 0.021, "youngs_modulus": 70e9, "density": 2700.0}
"""So that a joint drawn the wrong way up shows."""


def by_hand(upper):
    table = tomllib.loads(BY_HAND)
    table["part"][1].update(upper)
    return {**table, "tie": []}


def format_1(upper):
    table = tomllib.loads(RIG_FILES["steel-lap-joint"].read_text())
    table["upper"].update(upper)
    return parse_rig(tomli_w.dumps(table).encode(), source="format-1.toml")


def from_the_upper(table):
    joint = {**table["joint"][0], "between": ["upper", "lower"], "from": 0.0, "to": 0.05}
    return {**table, "joint": [joint]}


def on_one_line(table):
    lower, upper = table["part"]
    return {**table, "part": [lower, {**upper, "start": [0.185, 0.0], "end": [0.42, 0.0]}]}


DRAWN = {
    "as format 1": lambda t: t,
    "from the upper": from_the_upper,
    "upper reversed": lambda t: reversed_part(t, "upper"),
    "lower reversed": lambda t: reversed_part(t, "lower"),
    "both reversed, from the upper": lambda t: reversed_part(reversed_part(from_the_upper(t), "upper"), "lower"),
    "parts in the other order": lambda t: {**t, "part": t["part"][::-1]},
    "on one line": on_one_line,
    "on one line, upper reversed": lambda t: reversed_part(on_one_line(t), "upper"),
    "turned by 90 degrees": lambda t: turned(t, np.pi / 2),
    "turned, from the upper, reversed": lambda t: turned(reversed_part(from_the_upper(t), "upper"), -2.1),
    "supports twice": lambda t: {**t, "support": [*t["support"], {"part": "lower", "at": 0.0, "fix": ["rz", "y"]}]},
}


def modes_at_sensors(rig, preload):
    """Natural frequencies, and each mode's displacement at one place times that at another."""
    structure, moduli = assemble(rig), moduli_at(rig, preload)
    K = structure.stiffness(*([getattr(m, f) for m in moduli] for f in ("normal_modulus", "shear_modulus")))
    frequency, Phi = lowest_modes(structure, K, 8)
    at = np.array([structure.row(rig.place_of(sensor.channel)) for sensor in rig.sensor]) @ Phi
    return frequency, at[:, None] * at[None]


@pytest.mark.parametrize("upper", [{}, UPPER], ids=["alike", "unlike"])
@pytest.mark.parametrize("preload", ["120N", "540N"])
@pytest.mark.parametrize("how", DRAWN)
def test_the_lap_joint_by_hand_is_that_of_format_1(how, preload, upper):
    frequency, products = modes_at_sensors(read(DRAWN[how](by_hand(upper))), preload)
    expected, its_products = modes_at_sensors(format_1(upper), preload)
    np.testing.assert_allclose(frequency, expected, rtol=1e-9)
    np.testing.assert_allclose(products, its_products, rtol=1e-6, atol=1e-9 * np.max(np.abs(its_products)))


def test_rows_of_places_are_those_of_format_1():
    rig, first = read(by_hand({})), load_rig("steel-lap-joint")
    structure, its = assemble(rig), assemble(first)
    for sensor in first.sensor:
        row, other = structure.row(rig.place_of(sensor.channel)), its.row(first.place_of(sensor.channel))
        np.testing.assert_allclose(row, other, atol=1e-12)
    np.testing.assert_allclose(structure.row(rig.drive_place), its.row(first.drive_place), atol=1e-12)


MODULI = [(3.9e8, 7.6e7), (1.1e8, 3.0e7)]
ROWS = {"apart": (0.24, True), "on one side": (0.24, False), "overlapping": (0.16, True)}
"""Where along x the third beam begins, and whether it lies above the second or below."""


def three_beams(begin, above, per_m):
    """A rig of three beams a, b and c in a row, with layers of so many elements per metre."""
    joint = {"kind": "thin-layer", "layer_height": 0.008}
    preload = [{"120N": {"normal_modulus": E, "shear_modulus": G}} for E, G in MODULI]
    parts = [
        beam("a", (0, 0), (0.2, 0)),
        beam("b", (0.1, 0.008), (0.3, 0.008), THICK),
        beam("c", (begin, 0.016 * above), (0.4, 0.016 * above), FLAT, elements=round((0.4 - begin) / 0.01)),
    ]
    joints = [
        {**joint, "name": "one", "between": ["a", "b"], "from": 0.1, "to": 0.2, "preload": preload[0]},
        {**joint, "name": "two", "between": ["c", "b"], "from": 0.0, "to": 0.3 - begin, "preload": preload[1]},
    ]
    for each in joints:
        each["layer_elements"] = round(per_m * (each["to"] - each["from"]))
    joints[1]["width"] = 0.015
    return drawn(parts, [{"part": "a", "at": 0.0, "fix": CLAMP}], joints=joints)


def three_beams_by_energies(begin, above):
    beams = [(0.0, 0.2, FLAT), (0.1, 0.3, THICK), (begin, 0.4, FLAT)]
    layers = [(0, 1, 0.1, 0.2, 0.008, 0.020, *MODULI[0])]
    layers += [(*((1, 2) if above else (2, 1)), begin, 0.3, 0.008, 0.015, *MODULI[1])]
    M, K = energies(beams, layers, h=0.01)
    return np.sqrt(1 / eigh(M[3:, 3:], K[3:, 3:], eigvals_only=True)[::-1][:8]) / (2 * np.pi)


@pytest.mark.parametrize("row", ROWS)
def test_three_beams_in_a_row_have_the_frequencies_of_their_energies(row):
    """On the same nodes; with fewer elements, whose borders on the middle beam do not meet; drawn otherwise."""
    expected = three_beams_by_energies(*ROWS[row])
    table, coarse = three_beams(*ROWS[row], per_m=100), three_beams(*ROWS[row], per_m=31)
    np.testing.assert_allclose(found_Hz(table, 8), expected, rtol=1e-8)
    np.testing.assert_allclose(found_Hz(coarse, 8), expected, rtol=2e-3)
    for one in (table, coarse):
        for other in ("a", "b", "c"):
            np.testing.assert_allclose(found_Hz(reversed_part(one, other), 8), found_Hz(one, 8), rtol=1e-8)
        np.testing.assert_allclose(found_Hz(turned(one, 2.2), 8), found_Hz(one, 8), rtol=1e-8)
    swapped = {**table, "joint": table["joint"][::-1], "part": table["part"][::-1]}
    np.testing.assert_allclose(found_Hz(swapped, 8), found_Hz(table, 8), rtol=1e-8)


@pytest.mark.parametrize("row", ROWS)
def test_a_beams_nodes_within_a_layer_are_that_layers_borders(row):
    """Of one joint's layer too where it lies on the other side of a beam that another joint holds, or a tie."""
    table = three_beams(*ROWS[row], per_m=31)
    layout = read({**table, "support": [{"part": "a", "at": 0.1234, "fix": ["y"]}]}).layout()
    layers = mesh_layers(layout)
    nodes = {mesh.part.name: mesh.s for mesh in mesh_beams(layout, layers)}
    for layer in layers:
        for name, at in zip(layer.joint.between, (layer.first, layer.second), strict=True):
            inside = nodes[name][(nodes[name] > np.min(at) - 1e-9) & (nodes[name] < np.max(at) + 1e-9)]
            np.testing.assert_allclose(inside, np.sort(at), atol=1e-9)


def offset(angle=0.0):
    """A beam held at its end, and another tied to its tip by an arm."""
    a, b, c, d = (at_angle(angle, *xy) for xy in ((0, 0), (0.25, 0), (0.28, 0.05), (0.4, 0.1)))
    parts = [beam("near", a, b), beam("far", c, d, THICK)]
    return drawn(parts, [{"part": "near", "at": 0.0, "fix": CLAMP}], [tie("near", 0.25, "far", 0.0)])


def test_places_apart_are_tied_by_a_rigid_arm():
    """Against a beam in its place, so stiff and light that more of either changes nothing."""
    corners = {"a": (0, 0), "b": (0.25, 0), "c": (0.28, 0.05), "d": (0.4, 0.1)}
    arm = Bar("b", "c", 0.02, 0.02, youngs_modulus=1e16, density=1e-2)
    frame = ExactFrame(corners, [Bar("a", "b", **FLAT), arm, Bar("c", "d", **THICK)], {("a", m) for m in CLAMP})
    expected, table = frame.frequencies_Hz(5), offset()
    np.testing.assert_allclose(found_Hz(table), expected, rtol=1e-3)
    others = [offset(1.3), reversed_part(table, "far"), reversed_part(table, "near")]
    others += [{**table, "tie": [tie("far", 0.0, "near", 0.25)]}, {**table, "part": table["part"][::-1]}]
    for other in others:
        np.testing.assert_allclose(found_Hz(other), found_Hz(table), rtol=1e-8)


def coordinates(table):
    return assemble(read(table)).free


def test_what_is_said_twice_is_said_once():
    table = offset(0.7)
    support, (once,) = table["support"], table["tie"]
    twice = {"part": "near", "at": 0.0, "fix": ["rz", "x", "rz"]}
    for more in (
        {"tie": [once, once]},
        {"tie": [once, tie("far", 0.0, "near", 0.25)]},
        {"support": [*support, twice]},
        {"support": [twice, {"part": "near", "at": 0.0, "fix": ["y"]}]},
        {"support": [*support, {"part": "near", "at": 0.0, "stiffness": {"rz": 50.0}}]},
    ):
        np.testing.assert_allclose(found_Hz({**table, **more}), found_Hz(table), rtol=1e-9)
    for at in (0.0, 0.07, 0.0613):
        third = beam("third", (at, 1 / 3), (0.1, 0.1 + at))
        star = {**table, "part": [*table["part"], third], "tie": [once, tie("far", 0.0, "third", at)]}
        round_trip = {**star, "tie": [*star["tie"], tie("third", at, "near", 0.25)]}
        assert len(coordinates(round_trip)) == len(coordinates(star)), "rounding is no constraint"
        np.testing.assert_allclose(found_Hz(round_trip), found_Hz(star), rtol=1e-9)


@pytest.mark.parametrize("off_m", [-1e-4, -1e-5, -2e-6, -9e-7, -5e-9, 5e-9, 5e-7, 9e-7])
def test_places_rounded_as_in_a_drawing_are_those_of_the_end(off_m):
    """An inclined beam's length is no round number: a tie or a layer may end a little before its end, or beyond."""
    table = offset(0.7)
    rounded = {**table, "tie": [tie("near", 0.25 + off_m, "far", 0.0)]}
    np.testing.assert_allclose(found_Hz(rounded), found_Hz(table), rtol=max(1e-5, 20 * abs(off_m)))
    lap = turned(by_hand({}), 0.7)
    short = {**lap, "joint": [{**lap["joint"][0], "to": 0.235 + off_m}]}
    np.testing.assert_allclose(found_Hz(short), found_Hz(lap), rtol=max(1e-5, 20 * abs(off_m)))
    far = {**lap, "sensor": [{**lap["sensor"][0]}, {**lap["sensor"][2], "at": 0.235 + off_m}]}
    assert len(assemble(read(far)).row(read(far).place_of("acc2"))) > 0
