"""Laws by name: each against its own path, the layer's moduli at rest, and what a file may get wrong."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from recordings import InputError
from twin.joint import NamedLaw, describing_function, known_laws, law_named, load_laws, registry
from twin.joint.kernel import evaluate, remember

VALUES = {
    "saturating": {"softening": 2e8, "begins_at": 1e-6},
    "cubic": {"stiffness": 1e19},
    "jenkins": {"stiffness": 3e7, "slips_at": 1e-6},
    "iwan": {"stiffness": 3e7, "slips_at": 1e-6, "exponent": -0.5, "sliders": 6},
    "masing": {"deflection": [5e-7, 1e-6, 3e-6], "force": [15.0, 20.0, 25.0]},
    "polynomial": {"softening": [2e13], "loss": [4e12], "reversal": 1e-14},
    "slap": {"gap": 5e-7, "stiffness": 1e8},
    "stop": {"gap": 5e-7, "stiffness": 1e8},
    "mayer-gaul": {"opened": 1e8, "closed": 2e8, "pressed": 4e8, "gap": 1e-6},
    "running-loss": {"loss": 1e9, "reached_at": 1e-6},
    "softening-table": {"amplitude": [0.0, 1e-6, 4e-6], "softening": [0.0, 1e8, 2e8]},
    "loss-table": {"amplitude": [0.0, 1e-6, 4e-6], "loss": [0.0, 1e8, 2e8]},
}
PLAIN = """
from numba import njit
from twin.joint import NamedLaw, Parameter, law_of_functions

@njit
def force(p, memory, x):
    return p[0] * x + p[1] * x * x * x, p[0] + 3.0 * p[1] * x * x

HARDENING = NamedLaw(
    name="hardening", sentence="hardens by {cube:g}",
    parameters=(Parameter(name="spring", unit="N/m2", about="at rest"), Parameter(name="cube", unit="N/m4", about="")),
    make=law_of_functions(force),
)
"""


@pytest.fixture(autouse=True)
def _nothing_loaded(monkeypatch):
    monkeypatch.setattr("twin.joint.registry._loaded", {})


def test_the_list_is_complete():
    assert list(VALUES) == list(known_laws())


@pytest.mark.parametrize("name", VALUES)
def test_describing_function_is_the_paths(name):
    force = law_named(name).force(VALUES[name])
    amplitude = np.array([7e-7, 2.3e-6])
    closed, by_quadrature = force.describing_function(amplitude), describing_function(force.force_history, amplitude)
    np.testing.assert_allclose(closed, by_quadrature, atol=2e-3 * abs(closed[-1]))


@pytest.mark.parametrize("name", VALUES)
def test_nothing_is_added_at_rest_and_never_more_taken_than_said(name):
    force = law_named(name).force(VALUES[name])
    assert abs(force.describing_function(np.array(1e-11))) < 1e-3 * abs(force.describing_function(np.array(3e-6)))
    if name != "polynomial":  # goes on without end
        softest = np.min(force.describing_function(np.geomspace(1e-9, 1e-3, 200)).real)
        assert -force.most_taken <= softest + 1e-6 * force.most_taken


def test_jenkins_slips_where_it_says():
    force = law_named("jenkins").force({"stiffness": 3e7, "slips_at": 1e-6})
    assert force.describing_function(np.array(0.99e-6)) == pytest.approx(0.0, abs=1.0)
    assert force.describing_function(np.array(1.0)).real == pytest.approx(-3e7, rel=1e-3)
    assert force.law.force_history(np.array([0.5e-6, 5e-6]))[-1] == pytest.approx(3e7 * 1e-6)


def test_iwans_last_slider_slips_where_it_says():
    many = law_named("iwan").force({"stiffness": 3e7, "slips_at": 2e-6, "exponent": -0.3, "sliders": 100})
    path = np.linspace(0.0, 3e-6, 3001)
    slope = np.diff(many.law.force_history(path)) / np.diff(path)
    last = path[np.flatnonzero(slope > 1e-6 * 3e7)[-1]]
    assert last == pytest.approx(2e-6, rel=0.02)


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("jenkins", {"stiffness": -1.0}, "greater than 0"),
        ("jenkins", {"slip_force": 1.0}, "not permitted"),
        ("iwan", {"sliders": 2.5}, "a number of things"),
        ("masing", {"force": [15.0, 40.0, 90.0]}, "stiffens or falls"),
        ("masing", {"force": [15.0]}, "as many"),
        ("polynomial", {"reversal": 0.0}, "needs a reversal"),
        ("mayer-gaul", {"closed": 5e7}, "opened < closed < pressed"),
        ("softening-table", {"amplitude": [0.0, 2e-6, 1e-6]}, "must increase"),
    ],
)
def test_wrong_values_are_told(name, change, said):
    with pytest.raises((ValueError, ValidationError), match=said):
        law_named(name).force(VALUES[name] | change)


def test_a_law_of_functions_is_marched_as_a_kernel_and_as_plain_python(tmp_path):
    file = tmp_path / "my_law.py"
    file.write_text(PLAIN)
    (law,) = load_laws(file)
    assert law_named("hardening") is law
    made = law.make(spring=2.0, cube=3.0)
    p, state = np.zeros((2, 6)), np.zeros((2, 1))
    p[1, :5] = made.parameters
    for one, other in ((evaluate, remember), (evaluate.py_func, remember.py_func)):
        assert one(made.kind, p, state, 1, 0.5) == pytest.approx((2 * 0.5 + 3 * 0.125, 2 + 9 * 0.25))
        other(made.kind, p, state, 1, 0.5, 0.0, 1e-3)
    # quadrature, where no closed form is given
    assert made.describing_function(np.array(0.4)) == pytest.approx(2.0 + 0.75 * 3.0 * 0.16, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = 1", "has no law"),
        ("x = 1\ny = nothing", "line 2: NameError"),
        ("def f(:", "line 1: SyntaxError"),
    ],
)
def test_a_file_without_a_law_is_told_in_a_line(tmp_path, text, said):
    file = tmp_path / "my_law.py"
    file.write_text(text)
    with pytest.raises(InputError, match=said):
        load_laws(file)
    with pytest.raises(InputError, match="no such file"):
        load_laws(tmp_path / "other.py")


def test_what_numba_cannot_compile_or_pushes_at_rest_is_told(tmp_path):
    file = tmp_path / "my_law.py"
    file.write_text(PLAIN.replace("p[0] * x +", "open(x) +"))
    with pytest.raises(ValueError, match=r"force is not what numba can compile .*open"):
        load_laws(file)[0].force({"spring": 1.0, "cube": 1.0})
    file.write_text(PLAIN.replace("p[0] * x +", "p[0] +"))
    with pytest.raises(ValueError, match="must be zero there"):
        load_laws(file)[0].force({"spring": 1.0, "cube": 1.0})


def test_an_installed_package_may_bring_a_law(monkeypatch):
    class Point:
        value = "elsewhere:LAW"

        @staticmethod
        def load():
            return NamedLaw(name="theirs", sentence="", parameters=(), make=dict)

    monkeypatch.setattr("twin.joint.registry.entry_points", lambda group: [Point] if group == "twin.joint_laws" else [])
    monkeypatch.setattr("twin.joint.registry._installed", registry._installed.__wrapped__)
    assert "theirs" in known_laws()
