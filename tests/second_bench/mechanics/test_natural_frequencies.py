"""Natural frequencies of beams against their closed forms, and of the rig against a finer mesh and the rig file."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from tests.second_bench.believed import BELIEVED, rig_text
from tests.second_bench.mechanics.beams import Beam, WeakStretch, meshed
from tests.second_bench.mechanics.structure import modes_of

BEAM = Beam(0.1, 0.4, 0.025, 0.006, 200e9, 7800.0)


def frequencies(*, clamped):
    M, K = meshed(BEAM, 20).matrices()
    free = slice(3, None) if clamped else slice(None)
    square = eigh(K[free, free], M[free, free], eigvals_only=True)
    return np.sqrt(square[square > 1.0]) / (2 * np.pi)


def in_bending(number):
    """Hz of the mode with k l = `number`."""
    stiffness, mass = BEAM.modulus * BEAM.second_moment, BEAM.density * BEAM.area
    return (number / BEAM.length) ** 2 * np.sqrt(stiffness / mass) / (2 * np.pi)


def test_a_clamped_beam_has_the_frequencies_of_the_textbook():
    found = frequencies(clamped=True)[:3]
    assert found == pytest.approx([in_bending(n) for n in (1.8751041, 4.6940911, 7.8547574)], rel=1e-4)


def test_a_free_beam_has_the_frequencies_of_the_textbook():
    found = frequencies(clamped=False)[:3]
    assert found == pytest.approx([in_bending(n) for n in (4.7300407, 7.8532046, 10.9956078)], rel=1e-4)


def test_a_beam_stretches_at_the_frequency_of_the_textbook():
    stretching = np.sqrt(BEAM.modulus / BEAM.density) / (4 * BEAM.length)
    assert np.min(np.abs(frequencies(clamped=True) / stretching - 1)) < 1e-3


def test_rows_read_the_deflection_between_nodes():
    beam = meshed(BEAM, 3, (WeakStretch(0.2, 0.25, 0.5),))
    cubic = np.polynomial.Polynomial([0.1, -0.4, 1.0, 2.0])
    displacements = np.array([[0.3 * x, cubic(x), cubic.deriv()(x)] for x in beam.x]).ravel()
    read = [row @ displacements for row in beam.rows(0.2345)]
    assert read == pytest.approx([0.3 * 0.2345, cubic(0.2345), cubic.deriv()(0.2345)], rel=1e-12)


def test_a_weak_stretch_bends_more_by_what_it_lost():
    stretch = WeakStretch(0.3, 0.35, 0.5)

    def tip(*weak):
        _, K = meshed(BEAM, 7, weak).matrices()
        load = np.zeros(len(K))
        load[-2] = 1.0
        return np.linalg.solve(K[3:, 3:], load[3:])[-2]

    far, near = 0.5 - stretch.begin, 0.5 - stretch.end
    more = (far**3 - near**3) / 3 / (BEAM.modulus * BEAM.second_moment)
    assert tip(stretch) - tip() == pytest.approx(more, rel=1e-6)


def test_finer_meshes_and_more_points_change_no_frequency_of_the_band():
    finer = replace(BELIEVED, elements=(71, 64), layer=replace(BELIEVED.layer, points=11))
    assert modes_of(BELIEVED).omega[:4] == pytest.approx(modes_of(finer).omega[:4], rel=1e-5)


def test_the_rig_file_is_read_as_the_rig_that_stands_on_the_bench(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(rig_text())
    shown = subprocess.run(
        [sys.executable, "-m", "twin", "rig", "show", str(path), "--json"], capture_output=True, text=True, check=True
    )
    told = json.loads(shown.stdout)["natural_frequencies_Hz"][:4]
    assert told == pytest.approx((modes_of(BELIEVED).omega[:4] / (2 * np.pi)).tolist(), rel=2e-4)
