"""Moduli are known no better than the mesh lets them be."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import least_squares

from twin.identify.linear.mesh_error import mesh_errors
from twin.rigs import Rig, load_rig
from twin.structure import Structure, assemble

E, G = np.array([3.7e8]), np.array([8.0e7])


def frequencies(structure: Structure, moduli: np.ndarray) -> np.ndarray:
    """The first five, by a dense solution of all of them."""
    half = len(structure.joints)
    values = eigh(structure.stiffness(moduli[:half], moduli[half:]), structure.M, eigvals_only=True)
    return np.sqrt(values[values > 1.0][:5])


@pytest.fixture(scope="module")
def rig() -> Rig:
    return load_rig("steel-lap-joint")


def test_it_is_the_change_of_moduli_that_a_mesh_of_half_the_elements_asks_for(rig: Rig) -> None:
    coarse, fine = assemble(rig), assemble(rig, layout=rig.layout().halved())
    true = frequencies(fine, np.r_[E, G])

    def off(log_factor: np.ndarray) -> np.ndarray:
        factor = np.exp(log_factor)
        frequency = np.log(frequencies(coarse, np.r_[factor[0] * E, factor[1] * G]) / true)
        return np.r_[frequency / 1e-4, log_factor / 0.0577]

    expected = np.abs(least_squares(off, np.zeros(2), x_scale=0.01).x)
    found = np.concatenate(mesh_errors(coarse, rig, E, G))
    assert found == pytest.approx(expected, rel=0.05, abs=2e-5)
    assert 0.001 < found[0] < 0.004


def test_a_finer_mesh_leaves_less(rig: Rig) -> None:
    joint = rig.joint.model_copy(update={"layer_elements": 6})
    finer = rig.model_copy(update={"joint": joint, "mesh": rig.mesh.model_copy(update={"beam_elements": 82})})
    coarse, fine = (mesh_errors(assemble(one), one, E, G)[0][0] for one in (rig, finer))
    assert fine < 0.6 * coarse


@pytest.mark.parametrize("name", ["two-lap-joints", "hung-lap-joint", "l-frame", "shaking-base", "stiffened-plate"])
def test_every_joint_of_any_rig_has_its_own(name: str) -> None:
    rig = load_rig(name)
    states = [next(iter(joint.preload.values())) for joint in rig.joints]
    values = [np.array([getattr(s, kind) for s in states]) for kind in ("normal_modulus", "shear_modulus")]
    of_E, of_G = mesh_errors(assemble(rig), rig, *values)
    assert of_E.shape == of_G.shape == (len(rig.joints),)
    assert np.all(np.isfinite([of_E, of_G]))
    assert max(of_E.max(initial=0), of_G.max(initial=0)) < 0.1
