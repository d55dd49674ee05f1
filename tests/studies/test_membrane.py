"""The membrane with drilling rotations: patch tests, and the zero-thickness interface as its limit."""

from dataclasses import replace

import numpy as np
import pytest

from studies.membrane import interface_layer, membrane_layer, with_layer_element
from twin.rigs import load_rig
from twin.structure import assemble, normal_modes

LENGTH, HEIGHT, WIDTH = 0.017, 0.0064, 0.025
PLACES = np.array([[0, 0], [LENGTH, 0], [0, HEIGHT], [LENGTH, HEIGHT]])


def nodal(u, v, rotation):
    """Nodal values of a displacement field and of its rotation."""
    return np.array([[u(x, y), v(x, y), rotation(x, y)] for x, y in PLACES]).ravel()


def strains(motion):
    element = membrane_layer(length=LENGTH, height=HEIGHT, width=WIDTH)
    weight = element.normal.weight * HEIGHT
    return element.normal.B @ motion / weight, element.shear.B @ motion / weight


@pytest.mark.parametrize(
    ("u", "v", "rotation", "eps", "gamma"),
    [
        (lambda x, y: 1.0, lambda x, y: -2.0, lambda x, y: 0.0, 0.0, 0.0),
        (lambda x, y: -3 * y, lambda x, y: 3 * x, lambda x, y: 3.0, 0.0, 0.0),
        (lambda x, y: 0.0, lambda x, y: 5 * y, lambda x, y: 0.0, 5.0, 0.0),
        (lambda x, y: 4 * y, lambda x, y: 0.0, lambda x, y: -2.0, 0.0, 4.0),
        (lambda x, y: 2 * y, lambda x, y: 2 * x, lambda x, y: 0.0, 0.0, 4.0),
    ],
    ids=["translation", "rotation", "opening", "simple shear", "pure shear"],
)
def test_constant_strains_are_exact(u, v, rotation, eps, gamma):
    found_eps, found_gamma = strains(nodal(u, v, rotation))
    np.testing.assert_allclose(found_eps, eps, atol=1e-9)
    np.testing.assert_allclose(found_gamma, gamma, atol=1e-9)


def test_displacement_of_the_edge_follows_its_end_rotations_like_a_parabola():
    """Ends that turn against each other by 2 a bow the edge by a l / 4 at its middle, both edges alike: no opening."""
    motion = nodal(lambda x, y: 0.0, lambda x, y: 0.0, lambda x, y: 1.0 if x == 0 else -1.0)
    eps, _ = strains(motion)
    np.testing.assert_allclose(eps, 0, atol=1e-12)
    one_edge = motion.copy()
    one_edge[:6] = 0.0
    eps, _ = strains(one_edge)
    middle = eps.reshape(3, 3)[1]
    np.testing.assert_allclose(middle, LENGTH / 4 / HEIGHT, rtol=1e-9)


def test_stiffness_is_that_of_the_strains_volume():
    element = membrane_layer(length=LENGTH, height=HEIGHT, width=WIDTH)
    opening = nodal(lambda x, y: 0.0, lambda x, y: y / HEIGHT, lambda x, y: 0.0)
    assert opening @ element.normal.B.T @ element.normal.B @ opening == pytest.approx(WIDTH * LENGTH / HEIGHT)
    assert np.linalg.norm(element.shear.B @ opening) < 1e-12


def test_a_membrane_that_grows_thin_becomes_the_interface():
    """E'/h and G'/h held while h goes to nothing: the same frequencies as the zero-thickness element's."""
    rig = load_rig("steel-lap-joint")
    kn, ks = 3.9e8 / 0.00636, 7.6e7 / 0.00636
    found = []
    for height, element in ((1e-2, membrane_layer), (1e-4, membrane_layer), (1e-4, interface_layer)):
        thin = rig.model_copy(update={"joint": rig.joint.model_copy(update={"layer_height": height})})
        structure = assemble(thin, layout=thin.layout(beam_elements=60, layer_elements=10))
        layered = with_layer_element(structure, element)
        found.append(normal_modes(layered.M, layered.stiffness(kn * height, ks * height), 4).frequency_Hz)
    thick, thin, interface = found
    np.testing.assert_allclose(thin, interface, rtol=2e-3)
    assert np.abs(thick / interface - 1).max() > 5e-3, "thickness matters where there is some"


def test_floating_structure_with_a_membrane_keeps_its_rigid_body_modes():
    rig = load_rig("steel-lap-joint")
    floating = with_layer_element(
        assemble(rig, layout=replace(rig.layout(), supports=()), sensor_masses=False), membrane_layer
    )
    frequency = normal_modes(floating.M, floating.stiffness(3.9e8, 7.6e7), 5).frequency_Hz
    assert np.all(frequency[:3] < 2e-2)
    assert frequency[3] > 50
