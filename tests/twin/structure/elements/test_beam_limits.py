"""The lap joint's finite elements against beams with known frequencies: apart, bonded, and refined."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from beam_rows import axial, deflection, slope
from eigenvalue_sensitivity import eigenvalue_sensitivity
from scipy.linalg import eigh
from scipy.optimize import brentq

from twin.rigs import load_rig
from twin.structure import assemble, normal_modes
from twin.structure.elements.beam import beam_mass, beam_stiffness, weakened_stiffness


@pytest.fixture(scope="module")
def rig():
    return load_rig("steel-lap-joint")


def roots(function, count):
    """The first positive roots beta L of a beam's frequency equation."""
    grid = np.linspace(0.5, 40, 4000)
    values = np.array([function(x) for x in grid])
    signs = np.flatnonzero(values[:-1] * values[1:] < 0)[:count]
    return np.array([brentq(function, grid[i], grid[i + 1]) for i in signs])


def analytic(beam, support, count):
    """Natural frequencies (Hz) of an Euler-Bernoulli beam, from its textbook frequency equation."""
    sign = {"clamped-free": 1.0, "free-free": -1.0}[support]
    beta = roots(lambda x: np.cos(x) + sign / np.cosh(x), count) / beam.length
    return beta**2 * np.sqrt(beam.youngs_modulus * beam.second_moment / (beam.density * beam.area)) / (2 * np.pi)


def rod_frequencies(beam, odd_quarters, count):
    """Natural frequencies (Hz) of a rod, clamped-free (odd quarter waves) or free-free (half waves)."""
    n = (np.arange(count) + 0.5) if odd_quarters else np.arange(1, count + 1)
    return n * np.sqrt(beam.youngs_modulus / beam.density) / (2 * beam.length)


def zero_Hz(M, K):
    """As what a natural frequency of zero may come out: its eigenvalue's rounding is of the size of the largest one."""
    largest = eigh(K, M, eigvals_only=True)[-1]
    return np.sqrt(len(M) * np.finfo(float).eps * largest) / (2 * np.pi)


def test_two_beams_apart_are_a_clamped_free_and_a_free_free_beam(rig):
    structure = assemble(rig, layout=rig.layout(beam_elements=60), sensor_masses=False)
    K = structure.stiffness(0.0, 0.0)
    found = normal_modes(structure.M, K, 12).frequency_Hz
    assert np.all(found[:3] < zero_Hz(structure.M, K)), "the upper beam floats: three rigid-body modes"
    assert found[3] > 100 * zero_Hz(structure.M, K)
    expected = np.concatenate(
        [
            analytic(rig.lower, "clamped-free", 5),
            analytic(rig.upper, "free-free", 5),
            rod_frequencies(rig.lower, True, 1),
        ]
    )
    np.testing.assert_allclose(found[3:], np.sort(expected)[:9], rtol=2e-4)


def stepped_beam(rig, elements, stiffness_factor):
    """Clamped-free beam on one axis, `stiffness_factor` times as stiff and twice as heavy in the overlap."""
    beam, overlap = rig.lower, rig.joint.overlap
    EI, m = beam.youngs_modulus * beam.second_moment, beam.density * beam.area
    pieces = [(beam.length - overlap, 1.0, 1.0), (overlap, stiffness_factor, 2.0), (beam.length - overlap, 1.0, 1.0)]
    lengths = np.concatenate([np.full(elements, size / elements) for size, _, _ in pieces])
    size = 3 * (len(lengths) + 1)
    K, M = np.zeros((size, size)), np.zeros((size, size))
    for e, length in enumerate(lengths):
        _, k, mass = pieces[e // elements]
        at = np.ix_(*[3 * e + np.arange(6)] * 2)
        K[at] += beam_stiffness(EA=1e9, EI=k * EI, length=length)
        M[at] += beam_mass(mass_per_length=mass * m, length=length)
    bending = np.setdiff1d(np.arange(3, size), np.arange(3, size, 3))
    return K[np.ix_(bending, bending)], M[np.ix_(bending, bending)]


def test_beams_pressed_together_that_slide_freely_have_twice_the_stiffness_of_one(rig):
    structure = assemble(rig, sensor_masses=False, layout=rig.layout(beam_elements=60))
    pressed = structure.stiffness(1e15, 0.0)
    found = normal_modes(structure.M, pressed, 7).frequency_Hz
    K, M = stepped_beam(rig, 20, 2.0)
    expected = np.sqrt(eigh(K, M, eigvals_only=True)[:4]) / (2 * np.pi)
    assert found[0] < zero_Hz(structure.M, pressed), "the upper beam slides along the lower one"
    assert found[1] > 10 * zero_Hz(structure.M, pressed)
    distance = [np.min(np.abs(found / f - 1)) for f in expected]
    assert max(distance) < 1e-4


def test_bonded_beams_bend_statically_like_one_of_double_height(rig):
    """Tip deflection of the stepped cantilever, integral of moment^2 / EI, with 8 EI in the overlap."""
    L, a, b = rig.length, rig.lower.length - rig.joint.overlap, rig.lower.length
    cubes = [(L - x) ** 3 / 3 for x in (0.0, a, b, L)]
    exact = (cubes[0] - cubes[1] + (cubes[1] - cubes[2]) / 8 + cubes[2] - cubes[3]) / (
        rig.lower.youngs_modulus * rig.lower.second_moment
    )
    structure = assemble(rig, layout=rig.layout(beam_elements=28, layer_elements=4))
    tip = deflection(structure, L)
    excess = [tip @ np.linalg.solve(structure.stiffness(p, p), tip) / exact - 1 for p in (1e12, 1e13, 1e14, 1e15)]
    assert np.all(np.diff(excess) < 0), "a stiffer bond bends less"
    assert 0 < excess[-1] < 2e-5


def nodes(structure):
    """Coordinates of both beams' nodes, (k, 2)."""
    return np.concatenate([structure.meshes[name].points[:, :2] for name in ("lower", "upper")])


def one_beam(rig, elements):
    """The lower beam alone, with so many elements."""
    layout = rig.layout()
    lower = layout.beam("lower").model_copy(update={"elements": elements})
    return replace(layout, parts=(lower,), joints=(), stretches=layout.stretches[:1])


def test_frequencies_converge_with_the_fourth_power_of_the_element(rig):
    """Two beams apart: exact frequencies known, error ~ (element / wavelength)^4 for Hermite beams."""
    exact = analytic(rig.lower, "clamped-free", 3)[2]
    errors = []
    for elements in (1, 2, 4):
        layout = one_beam(rig, 5 * elements)
        structure = assemble(rig, layout=layout, sensor_masses=False)
        found = normal_modes(structure.M, structure.stiffness(0.0, 0.0), 12).frequency_Hz
        errors.append(np.min(np.abs(found / exact - 1)))
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(order, 4.0, atol=0.2)


def test_bonded_frequencies_from_the_shipped_mesh_are_converged(rig):
    def bending(layout):
        structure = assemble(rig, layout=layout)
        return normal_modes(structure.M, structure.stiffness(3.9e8, 7.6e7), 4).frequency_Hz

    coarse, fine = bending(None), bending(rig.layout(beam_elements=160, layer_elements=16))
    np.testing.assert_allclose(coarse, fine, rtol=2e-3)


def test_floating_structure_has_three_planar_rigid_body_modes_without_strain(rig):
    structure = assemble(rig, layout=replace(rig.layout(), supports=()), sensor_masses=False)
    x, y = nodes(structure).T
    along, across, turn = np.zeros((3, 3 * len(x)))
    along[0::3] = 1.0
    across[1::3] = 1.0
    turn[0::3], turn[1::3], turn[2::3] = -y, x, 1.0
    K = structure.stiffness(3.9e8, 7.6e7)
    for motion in (along, across, turn):
        assert np.linalg.norm(K @ motion) < 1e-9 * np.linalg.norm(K) * np.linalg.norm(motion)
    frequency = normal_modes(structure.M, K, 5).frequency_Hz
    assert np.all(frequency[:3] < zero_Hz(structure.M, K))
    assert frequency[3] > 50.0
    mass = sum(b.density * b.area * b.length for b in (rig.lower, rig.upper))
    assert along @ structure.M @ along == pytest.approx(mass, rel=1e-12)
    assert across @ structure.M @ across == pytest.approx(mass, rel=1e-12)


def test_sensor_masses_add_to_the_rigid_body_mass(rig):
    bare, full = (assemble(rig, layout=replace(rig.layout(), supports=()), sensor_masses=s) for s in (False, True))
    across = np.zeros(len(bare.M))
    across[1::3] = 1.0
    added = sum(s.mass for s in rig.sensor)
    assert across @ (full.M - bare.M) @ across == pytest.approx(added, rel=1e-12)


def test_stiffness_is_affine_in_the_moduli_and_of_low_rank(rig):
    structure = assemble(rig)
    K = structure.stiffness
    np.testing.assert_allclose(
        K(3e8, 5e7) - K(0, 0), 3 * (K(1e8, 0) - K(0, 0)) + 5 * (K(0, 1e7) - K(0, 0)), atol=1e-6 * np.abs(K(0, 0)).max()
    )
    elements, n = rig.joint.layer_elements, len(structure.M)
    assert np.linalg.matrix_rank(structure.joints[0].KE) <= 4 * elements < n / 4
    assert np.linalg.matrix_rank(structure.joints[0].KG) <= 3 * elements
    for part in (structure.K0, structure.joints[0].KE, structure.joints[0].KG):
        np.testing.assert_allclose(part, part.T, atol=1e-12 * np.abs(part).max())
        assert eigh(part, eigvals_only=True)[0] > -1e-9 * np.abs(part).max()


def test_uniform_opening_and_slip_store_the_energy_of_the_layers_material(rig):
    """Pull the upper beam off, then shift it along: energy = modulus x width x overlap x displacement^2 / (2 h)."""
    structure = assemble(rig, layout=replace(rig.layout(), supports=()))
    upper = np.repeat(np.arange(len(structure.basis) // 3) >= len(structure.meshes["lower"].s), 3)
    for dof, matrix in ((1, structure.joints[0].KE), (0, structure.joints[0].KG)):
        motion = np.where(upper & (np.arange(len(upper)) % 3 == dof), 1e-6, 0.0)
        expected = 25.4e-3 * 50e-3 / 6.36e-3 * 1e-12
        assert motion @ matrix @ motion == pytest.approx(expected, rel=1e-12)


def test_eigenvalue_sensitivity_agrees_with_finite_differences(rig):
    structure = assemble(rig)
    E, G = 3.9e8, 7.6e7
    modes = normal_modes(structure.M, structure.stiffness(E, G), 4)

    def eigenvalues(factor_E, factor_G):
        """omega^2 as 1 / the largest eigenvalues of the inverse problem, which keep all their digits."""
        mu = eigh(structure.M, structure.stiffness(factor_E * E, factor_G * G), eigvals_only=True)
        return 1 / mu[::-1][:4]

    def difference(direction, step=0.2):
        """Central differences, extrapolated twice, over steps wide enough to stand clear of rounding."""
        table = [
            (eigenvalues(*(1 + s * np.array(direction))) - eigenvalues(*(1 - s * np.array(direction)))) / (2 * s)
            for s in step * 0.5 ** np.arange(5)
        ]
        for k in range(1, 5):
            table = [fine + (fine - coarse) / (4**k - 1) for coarse, fine in pairwise(table)]
        return table[0]

    close = {"rtol": 1e-7, "atol": 1e-7 * modes.omega[0] ** 2}  # eigenvalues near 1e4 of a stiffness near 1e10
    np.testing.assert_allclose(
        E * eigenvalue_sensitivity(modes.Phi, structure.joints[0].B_E), difference((1, 0)), **close
    )
    np.testing.assert_allclose(
        G * eigenvalue_sensitivity(modes.Phi, structure.joints[0].B_G), difference((0, 1)), **close
    )


def test_deflection_and_slope_rows_follow_a_cubic_exactly(rig):
    structure = assemble(rig, layout=replace(rig.layout(), supports=()))
    x = nodes(structure)[:, 0]
    motion = np.zeros(3 * len(x))
    motion[1::3], motion[2::3], motion[0::3] = x**3 - x, 3 * x**2 - 1, 2 * x
    for position in (0.0, 0.05, 0.19, 0.235, 0.3, 0.42):
        assert deflection(structure, position) @ motion == pytest.approx(position**3 - position, abs=1e-12)
        assert slope(structure, position) @ motion == pytest.approx(3 * position**2 - 1, abs=1e-12)
        assert axial(structure, position) @ motion == pytest.approx(2 * position, abs=1e-12)
    with pytest.raises(ValueError, match="not on the structure"):
        deflection(structure, 0.43)


@pytest.mark.parametrize("weak", [(0.0, 0.004), (0.004, 0.013), (0.011, 0.02), (0.0, 0.02)])
@pytest.mark.parametrize("shear_ratio", [0.0, 3.1])
def test_an_element_weak_in_part_is_a_chain_of_sound_and_weak_ones(weak, shear_ratio):
    """Whole elements end to end, with their inner nodes condensed."""
    section, length, factor = {"EA": 3e7, "EI": 110.0, "shear_ratio": shear_ratio}, 0.02, 0.5
    x = np.unique([*np.linspace(0, length, 5), *weak])
    K = np.zeros((3 * len(x), 3 * len(x)))
    for i, (a, b) in enumerate(pairwise(x)):
        left = factor if weak[0] <= a and b <= weak[1] else 1.0
        K[3 * i : 3 * i + 6, 3 * i : 3 * i + 6] += left * beam_stiffness(**section, length=b - a)
    ends, inner = np.r_[:3, len(K) - 3 : len(K)], np.arange(3, len(K) - 3)
    carried = np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, ends)])
    expected = K[np.ix_(ends, ends)] - K[np.ix_(ends, inner)] @ carried
    found = weakened_stiffness(**section, length=length, weak=weak, factor=factor)
    assert found == pytest.approx(expected, abs=1e-9 * np.max(expected))
