"""Moduli of a layer from natural frequencies alone: those that made the frequencies come back, from wherever."""

import numpy as np
import pytest
from scipy.linalg import eigh

from recordings import FrequencyTable
from twin.identify.frequency_moduli import fit_moduli, moduli_data
from twin.rigs import load_rig, moduli_at
from twin.structure import assemble


def bending_Hz(structure, E, G, numbers):
    """Bending frequencies by all modes of the matrices, more than half of whose kinetic energy is transverse."""
    values, Phi = eigh(structure.stiffness(E, G), structure.M)
    t = structure.counted
    part = np.einsum("im,im->m", Phi[t], structure.M[np.ix_(t, t)] @ Phi[t])
    return np.sqrt(values[part > 0.5])[numbers - 1] / (2 * np.pi)


def table(numbers, frequency_Hz):
    count = len(numbers)
    return FrequencyTable(
        path="f.csv", mode=numbers, frequency_Hz=frequency_Hz, std_Hz=np.full(count, np.nan), preload=("",) * count,
        line=np.arange(2, count + 2),
    )  # fmt: skip


@pytest.mark.parametrize(("E", "G"), [(1e8, 1e7), (6e8, 1.2e8), (2e8, 3e8)])
def test_moduli_come_back_though_an_axial_mode_veers_through_the_measured_ones(E, G):
    rig, numbers = load_rig("steel-lap-joint"), np.arange(1, 6)
    measured = bending_Hz(assemble(rig), E, G, numbers)
    found = fit_moduli(moduli_data(table(numbers, measured), rig, source="steel", preload="120N"))
    assert found.moduli["normal_modulus[120N]"] == pytest.approx(E, rel=1e-2)
    assert found.moduli["shear_modulus[120N]"] == pytest.approx(G, rel=1e-2)
    assert np.max(np.abs(found.error_percent)) < 1e-2
    assert moduli_at(found.model, "120N")[0].shear_modulus == pytest.approx(G, rel=1e-2)
    assert np.max(np.abs(found.before_Hz / measured - 1)) > 1e-3


def test_frequencies_may_name_their_mode_and_leave_one_out():
    rig, numbers = load_rig("steel-lap-joint"), np.array([1, 2, 4])
    measured = bending_Hz(assemble(rig), 3e8, 5e7, numbers)
    found = fit_moduli(moduli_data(table(numbers, measured), rig, source="steel", preload="120N"))
    assert found.moduli["normal_modulus[120N]"] == pytest.approx(3e8, rel=1e-2)
    assert [std for std, _ in found.directions()] == sorted(std for std, _ in found.directions())
