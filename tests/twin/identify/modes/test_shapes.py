"""Shapes from residues: one mode's is real up to a factor, and MAC is Allemang and Brown's."""

from __future__ import annotations

import numpy as np
import pytest

from twin.identify.modes.shapes import mac_matrix, shape_of


def test_a_real_shape_comes_back_whatever_the_phase_and_the_sensors():
    shape, sensors = np.array([0.3, -1.0, 0.7]), np.array([2.0, -0.5])
    found = shape_of(np.exp(0.7j) * np.outer(shape, sensors))
    assert found.values == pytest.approx(-shape), "the largest one is 1"
    assert found.phase_scatter_deg == pytest.approx(0.0, abs=1e-6)


def test_a_travelling_wave_has_no_phase():
    found = shape_of(np.exp(2j * np.pi * np.arange(8) / 8)[:, None])
    assert found.phase_scatter_deg == pytest.approx(45.0, abs=1.0)


def test_mac_is_the_squared_cosine_of_shapes():
    rng = np.random.default_rng(0)
    one, other = rng.standard_normal((5, 3)), rng.standard_normal((5, 2))
    mac = mac_matrix(one * (2 + 1j), other)
    for r in range(3):
        for m in range(2):
            cosine = one[:, r] @ other[:, m] / np.linalg.norm(one[:, r]) / np.linalg.norm(other[:, m])
            assert mac[r, m] == pytest.approx(cosine**2)
