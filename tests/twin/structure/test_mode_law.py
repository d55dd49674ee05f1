"""A law of the layer's points and uniform moduli over a sensor's amplitude: the same mode, either way."""

import numpy as np
import pytest
from beam_rows import deflection
from scipy.linalg import eig

from studies.tables import load_study
from twin.joint import Curve, steel_loss, steel_softening
from twin.rigs import LawTable, LayerLawTable, load_rig, moduli_at
from twin.structure import assemble, layer_points
from twin.structure.law_of_mode import layer_law_of_mode
from twin.structure.law_table import layer_table
from twin.structure.mode_law import LayerModes, mode_functions
from twin.structure.modelled_rig import modelled_rig

STEEL = load_rig("steel-lap-joint")
MODULI = STEEL.joint.preload["120N"]


def reduced(rig, preload, channel):
    moduli, structure = rig.joint.preload[preload], assemble(rig)
    points = layer_points(structure, rig.joint.layer_elements)
    return LayerModes.of(
        structure, points, E=moduli.normal_modulus, G=moduli.shear_modulus, sensor=structure.row(rig.place_of(channel))
    )  # fmt: skip


def papers_law(study, preload):
    sweeps = load_study(study).sweeps
    law = sweeps.law[preload]
    g1, g2 = (np.polynomial.Polynomial(c) for c in (law.softening, law.loss))
    return g1, g2, sweeps.channel, sweeps.largest_amplitude_m


@pytest.mark.parametrize(
    ("study", "preload"),
    [("steel-lap-joint", "120N"), ("steel-lap-joint", "540N"), ("hybrid-joint", "9Nm"), ("hybrid-joint", "14Nm")],
)
def test_there_and_back_again(study, preload):
    g1, g2, channel, largest = papers_law(study, preload)
    modes = reduced(load_rig(study), preload, channel)
    law = layer_law_of_mode(modes, g1, g2, np.linspace(0.0, largest, 80))
    X = np.linspace(0.0, largest, 57)[1:]
    found = mode_functions(modes, law.softening, law.loss, X)
    np.testing.assert_allclose(found.softening, g1(X), atol=1e-3 * np.max(g1(X)))
    np.testing.assert_allclose(found.loss, g2(X), atol=1e-3 * np.max(g2(X)))
    assert np.max(law.softening.knots) == pytest.approx(np.max(found.motion_m[:, :3]), rel=1e-4)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_mode_by_a_dense_solver_has_the_same_frequency_damping_and_moduli(number):
    """All degrees of freedom at once, the points' moduli by the amplitudes that the shape itself has."""
    structure = assemble(STEEL)
    points = layer_points(structure, 3)
    modes = reduced(STEEL, "120N", "acc2")
    o, q = np.geomspace(1e-8, 2e-5, 30), np.geomspace(1e-8, 1e-5, 30)
    softening, loss = Curve(o, 2.5e8 * o / (o + 2e-6)), Curve(q, 9e8 * q**2 / (q**2 + 1e-12))
    # Mode 1 is asked for at 3 mm, where it opens the joint far; mode 2 opens it as far at less, and mode 3 slips so
    # much there that no uniform loss damps it as well (below).
    X = {1: 3e-3, 2: 2e-4, 3: 1.25e-5}[number]
    found = mode_functions(modes, softening, loss, np.linspace(0.0, X, 25), number=number)
    s = structure
    K = s.stiffness(MODULI.normal_modulus, MODULI.shear_modulus)
    linear = np.linalg.eigvals(np.linalg.solve(s.M, K)).real
    reference = np.sort(linear)[number - 1]
    k = np.concatenate([-softening(found.motion_m[-1, :3]) + 0j, 1j * loss(found.motion_m[-1, 3:])])
    values, vectors = eig(K + (points.rows.T * (points.weights * k)) @ points.rows, s.M)
    at = np.argmin(np.abs(values - found.eigenvalue[-1]))
    shape = vectors[:, at] / (deflection(s, 0.42) @ vectors[:, at]) * X * reference / abs(values[at])
    assert values[at] == pytest.approx(found.eigenvalue[-1], rel=1e-7)
    np.testing.assert_allclose(np.abs(points.rows @ shape), found.motion_m[-1], rtol=1e-4)
    uniform = K - found.softening[-1] * s.joints[0].KE + 1j * found.loss[-1] * s.joints[0].KG
    assert np.min(np.abs(eig(uniform, s.M, right=False) / values[at] - 1)) < 1e-7
    assert found.softening[-1] > 0.05 * MODULI.normal_modulus


def test_where_the_points_damp_a_mode_more_than_any_uniform_loss_there_are_no_moduli():
    modes = reduced(STEEL, "120N", "acc2")
    o, q = np.geomspace(1e-8, 2e-5, 30), np.geomspace(1e-8, 1e-5, 30)
    softening, loss = Curve(o, 2.5e8 * o / (o + 2e-6)), Curve(q, 9e8 * q**2 / (q**2 + 1e-12))
    found = mode_functions(modes, softening, loss, np.linspace(0.0, 1.7e-5, 25), number=3)
    grid = [(g1, g2) for g1 in np.linspace(-2e8, 1e8, 7) for g2 in np.geomspace(1e7, 2e8, 60)]
    most = max(modes.uniform(g1, g2, modes.linear(3)).value.imag for g1, g2 in grid)
    beyond = found.eigenvalue.imag > most
    assert 3 < np.sum(beyond) < 10
    assert np.all(np.isnan(found.softening[beyond]))
    assert np.all(np.isnan(found.loss[beyond]))
    assert np.all(np.isfinite(found.softening[found.eigenvalue.imag < 0.98 * most]))


def test_derivatives_by_the_laws_values_follow_the_amplitude():
    modes = reduced(STEEL, "120N", "acc2")
    o, q = np.geomspace(1e-8, 2e-5, 12), np.geomspace(1e-8, 1e-5, 12)
    X = np.linspace(0.0, 3e-3, 10)

    def at(share):
        return mode_functions(
            modes, Curve(o, share[0] * 2.5e8 * o / (o + 2e-6)), Curve(q, share[1] * 9e8 * q**2 / (q**2 + 1e-12)), X
        )

    here, step = at((1.0, 1.0)), 1e-4
    for half, changed in ((slice(0, 3), (1, 0)), (slice(3, 6), (0, 1))):
        up, down = (at([1 + side * step * one for one in changed]) for side in (1, -1))
        moduli = (Curve(o, 2.5e8 * o / (o + 2e-6)), Curve(q, 9e8 * q**2 / (q**2 + 1e-12)))[changed[1]]
        by_share = np.einsum("ngp,np->ng", here.by_moduli[:, :, half], moduli(here.motion_m[:, half]))
        expected = np.stack([up.softening - down.softening, up.loss - down.loss], axis=1) / (2 * step)
        np.testing.assert_allclose(by_share[1:], expected[1:], atol=2e-3 * np.max(np.abs(expected)))


def test_a_linear_joint_is_linear_either_way():
    modes, X = reduced(STEEL, "120N", "acc2"), np.linspace(0.0, 5e-3, 20)
    law = layer_law_of_mode(modes, np.zeros_like, np.zeros_like, X)
    np.testing.assert_allclose(law.softening.values, 0.0, atol=1e-5 * MODULI.normal_modulus)
    np.testing.assert_allclose(law.loss.values, 0.0, atol=1e-5 * MODULI.normal_modulus)
    back = mode_functions(modes, np.zeros_like, np.zeros_like, X, number=2)
    np.testing.assert_allclose(back.softening, 0.0, atol=1e-5 * MODULI.normal_modulus)
    np.testing.assert_allclose(back.loss, 0.0, atol=1e-5 * MODULI.normal_modulus)


def test_a_softening_that_passes_through_zero_under_a_large_loss_is_taken_as_it_is():
    """The loss moves the frequency a little there too: as a share of no softening, that would be beyond all bounds."""
    X = np.linspace(0.0, 4e-3, 60)
    law = layer_law_of_mode(
        reduced(STEEL, "120N", "acc2"), lambda x: -5.1282e7 * (1 + 1e-7) + 1e8 * x / 4e-3, lambda x: 4e8 + 0 * x, X
    )
    assert -8e7 < np.min(law.softening.values) < -5e7
    assert 5e7 < np.max(law.softening.values) < 8e7


def test_a_softening_that_leaves_the_layer_no_stiffness_is_refused():
    with pytest.raises(ValueError, match=r"joint\.law: "):
        layer_law_of_mode(
            reduced(STEEL, "120N", "acc2"), lambda x: 4.5e8 * x / 3e-3, np.zeros_like, np.linspace(0.0, 4e-3, 80)
        )


def with_law(law):
    return STEEL.model_copy(update={"joint": STEEL.joint.model_copy(update={"law": law})})


def test_a_hung_rig_keeps_no_rigid_motion_and_its_first_mode_is_elastic():
    rig = load_rig("hung-lap-joint")
    structure, moduli = assemble(rig), moduli_at(rig)[0]
    points = layer_points(structure, rig.joints[0].layer_elements)
    E, G = moduli.normal_modulus, moduli.shear_modulus
    modes = LayerModes.of(structure, points, E=E, G=G, sensor=structure.row(rig.place_of("acc2")))
    linear = modelled_rig(rig).modes
    np.testing.assert_allclose(np.sqrt(modes.squares[:4]), linear.omega[:4], rtol=1e-6)
    o = np.geomspace(1e-8, 1e-5, 30)
    softening, loss = Curve(o, 2e8 * o / (o + 2e-6)), Curve(o, 1e8 * o / (o + 1e-6))
    found = mode_functions(modes, softening, loss, np.linspace(0.0, 1e-4, 20))
    k = np.concatenate([-softening(found.motion_m[-1, :3]) + 0j, 1j * loss(found.motion_m[-1, 3:])])
    values = eig(structure.stiffness(E, G) + (points.rows.T * (points.weights * k)) @ points.rows, structure.M)[0]
    assert np.min(np.abs(values / found.eigenvalue[-1] - 1)) < 1e-6
    assert found.softening[-1] > 0.01 * E


def test_a_rig_file_of_either_form_has_a_law_of_the_layer():
    G = {"E": MODULI.normal_modulus, "G": MODULI.shear_modulus}
    assert layer_table(with_law(None), **G) is None
    own = LayerLawTable(opening_m=[0.0, 1e-6], softening=[0.0, 1e8], slip_m=[0.0, 1e-6], loss=[0.0, 1e8])
    assert layer_table(with_law(own), **G) is own
    borrowed, forces = layer_table(STEEL, **G), (steel_softening(G["E"]), steel_loss(G["E"]))
    np.testing.assert_allclose(borrowed.softening, -forces[0].describing_function(np.array(borrowed.opening_m)).real)
    np.testing.assert_allclose(borrowed.loss, forces[1].describing_function(np.array(borrowed.slip_m)).imag)
    X = np.geomspace(1e-5, 4e-3, 20)
    g1, g2 = 2e8 * X / (X + 2e-3), 3e8 * X / 4e-3
    old = {"channel": "acc1", "amplitude_m": X.tolist(), "softening": g1.tolist(), "loss": g2.tolist()}
    found = layer_table(with_law(LawTable(**old, softening_std=[1e6] * 20)), **G)
    back = mode_functions(
        reduced(STEEL, "120N", "acc1"), Curve(np.array(found.opening_m), np.array(found.softening)),
        Curve(np.array(found.slip_m), np.array(found.loss)), X,
    )  # fmt: skip
    # Less what the openings' own harmonics add to the softening in the first mode.
    np.testing.assert_allclose(back.softening, g1, atol=0.03 * g1[-1])
    assert np.max(np.abs(back.softening - g1)) > 2e-3 * g1[-1]
    np.testing.assert_allclose(back.loss, g2, atol=1e-3 * g2[-1])
    assert set(found.softening_std) == {1e6}
    assert found.loss_std == []
    with pytest.raises(ValueError, match="acc9"):
        layer_table(with_law(LawTable(**(old | {"channel": "acc9"}))), **G)
