"""The shipped plate with a bolted stiffener: parts given by matrices, held to the whole finite-element model."""

import shutil

import numpy as np
import pytest

from twin.rigs import RIG_FILES, load_rig
from twin.structure import assemble, normal_modes

# Natural frequencies of both parts before their reduction, with the joint's pairs and the sensors' masses, as
# docs/make_stiffened_plate.py prints them (scikit-fem 12.0.2, 9162 displacements); preload, factor on E' and G', Hz.
WHOLE_MODEL = [
    ("4Nm", 1.0, [139.296, 201.124, 276.203, 354.586, 392.394, 437.473, 568.127, 605.740, 682.198, 736.710]),
    ("8Nm", 1.0, [142.856, 204.997, 276.742, 368.043, 399.826, 448.249, 591.021, 616.924, 687.139, 744.733]),
    ("8Nm", 0.5, [137.792, 199.756, 276.038, 350.141, 389.251, 433.369, 559.999, 601.706, 680.555, 733.529]),
    ("8Nm", 2.0, [146.244, 210.041, 277.678, 388.096, 407.213, 460.340, 619.371, 630.935, 694.886, 753.930]),
]
MASS_kg = 7850.0 * (0.360 * 0.240 * 0.003 + 0.300 * 0.020 * 0.012) + 3 * 0.002


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """The shipped rig from a copy of its files, so that no cache is left in the package's folder."""
    folder = tmp_path_factory.mktemp("rigs")
    shipped = RIG_FILES["stiffened-plate"]
    shutil.copy(shipped, folder)
    shutil.copytree(shipped.with_suffix(""), folder / shipped.stem)
    return load_rig(folder / shipped.name)


@pytest.fixture(scope="module")
def plate(rig):
    return assemble(rig)


def stiffness(rig, structure, preload, factor=1.0):
    moduli = rig.joint[0].preload[preload]
    return structure.stiffness(factor * moduli.normal_modulus, factor * moduli.shear_modulus)


def rigid_motions(structure):
    """Unit translations along, and unit rotations about, the axes through the origin: columns (n, 6)."""
    found = np.zeros((len(structure.M), 6))
    for mesh in structure.meshes.values():
        whole = np.zeros((len(mesh.reduced.T), 6))
        for (node, dof), row in mesh.matrices.rows.items():
            axis = "xyz".index(dof)
            whole[row, axis] = 1.0
            for turn, unit in enumerate(np.eye(3)):
                whole[row, 3 + turn] = np.cross(unit, mesh.matrices.coordinates_of(node))[axis]
        found[mesh.first : mesh.first + mesh.size] = np.linalg.lstsq(mesh.reduced.T, whole, rcond=None)[0]
    return found


@pytest.mark.parametrize(("preload", "factor", "expected_Hz"), WHOLE_MODEL)
def test_natural_frequencies_are_those_of_the_whole_model(rig, plate, preload, factor, expected_Hz):
    found = normal_modes(plate.M, stiffness(rig, plate, preload, factor), 6 + len(expected_Hz)).frequency_Hz
    assert found[:6].max() < 0.1
    np.testing.assert_allclose(found[6:], expected_Hz, rtol=0.003)
    np.testing.assert_allclose(found[6:12], expected_Hz[:6], rtol=0.001)


def test_no_rigid_motion_strains_a_part_or_the_joint(rig, plate):
    motions = rigid_motions(plate)
    K = stiffness(rig, plate, "8Nm")
    softest = normal_modes(plate.M, K, 7).omega[6]
    inertia = motions.T @ plate.M @ motions
    np.testing.assert_allclose(np.diag(inertia)[:3], MASS_kg, rtol=1e-9)
    assert np.abs(np.diag(motions.T @ K @ motions)).max() < 1e-6 * softest**2 * np.diag(inertia).min()
    joint = plate.joints[0]
    assert joint.B_E.shape[0] == 27
    assert joint.B_G.shape[0] == 54
    assert np.abs(joint.B_E @ motions).max() < 1e-10 * joint.normal.weight.min()
    assert np.abs(joint.B_G @ motions).max() < 1e-10 * joint.shear.weight.min()


def test_each_area_of_a_bolt_is_shared_out_among_its_pairs(plate):
    joint = plate.joints[0]
    areas = joint.normal.weight**2 * plate.layout.joints[0].layer_height
    np.testing.assert_allclose(areas.reshape(3, 9).sum(axis=1), 0.020 * 0.020, rtol=1e-9)


def test_drive_and_sensors_reach_the_first_modes(rig, plate):
    Phi = normal_modes(plate.M, stiffness(rig, plate, "8Nm"), 12).Phi[:, 6:]
    driven = np.abs(plate.row(rig.drive_place) @ Phi)
    assert driven.min() > 0.2
    assert all(np.abs(plate.row(rig.place_of(channel)) @ Phi).max() > 0.2 for channel in ("acc1", "acc2", "acc3"))
