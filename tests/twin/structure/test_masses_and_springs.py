"""Lumps and springs of a rig file against textbooks: a cantilever with a tip mass, two that a spring couples."""

import numpy as np
import pytest
from drawn_frames import CLAMP, FLAT, beam, drawn, found_Hz, read
from scipy.optimize import brentq

from recordings import InputError
from twin.structure import assemble

LENGTH = 0.3
EI, PER_LENGTH = 198e9 * 0.0254 * 0.00636**3 / 12, 7880.0 * 0.0254 * 0.00636
CLAMPED = [{"part": "b", "at": 0.0, "fix": CLAMP}]


def hertz(equation, *brackets):
    """Natural frequencies of the roots of a cantilever's equation in beta times its length."""
    roots = np.array([brentq(equation, *bracket, xtol=1e-13) for bracket in brackets])
    return roots**2 / LENGTH**2 * np.sqrt(EI / PER_LENGTH) / (2 * np.pi)


def test_a_mass_at_the_end_of_a_cantilever():
    mu = 0.05 / (PER_LENGTH * LENGTH)
    table = {**drawn([beam("b", (0, 0), (LENGTH, 0))], CLAMPED), "mass": [{"part": "b", "at": LENGTH, "mass": 0.05}]}
    exact = hertz(
        lambda b: 1 + np.cos(b) * np.cosh(b) + mu * b * (np.cos(b) * np.sinh(b) - np.sin(b) * np.cosh(b)),
        (0.5, 1.87), (2.5, 4.69), (5.5, 7.8),
    )  # fmt: skip
    np.testing.assert_allclose(found_Hz(table, 3), exact, rtol=2e-5)


def test_a_spring_between_two_cantilevers_stiffens_their_motion_against_each_other():
    kappa = 2 * 4000.0 * LENGTH**3 / EI
    parts = [beam("b", (0, 0), (LENGTH, 0)), beam("c", (0, 0.1), (LENGTH, 0.1))]
    table = drawn(parts, [*CLAMPED, {"part": "c", "at": 0.0, "fix": CLAMP}])
    coupled = {**table, "spring": [{"between": ["b", "c"], "at": [LENGTH, LENGTH], "stiffness": {"y": 4000.0}}]}
    alone = hertz(lambda b: 1 + np.cos(b) * np.cosh(b), (1.5, 2.2))
    against = hertz(
        lambda b: b**3 * (1 + np.cos(b) * np.cosh(b)) + kappa * (np.sin(b) * np.cosh(b) - np.cos(b) * np.sinh(b)),
        (1.9, 3.5),
    )
    np.testing.assert_allclose(found_Hz(coupled, 2), [*alone, *against], rtol=1e-5)


@pytest.mark.parametrize("in_space", [False, True])
def test_a_lump_moves_and_turns_with_its_place(in_space):
    ends = ((0, 0, 0), (LENGTH, 0, 0)) if in_space else ((0, 0), (LENGTH, 0))
    table, turns = drawn([beam("b", *ends)]), ("rx", "ry", "rz") if in_space else ("rz",)
    inertia = {name: 1e-4 * (n + 1) for n, name in enumerate(turns)}
    heavy = {**table, "mass": [{"part": "b", "at": 0.1, "mass": 0.7, "inertia": inertia}]}
    more = assemble(read(heavy), sensor_masses=False)
    mesh = more.meshes["b"]
    here = mesh.node_dofs(0.1)
    rest = more.M[np.ix_(here, here)]
    plain = mesh.first + len(mesh.dofs) * int(np.argmin(abs(mesh.s - 0.1))) + np.arange(len(mesh.dofs))
    bare = assemble(read({**table, "spring": [
        {"between": ["b", "b"], "at": [0.1, 0.1], "stiffness": {"x": 1.0}}
    ]}), sensor_masses=False)  # fmt: skip
    added = rest - bare.M[np.ix_(plain, plain)]
    expected = [inertia.get(name, 0.7) for name in mesh.dofs]
    np.testing.assert_allclose(added, np.diag(expected), rtol=1e-9, atol=1e-12)


def test_symmetric_halves_have_the_frequencies_of_the_whole():
    """A clamped-clamped beam by its half: held in x and rotation at the plane of symmetry, or in y against it."""
    both = [{"part": "b", "at": at, "fix": CLAMP} for at in (0.0, LENGTH)]
    whole = found_Hz(drawn([beam("b", (0, 0), (LENGTH, 0), elements=40)], both), 4)
    half = [beam("b", (0, 0), (LENGTH / 2, 0), elements=20)]
    symmetric, against = (
        found_Hz(drawn(half, [*CLAMPED, {"part": "b", "at": LENGTH / 2, "fix": fix}]), 2)
        for fix in (["x", "rz"], ["x", "y"])
    )
    np.testing.assert_allclose(np.sort([*symmetric, *against]), whole, rtol=1e-7)


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ({"mass": [{"part": "b", "at": 0.4, "mass": 0.1}]}, "mass.0: at 0.4 lies beyond the end"),
        ({"mass": [{"part": "b", "at": 0.1, "mass": 0.1, "inertia": {"rx": 1e-4}}]}, "moves along x and y and about z"),
        ({"spring": [{"between": ["b", "c"], "at": [0.1, 0.1], "stiffness": {"y": 1.0}}]}, "no part 'c'"),
        ({"spring": [{"between": ["b", "b"], "at": [0.1, 0.2], "stiffness": {"z": 1.0}}]}, "is a plane beam"),
        ({"damper": [{"between": ["b", "c"], "at": [0.1, 0.1], "damping": {"y": 1.0}}]}, "damper.0: no part 'c'"),
        ({"damper": [{"between": ["b", "b"], "at": [0.1, 0.2], "damping": {}}]}, "damper.0.damping"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused(table, told):
    with pytest.raises(InputError, match=told):
        read({**drawn([beam("b", (0, 0), (LENGTH, 0), FLAT)], CLAMPED), **table})
