"""Viscous dampers between places on bench and model, in closed form: two cantilevers that a damper couples."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_frames import CLAMP, FLAT, beam, drawn, read

from twin.bench import BenchSetup, no_law, open_bench
from twin.checks.expected import ExpectedResponse
from twin.identify.linear.linear_model import Output, build_linear_model, nominal_parameters
from twin.rigs import preload_name
from twin.structure import assemble

LENGTH, DAMPING = 0.3, 20.0
"""m, and N s/m: a fifth of what would hold the tips together at the first resonance."""
EI = FLAT["youngs_modulus"] * FLAT["width"] * FLAT["thickness"] ** 3 / 12
PER_LENGTH = FLAT["density"] * FLAT["width"] * FLAT["thickness"]
FREQUENCIES_Hz = np.array([20.0, 50.0, 57.0, 61.0, 90.0, 180.0, 340.0, 370.0])
"""About both first resonances of a cantilever, 57.6 and 361 Hz."""


@pytest.fixture(scope="module")
def coupled():
    """Two equal cantilevers, driven at the tip of one, seen at both, with next to no other damping."""
    held = [{"part": name, "at": 0.0, "fix": CLAMP} for name in "bc"]
    table = drawn([beam("b", (0, 0), (LENGTH, 0)), beam("c", (0, 0.1), (LENGTH, 0.1))], held)
    at = {"at": LENGTH, "direction": "+y"}
    seen = {"quantity": "displacement", "range": 1.0, **at}
    table["damping"] = {"modal_ratio": [1e-7]}
    table["drive"] = {"part": "b", **at}
    table["sensor"] = [
        {"part": "b", **at, "channel": "force", "quantity": "force", "range": 50.0},
        *({"part": name, **seen, "channel": name} for name in "bc"),
    ]
    return read({**table, "damper": [{"between": ["b", "c"], "at": [LENGTH, LENGTH], "damping": {"y": DAMPING}}]})


def closed_form(omega):
    """Displacements (f, 2) of the tips: together they feel no damper, against each other each feels twice of it."""
    b = LENGTH * (PER_LENGTH * omega**2 / EI) ** 0.25
    tip = LENGTH**3 / EI * (np.sin(b) * np.cosh(b) - np.cos(b) * np.sinh(b)) / (b**3 * (1 + np.cos(b) * np.cosh(b)))
    against = tip / (1 + 2j * omega * DAMPING * tip)
    return np.stack([tip + against, tip - against], axis=1) / 2


def of_the_bench(rig):
    bench = open_bench(rig, joint_law=no_law(), setup=BenchSetup(drive="force")).built
    first = bench.locals + bench.auxiliaries + 1
    return bench.rig(0.0, 51200.0).transfer(FREQUENCIES_Hz)[:, first:, 0]


def of_the_model(rig):
    outputs = [Output(name, "displacement", rig.place_of(name)) for name in "bc"]
    omega, model = 2 * np.pi * FREQUENCIES_Hz, build_linear_model(rig, outputs)
    return model.response(model.receptance(omega, nominal_parameters(rig)), omega)


def of_the_first_look(rig):
    outputs = [Output(name, "displacement", rig.place_of(name)) for name in "bc"]
    return ExpectedResponse.of(rig, outputs, preload_name(rig)).H(FREQUENCIES_Hz)


@pytest.mark.parametrize(("found", "near"), [(of_the_bench, 3e-3), (of_the_model, 3e-4), (of_the_first_look, 3e-4)])
def test_a_damper_between_two_tips(coupled, found, near):
    """On the bench it does not feel the flexibility above the modes that are kept, as no damping does there."""
    expected = closed_form(2 * np.pi * FREQUENCIES_Hz)
    assert np.all(np.abs(found(coupled) - expected) < near * np.abs(expected).max(axis=1, keepdims=True))


def test_sensitivities_with_a_damper_are_derivatives(coupled):
    outputs = [Output(name, "displacement", coupled.place_of(name)) for name in "bc"]
    model, base, omega = build_linear_model(coupled, outputs), nominal_parameters(coupled), 2 * np.pi * FREQUENCIES_Hz
    base = replace(base, zeta=np.full(len(base.zeta), 0.01))
    found = model.sensitivity(model.receptance(omega, base), omega, base)
    for entry in range(len(base.vector)):
        step = 1e-5 * np.eye(len(base.vector))[entry]
        up, down = (
            model.response(model.receptance(omega, base.from_vector(base.vector + d)), omega) for d in (step, -step)
        )
        np.testing.assert_allclose((up - down) / 2e-5, found[:, :, entry], rtol=1e-4, atol=1e-6 * np.abs(up).max())


def test_a_turning_damper_takes_out_what_its_torque_does(coupled):
    """The matrix of a damper about z: its torque times the difference of the slopes, from the elements' own nodes."""
    table = coupled.model_dump()["damper"][0]
    turning = type(coupled.damper[0])(**{**table, "damping": {"rz": 0.3}})
    structure = assemble(coupled.model_copy(update={"damper": [turning]}))
    slopes = [structure.basis[structure.meshes[name].node_dofs(LENGTH)[-1]] for name in "bc"]
    difference = slopes[1] - slopes[0]
    np.testing.assert_allclose(structure.B_C.T @ structure.B_C, 0.3 * np.outer(difference, difference), atol=1e-12)
