"""A rig whose file carries functions g1, g2 of a sensor's amplitude: the laws of opening and slip do the same."""

from __future__ import annotations

import numpy as np
import pytest
from full_elements import FullElements
from scipy.interpolate import PchipInterpolator

from recordings.streams import Excitation
from twin.bench import open_bench
from twin.joint import describing_function
from twin.rigs import LawTable, load_rig
from twin.structure import assemble, mesh_rig

RIG = load_rig("steel-lap-joint")
X = np.array([0.0, 5e-4, 1e-3, 2e-3, 3e-3, 4e-3])
G1 = 2.0e8 * X / (X + 2e-3)
G2 = 8.0e8 * (X / 4e-3) ** 2


def with_law(**change):
    table = LawTable(channel="acc2", amplitude_m=list(X), softening=list(G1), loss=list(G2)).model_copy(update=change)
    return RIG.model_copy(update={"joint": RIG.joint.model_copy(update={"law": table})})


@pytest.fixture(scope="module")
def built():
    return open_bench(with_law()).built


@pytest.fixture(scope="module")
def modes():
    """Mode 1 at each X with the table's moduli in the whole layer, by a dense solver: rms opening, slip and power."""
    moduli = RIG.joint.preload["120N"]
    s = assemble(RIG, mesh=mesh_rig(RIG, beam_elements=60, layer_elements=6))
    found = []
    for softening, loss in zip(G1, G2, strict=True):
        K = s.stiffness(moduli.normal_modulus - softening, moduli.shear_modulus) + 1j * loss * s.KG
        values, vectors = np.linalg.eig(np.linalg.solve(s.M, K))
        first = np.argmin(np.abs(values))
        shape = vectors[:, first] / (s.deflection(RIG.length) @ vectors[:, first])
        opening = np.linalg.norm(s.B_E @ shape) / np.linalg.norm(s.normal_weight)
        found.append((values[first], opening, np.linalg.norm(s.B_G @ shape) / np.linalg.norm(s.shear_weight)))
    return found


def test_describing_functions_return_the_tables_at_the_openings_and_slips_of_each_amplitude(built, modes):
    """Within what one force in the shape of linear mode 1 differs from a layer that softens as a whole."""
    value, opening, slip = (np.array(column) for column in zip(*modes, strict=True))
    amplitude = X * value[0].real / np.abs(value)
    softening = describing_function(built.law.normal.path, (amplitude * opening)[1:])
    np.testing.assert_allclose(-softening.real, G1[1:], rtol=0.03)
    np.testing.assert_allclose(softening.imag, 0.0, atol=1e-6 * G1[-1])
    # Slip where slip is least differs most: its loss goes with the square.
    np.testing.assert_allclose(built.law.loss.stiffness(amplitude * slip).imag[1:], G2[1:], rtol=0.05)


def test_a_softened_layer_opens_farther_than_its_linear_mode(built, modes):
    opening = [entry[1] for entry in modes]
    assert opening[-1] > 1.3 * opening[0]
    linear = describing_function(built.law.normal.path, X[1:] * built.opening_per_m)
    assert np.all(-linear.real < G1[1:]), "taken at the linear mode's opening the law would be softer than the table"


def test_a_softening_that_passes_through_zero_under_a_large_loss_is_taken_as_it_is(built):
    """The loss moves the frequency a little there too: as a share of no softening, that would be beyond all bounds."""
    amplitude = np.linspace(0.0, 4e-3, 30)
    softening = -5.1282e7 * (1 + 1e-7) + 1e8 * amplitude / 4e-3
    table = {"amplitude_m": list(amplitude), "softening": list(softening), "loss": [4e8] * 30}
    law = open_bench(with_law(**table)).built.law
    found = -describing_function(law.normal.path, amplitude[1:] * built.opening_per_m).real
    assert np.min(found) > -6e7
    assert 3e7 < np.max(found) < 6e7


def test_amplitudes_are_those_of_the_named_channel(built):
    middle = open_bench(with_law(channel="acc1")).built
    o = 1e-3 * built.opening_per_m
    # The same opening is a smaller amplitude at the middle, so the same table softens it less.
    assert -built.law.normal.stiffness(np.array(o)).real > -middle.law.normal.stiffness(np.array(o)).real


def test_a_law_that_no_passive_layer_has_is_refused():
    with pytest.raises(ValueError, match="tangent modulus negative"):
        open_bench(with_law(softening=list(3e8 * (X / 4e-3) ** 3)))


def test_a_resonance_has_the_height_that_the_tables_moduli_give_it():
    """Marched in time, against one linear solve of all finite elements at the amplitude that was reached."""
    bench = open_bench(with_law(), drive="force", noise=False, converter=False, sample_rate_Hz=2048)
    elements, rate = FullElements(RIG, "120N"), 2048
    for frequency in (25.8, 26.1, 26.4):
        bench.set_output(Excitation(kind="sine", amplitude_V=4.0, frequency_Hz=frequency))
        bench.read(12 * rate)
        acceleration = bench.read(rate).samples["acc2"].astype(float)
        w, t = 2 * np.pi * frequency, np.arange(rate) / rate
        marched = 2 * abs(np.mean(acceleration * np.exp(-1j * w * t))) / w**2
        reached = marched * (w / elements.omega[0]) ** 2
        g1, g2 = float(PchipInterpolator(X, G1)(reached)), float(PchipInterpolator(X, G2)(reached))
        assert marched == pytest.approx(abs(elements.receptance(w, g1, g2)) * 4.0, rel=0.01)
