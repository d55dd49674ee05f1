"""Nodes that face each other: which, over what area, and which way."""

from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_array

from twin.rigs.imported.facing import facing_pairs
from twin.rigs.imported.part import ImportedPart, PartFiles
from twin.rigs.imported.units import UNITS
from twin.rigs.matrix_files import PartMatrices


def part(name, places, first=1):
    places = np.asarray(places, float)
    nodes = np.arange(first, first + len(places))
    eye = csr_array(np.eye(len(places)))
    return ImportedPart(
        PartFiles(name, Path("m"), Path("k")), PartMatrices(eye, eye, nodes, places, {}), UNITS["m-kg-s"], (), ()
    )


def grid(x, y, z):
    return [(a, b, z) for a in x for b in y]


def test_two_patches_with_a_gap_share_out_their_area():
    x = np.concatenate([0.01 * np.arange(4), 0.2 + 0.01 * np.arange(3)])
    lower = part("lower", [*grid(x, [0.0, 0.01, 0.02], 0.0), (0.5, 0.5, -0.1)])
    upper = part("upper", grid(x[::-1], [0.0, 0.01, 0.02], 0.002), first=100)
    pairs = facing_pairs(lower, upper)
    assert len(pairs.a) == 21
    assert pairs.area_m2.sum() == pytest.approx(0.03 * 0.02 + 0.02 * 0.02)
    np.testing.assert_allclose(pairs.normal, np.tile([0, 0, 1], (21, 1)), atol=1e-12)
    for a, b in zip(pairs.a, pairs.b, strict=True):
        gap = upper.matrices.coordinates_of(b) - lower.matrices.coordinates_of(a)
        np.testing.assert_allclose(gap, [0, 0, 0.002], atol=1e-12)
    np.testing.assert_allclose(facing_pairs(upper, lower).normal, np.tile([0, 0, -1], (21, 1)), atol=1e-12)


def test_parts_that_do_not_meet_or_meet_in_a_line():
    a = part("a", grid([0, 0.01, 0.02], [0, 0.01], 0.0))
    assert facing_pairs(a, part("b", grid([0, 0.01, 0.02], [0, 0.01], 1.0))) is None
    with pytest.raises(ValueError, match="3 facing nodes lie on a line: no area to join"):
        facing_pairs(a, part("b", grid([0, 0.01, 0.02], [0.0], 0.0)))
