"""A rig whose file carries the joint's law, over opening and slip or over a sensor's amplitude X: the bench acts so."""

from __future__ import annotations

import numpy as np
import pytest
from full_elements import FullElements
from scipy.interpolate import PchipInterpolator

from recordings.streams import Excitation
from twin.bench import BenchSetup, open_bench
from twin.joint import describing_function
from twin.rigs import LawTable, LayerLawTable, load_rig
from twin.structure.law_table import layer_table

RIG = load_rig("steel-lap-joint")
MODULI = RIG.joint.preload["120N"]
X = np.array([0.0, 5e-4, 1e-3, 2e-3, 3e-3, 4e-3])
G1 = 2.0e8 * X / (X + 2e-3)
G2 = 8.0e8 * (X / 4e-3) ** 2
OPENING, SLIP = np.geomspace(1e-7, 1e-5, 25), np.geomspace(1e-8, 4e-6, 30)


def rig_of(law):
    return RIG.model_copy(update={"joint": RIG.joint.model_copy(update={"law": law})})


def with_law(**change):
    table = LawTable(channel="acc2", amplitude_m=list(X), softening=list(G1), loss=list(G2)).model_copy(update=change)
    return rig_of(table)


@pytest.fixture(scope="module")
def built():
    return open_bench(with_law()).built


def layer_law(softening, loss):
    return LayerLawTable(opening_m=list(OPENING), softening=list(softening), slip_m=list(SLIP), loss=list(loss))


def test_describing_functions_return_a_table_over_opening_and_slip():
    softening, loss = 3e8 * OPENING / (OPENING + 2e-6), 2e9 * SLIP**2 / (SLIP**2 + 1e-12)
    law = open_bench(rig_of(layer_law(softening, loss))).built.laws[0]
    # The force's table is too coarse for the least openings.
    found = describing_function(law.normal.force_history, OPENING[2:])
    np.testing.assert_allclose(-found.real, softening[2:], atol=1e-3 * softening[-1])
    np.testing.assert_allclose(found.imag, 0.0, atol=1e-6 * softening[-1])
    np.testing.assert_allclose(law.loss.describing_function(SLIP[5:]).imag, loss[5:], atol=1e-3 * loss[-1])


def test_every_point_of_the_layer_has_its_own_opening_and_slip():
    one = open_bench(rig_of(layer_law(3e8 * OPENING / (OPENING + 2e-6), 0 * SLIP))).built
    assert one.locals == 2 * RIG.joint.layer_elements
    assert len({element.scale for element in one.elements_ if not element.velocity}) == 1


def test_a_table_over_an_amplitude_is_taken_in_its_translation(built):
    table = layer_table(with_law(), E=MODULI.normal_modulus, G=MODULI.shear_modulus)
    opening, slip = np.array(table.opening_m)[20:], np.array(table.slip_m)[20:]
    found = describing_function(built.laws[0].normal.force_history, opening)
    np.testing.assert_allclose(-found.real, table.softening[20:], atol=2e-3 * max(table.softening))
    np.testing.assert_allclose(
        built.laws[0].loss.describing_function(slip).imag, table.loss[20:], atol=2e-3 * max(table.loss)
    )


def test_amplitudes_are_those_of_the_named_channel(built):
    middle = open_bench(with_law(channel="acc1")).built
    o = np.array(1e-6)
    # The same opening is a smaller amplitude at the middle, so the same table softens it less.
    assert -built.laws[0].normal.describing_function(o).real > -middle.laws[0].normal.describing_function(o).real


def test_a_channel_that_the_rig_has_not_is_refused():
    with pytest.raises(ValueError, match="acc7"):
        open_bench(with_law(channel="acc7"))


def test_a_law_that_no_passive_layer_has_is_refused():
    with pytest.raises(ValueError, match="tangent modulus negative"):
        open_bench(with_law(softening=list(3e8 * (X / 4e-3) ** 3)))
    with pytest.raises(ValueError, match="tangent modulus negative"):
        open_bench(rig_of(layer_law(3.8e8 * OPENING**4 / (OPENING**4 + 1e-24), 0 * SLIP)))


def test_a_resonance_has_the_height_that_the_tables_moduli_give_it():
    """Marched in time, against one linear solve of all finite elements at the amplitude that was reached."""
    bench = open_bench(with_law(), sample_rate_Hz=2048, setup=BenchSetup(drive="force", noise=False, converter=False))
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
