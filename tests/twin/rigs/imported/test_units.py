"""Units of a model: the right ones are guessed, and every set says the same structure in SI units."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from twin.rigs.imported.units import UNITS, ModelScale, model_scale

ROWS = {(1, "x"): 0, (1, "rz"): 1}


def test_a_stiffness_and_an_inertia_in_every_set_of_units():
    N_per_m, Nm, kg, kg_m2 = 2e6, 30.0, 1.5, 0.004
    for name, (K, k, M, m) in {
        "m-kg-s": (N_per_m, Nm, kg, kg_m2),
        "mm-t-s": (N_per_m / 1e3, Nm * 1e3, kg / 1e3, kg_m2 * 1e3),
        "mm-kg-ms": (N_per_m / 1e6, Nm, kg, kg_m2 * 1e6),
        "in-lbf-s": (N_per_m / 175.126835, Nm / 0.112984829, kg / 175.126835, kg_m2 / 0.112984829),
    }.items():
        mass, stiffness = UNITS[name].to_si(csr_array(np.diag([M, m])), csr_array(np.diag([K, k])), ROWS)
        np.testing.assert_allclose(stiffness.diagonal(), [N_per_m, Nm], rtol=1e-8)
        np.testing.assert_allclose(mass.diagonal(), [kg, kg_m2], rtol=1e-8)


@pytest.mark.parametrize("size_m", [0.1, 0.4, 2.0])
@pytest.mark.parametrize("sound", [3400.0, 5000.0, 9000.0])
@pytest.mark.parametrize("name", ["m-kg-s", "mm-t-s", "mm-kg-ms"])
def test_the_units_of_usual_parts_are_guessed(name, sound, size_m):
    units = UNITS[name]
    model = ModelScale(size_m / units.length_m, sound * units.time_s / units.length_m)
    assert model.guess() == units
    assert not model.doubt(units)


def test_what_tells_nothing_is_not_guessed_and_nonsense_is_refused():
    assert ModelScale(0.0, np.nan).guess() is None
    assert ModelScale(np.sqrt(1000.0) * 0.4, 5000.0).guess() is None
    assert "1.6e+02 m/s, which is no solid's" in ModelScale(0.3, 157.0).doubt(UNITS["m-kg-s"])
    with pytest.raises(ValueError, match="no solid's"):
        ModelScale(0.3, 1e-4).doubt(UNITS["m-kg-s"])


def test_speed_of_sound_of_a_rod():
    n, h, E, rho = 11, 0.03, 70e9, 2700.0
    K = csr_array(E / h * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)))
    places = np.column_stack([h * np.arange(n), np.zeros((n, 2))])
    model = model_scale(csr_array(rho * h * np.eye(n)), K, places, {(node, "x"): node for node in range(n)})
    assert model.size == pytest.approx(0.3)
    assert model.sound == pytest.approx(np.sqrt(2 * E / rho))
