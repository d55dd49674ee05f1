"""The layer's points: what they read of a motion, what their weights add up to, and that no mesh matters to them."""

from dataclasses import replace

import numpy as np
import pytest
from beam_rows import deflection

from twin.rigs import load_rig
from twin.structure import assemble, layer_points, normal_modes

RIG = load_rig("steel-lap-joint")
JOINT, MODULI = RIG.joint, RIG.joint.preload["120N"]
MIDDLE_m = RIG.lower.length - JOINT.overlap / 2


def meshed(layer_elements):
    return assemble(RIG, layout=RIG.layout(beam_elements=48, layer_elements=layer_elements))


def upper_moved(structure, *, along=0.0, across=0.0, turned=0.0):
    """Displacements with the whole upper beam moved as a rigid body, turned about the overlap's middle."""
    upper_x = structure.meshes["upper"].points[:, 0]
    turning = turned * (upper_x - MIDDLE_m)
    upper = np.stack([np.full(len(upper_x), along), across + turning, np.full(len(upper_x), turned)], axis=1)
    x = np.concatenate([np.zeros(len(structure.basis) - upper.size), upper.ravel()])
    return x[structure.free]


@pytest.mark.parametrize("elements", [3, 6, 12])
def test_beams_that_move_apart_open_and_beams_that_move_along_slip(elements):
    """Turned, the ends open by the way to them, and the face of the upper beam slides by half its thickness."""
    structure = meshed(elements)
    points = layer_points(structure, 3)
    opening, slip = (
        rows @ upper_moved(structure, along=2e-6, across=3e-6, turned=1e-4) for rows in (points.opening, points.slip)
    )
    ends = JOINT.overlap / 3 * np.array([-1.0, 0.0, 1.0])
    np.testing.assert_allclose(opening, 3e-6 + 1e-4 * ends, rtol=1e-9)
    np.testing.assert_allclose(slip, 2e-6 + 1e-4 * RIG.upper.thickness / 2, rtol=1e-9)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_an_element_s_opening_lies_between_its_mean_and_the_one_in_its_middle(share):
    """Of a parabola, whose mean over an element exceeds its middle by a twelfth of the length's square."""
    structure = meshed(6)
    x = structure.meshes["upper"].points[:, 0] - MIDDLE_m
    upper = np.stack([0 * x, 50.0 * x**2, 100.0 * x], axis=1)
    bent = np.concatenate([np.zeros(len(structure.basis) - upper.size), upper.ravel()])[structure.free]
    length = JOINT.overlap / 3
    expected = 50.0 * length**2 * (np.array([1.0, 0.0, 1.0]) + (1 - share) / 12)
    np.testing.assert_allclose(layer_points(structure, 3, towards_middle=share).opening @ bent, expected, atol=1e-12)


def test_both_beams_moved_together_open_and_slip_nothing():
    structure = assemble(RIG, layout=replace(RIG.layout(), supports=()))
    together = np.zeros(((len(structure.basis) // 3), 3))
    together[:, 0], together[:, 1] = 1e-3, 2e-3
    assert np.max(np.abs(layer_points(structure, 3).rows @ together.ravel())) < 1e-15


@pytest.mark.parametrize("count", [1, 2, 3, 6])
def test_weights_add_up_to_area_over_height(count):
    points = layer_points(meshed(12), count)
    assert len(points) == count
    area = JOINT.overlap * min(RIG.lower.width, RIG.upper.width)
    for weight in (points.opening_weight, points.slip_weight):
        np.testing.assert_allclose(weight, area / JOINT.layer_height / count, rtol=1e-9)
    assert points.rows.shape == (2 * count, len(meshed(12).M))
    np.testing.assert_array_equal(points.weights, np.concatenate([points.opening_weight, points.slip_weight]))


def in_mode(structure, mode):
    """Openings and slips per metre at the tip."""
    shape = normal_modes(structure.M, structure.stiffness(MODULI.normal_modulus, MODULI.shear_modulus), 3).Phi[:, mode]
    return layer_points(structure, 3).rows @ shape / (deflection(structure, RIG.length) @ shape)


@pytest.mark.parametrize("mode", [0, 1, 2])
def test_the_mesh_of_the_layer_does_not_matter(mode):
    """Nor that elements of the mesh are shared out among the points by where they are integrated."""
    coarse, fine, finer, uneven = (in_mode(meshed(n), mode) for n in (3, 6, 12, 10))
    size = np.max(np.abs(finer))
    np.testing.assert_allclose(coarse, finer, atol=2e-3 * size)
    np.testing.assert_allclose(fine, finer, atol=2e-4 * size)
    np.testing.assert_allclose(uneven, finer, atol=0.05 * size)


def test_where_the_moduli_fall_along_the_overlap_so_do_the_weights_and_not_the_motion():
    structure = meshed(12)
    even, graded = (layer_points(s, 3) for s in (structure, structure.with_gradient(0.6)))
    # 1 - gradient (xi - 1/2) at the points' middles, xi = 1/6, 1/2, 5/6.
    np.testing.assert_allclose(graded.opening_weight / even.opening_weight, [1.2, 1.0, 0.8], rtol=1e-9)
    np.testing.assert_allclose(graded.slip_weight / even.slip_weight, [1.2, 1.0, 0.8], rtol=1e-9)
    moved = upper_moved(structure, along=2e-6, across=3e-6)
    np.testing.assert_allclose(graded.rows @ moved, even.rows @ moved, rtol=1e-9)


def test_a_modulus_at_the_points_holds_nearly_the_energy_of_the_layer():
    """Of mode 1: a mean of each element is what the law goes by, and leaves out what varies within."""
    structure = meshed(12)
    shape = normal_modes(structure.M, structure.stiffness(MODULI.normal_modulus, MODULI.shear_modulus), 1).Phi[:, 0]
    for whole, rows, weight in (
        (structure.joints[0].KE, layer_points(structure, n).opening, layer_points(structure, n).opening_weight)
        for n in (3, 12)
    ):
        assert np.sum(weight * (rows @ shape) ** 2) < shape @ whole @ shape
    assert np.sum(weight * (rows @ shape) ** 2) == pytest.approx(shape @ whole @ shape, rel=0.02)
