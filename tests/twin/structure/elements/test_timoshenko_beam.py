"""Timoshenko elements against the exact frequency equation of the free-free Timoshenko beam."""

import numpy as np
import pytest
from scipy.optimize import brentq

from studies.shear_derivatives import timoshenko_mass_derivative, timoshenko_stiffness_derivative
from twin.rigs import load_rig
from twin.structure import assemble, normal_modes
from twin.structure.elements.beam import beam_mass, beam_stiffness


def exact_free_free(*, E, rho, length, height, shear_ratio, count):
    """Natural frequencies (Hz) by the determinant of the exact solution space, below the cut-off frequency.

    v = e^(kx) with  EI k^4 + w^2 (rho I + m s I/A) k^2 + (rho I m s / A ... ) from Timoshenko's two equations:
    kappa G A (v'' - theta') + m w^2 v = 0,  E I theta'' + kappa G A (v' - theta) + rho I w^2 theta = 0.
    """
    A, I = height, height**3 / 12
    S, m, r = E / shear_ratio * A, rho * A, rho * I

    def determinant(frequency):
        w2 = (2 * np.pi * frequency) ** 2
        a, b, c = E * I * S, S * r * w2 + E * I * m * w2, m * w2 * (r * w2 - S)
        k = np.sqrt(np.roots([a, b, c]).astype(complex))
        k = np.concatenate([k, -k])
        ratio = (S * k**2 + m * w2) / (S * k)  # theta / v
        rows = []
        for x in (0.0, length):
            shape = np.exp(k * (x - np.where(k.real > 0, length, 0.0)))  # scaled against overflow
            rows += [ratio * k * shape, (k - ratio) * shape]
        value = np.linalg.det(np.array(rows))
        return value / np.abs(k).prod() * k[0] * k[1]

    grid = np.linspace(20, 6000, 6000)
    values = np.array([determinant(f) for f in grid])
    values = values.real if np.abs(values.real).max() > np.abs(values.imag).max() else values.imag
    found = []
    for i in np.flatnonzero(values[:-1] * values[1:] < 0)[:count]:
        part = (
            (lambda f: determinant(f).real)
            if np.any(values == determinant(grid[i]).real)
            else (lambda f: determinant(f).imag)
        )
        found.append(brentq(part, grid[i], grid[i + 1]))
    return np.array(found)


def free_frequencies(*, E, rho, length, height, shear_ratio, elements):
    size = 3 * (elements + 1)
    K, M = np.zeros((size, size)), np.zeros((size, size))
    for e in range(elements):
        at = np.ix_(*[3 * e + np.arange(6)] * 2)
        piece = length / elements
        K[at] += beam_stiffness(EA=E * height, EI=E * height**3 / 12, length=piece, shear_ratio=shear_ratio)
        M[at] += beam_mass(mass_per_length=rho * height, radius2=height**2 / 12, length=piece, shear_ratio=shear_ratio)
    bending = np.setdiff1d(np.arange(size), np.arange(0, size, 3))
    return normal_modes(M[np.ix_(bending, bending)], K[np.ix_(bending, bending)], 6).frequency_Hz[2:]


@pytest.mark.parametrize("shear_ratio", [3.1, 16.0])
def test_free_free_frequencies_are_timoshenkos(shear_ratio):
    beam = {"E": 14.5e9, "rho": 1200.0, "length": 0.353, "height": 0.00885, "shear_ratio": shear_ratio}
    coarse, fine = (free_frequencies(**beam, elements=n) for n in (40, 80))
    exact = exact_free_free(**beam, count=4)
    np.testing.assert_allclose(fine, exact, rtol=3e-4)
    np.testing.assert_allclose(fine + (fine - coarse) / 3, exact, rtol=5e-6)  # Richardson: the error is second order


def test_error_falls_with_the_square_of_the_element():
    """The shear strain is constant in an element, so its error is of first order and the frequency's of second."""
    beam = {"E": 14.5e9, "rho": 1200.0, "length": 0.353, "height": 0.00885, "shear_ratio": 16.0}
    exact = exact_free_free(**beam, count=3)[2]
    errors = [abs(free_frequencies(**beam, elements=n)[2] / exact - 1) for n in (12, 24, 48)]
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.1)


def test_without_shear_it_is_rayleighs_beam():
    common = {"mass_per_length": 1.2, "length": 0.03}
    rayleigh, bending = beam_mass(**common), np.ix_([1, 2, 4, 5], [1, 2, 4, 5])
    rotary = np.array([[36.0, 3, -36, 3], [3, 4, -3, -1], [-36, -3, 36, -3], [3, -1, -3, 4]]) / 30
    rayleigh[bending] += 1.2 * 4e-6 / 0.03 * rotary * np.outer([1, 0.03, 1, 0.03], [1, 0.03, 1, 0.03])
    np.testing.assert_allclose(beam_mass(**common, radius2=4e-6, shear_ratio=0.0), rayleigh, rtol=1e-12)


def test_rigid_motions_carry_mass_and_moment_of_inertia():
    length, radius2 = 0.05, 6e-6
    M = beam_mass(mass_per_length=2.0, radius2=radius2, length=length, shear_ratio=9.0)
    across, turn = np.array([0, 1, 0, 0, 1, 0.0]), np.array([0, -length / 2, 1, 0, length / 2, 1.0])
    assert across @ M @ across == pytest.approx(2.0 * length)
    assert turn @ M @ turn == pytest.approx(2.0 * length * (length**2 / 12 + radius2))


def test_derivatives_by_the_shear_ratio_agree_with_finite_differences():
    EA, EI, length, s, step = 5e6, 3e1, 0.02, 7.0, 1e-3
    radius2 = EI / EA
    K = [beam_stiffness(EA=EA, EI=EI, length=length, shear_ratio=s + d) for d in (step, -step)]
    M = [beam_mass(mass_per_length=1.3, radius2=radius2, length=length, shear_ratio=s + d) for d in (step, -step)]
    dK = timoshenko_stiffness_derivative(EI=EI, radius2=radius2, length=length, shear_ratio=s)
    dM = timoshenko_mass_derivative(mass_per_length=1.3, radius2=radius2, length=length, shear_ratio=s)
    np.testing.assert_allclose((K[0] - K[1]) / (2 * step), dK, atol=1e-7 * np.abs(dK).max())
    np.testing.assert_allclose((M[0] - M[1]) / (2 * step), dM, atol=1e-6 * np.abs(dM).max())


def test_an_assembled_rig_takes_the_shear_ratio_of_its_beams():
    rig = load_rig("steel-lap-joint")
    soft = rig.model_copy(update={"upper": rig.upper.model_copy(update={"shear_ratio": 40.0})})
    structure = assemble(soft, layout=soft.layout(beam_elements=100), sensor_masses=False)
    found = normal_modes(structure.M, structure.stiffness(0.0, 0.0), 12).frequency_Hz
    expected = exact_free_free(E=198e9, rho=7880.0, length=0.235, height=0.00636, shear_ratio=40.0, count=2)
    for frequency in expected:
        assert np.min(np.abs(found / frequency - 1)) < 1e-3
