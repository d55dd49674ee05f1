"""Eigensensitivity update: sensitivities, recovery, covariance, pairing, and what stays open."""

import numpy as np
import pytest

from studies.eigensensitivity import FrequencySet, Parameter, Pencil, pair_modes, update_parameters
from studies.identifiability import profile_likelihood, weak_directions
from studies.lap_joint_moduli import point_mass_effect, update_moduli
from twin.rigs import load_rig
from twin.structure import assemble, normal_modes, with_mass_at


def chain(springs=("k1", "k2", "k3", "k4"), extra=()):
    """Four masses in a row on four springs, the first to ground; parameters: the springs and the last mass."""

    def pencil(values):
        K, dK = np.zeros((4, 4)), {}
        for i, name in enumerate(springs):
            b = np.zeros(4)
            b[i] = 1.0
            if i:
                b[i - 1] = -1.0
            dK[name] = np.outer(b, b)
            K += values[name] * dK[name]
        dM = {"mass": np.diag([0.0, 0, 0, 1])}
        M = np.diag([1.0, 1.2, 0.8, 0.0]) + values["mass"] * dM["mass"]
        return Pencil(M, K, np.full(4, True), dM, dK)

    return pencil


TRUE = {"k1": 900.0, "k2": 2500.0, "k3": 1400.0, "k4": 3100.0, "mass": 0.7}


def frequencies(values):
    pencil = chain()(values)
    return normal_modes(pencil.M, pencil.K).frequency_Hz


def parameters(*names, factor=1.3):
    return [Parameter(name, TRUE[name] * factor) for name in names]


def partly(known):
    """The chain with some parameters known."""
    return lambda values: chain()({**known, **values})


def test_sensitivities_agree_with_finite_differences():
    f = frequencies(TRUE)
    names = tuple(TRUE)
    start = {name: value * 1.1 for name, value in TRUE.items()}
    update = update_parameters(
        [FrequencySet("a", f, 1e-3 * f, chain())], [Parameter(n, start[n], 1e9) for n in names], max_iterations=1
    )
    weighted = update.directions @ np.diag(update.singular_values**2) @ update.directions.T  # J'J at the start
    J = np.zeros((4, 5))
    step = 1e-3
    for k, name in enumerate(names):

        def log_frequency(s, name=name):
            return np.log(frequencies({**start, name: start[name] * np.exp(s)}))

        rough = [(log_frequency(s) - log_frequency(-s)) / (2 * s) for s in (step, step / 2)]
        J[:, k] = 1e3 * (rough[1] + (rough[1] - rough[0]) / 3)
    np.testing.assert_allclose(weighted, J.T @ J, rtol=1e-7, atol=1e-7 * np.abs(weighted).max())


def test_parameters_come_back_from_exact_frequencies_with_the_history_of_the_search():
    known = {"k3": TRUE["k3"]}
    f = frequencies(TRUE)
    free = parameters("k1", "k2", "k4", "mass", factor=1.5)
    update = update_parameters([FrequencySet("a", f, 1e-4 * f, partly(known))], free)
    assert update.converged
    for name in ("k1", "k2", "k4", "mass"):
        assert update.values[name] == pytest.approx(TRUE[name], rel=1e-5)
    assert update.history[0].values["k1"] == pytest.approx(1.5 * TRUE["k1"])
    objectives = [step.objective for step in update.history]
    assert objectives == sorted(objectives, reverse=True)
    assert update.worst_percent < 1e-6
    assert np.abs(update.before["a"] / f - 1).max() > 0.05


def test_standard_deviations_are_those_of_repeated_measurements():
    """250 noisy sets of frequencies: the scatter of the estimates is the predicted one, to its own sampling error."""
    generator = np.random.default_rng(3)
    f, known = frequencies(TRUE), {"k2": TRUE["k2"], "k3": TRUE["k3"], "k4": TRUE["k4"]}
    found, covariance, factor = [], None, []
    for _ in range(250):
        noisy = f * np.exp(2e-3 * generator.standard_normal(4))
        update = update_parameters(
            [FrequencySet("a", noisy, 2e-3 * noisy, partly(known))], parameters("k1", "mass", factor=1.05)
        )
        found.append(np.log([update.values["k1"], update.values["mass"]]))
        covariance = update.covariance
        factor.append(update.residual_factor**2)
    scatter = np.cov(np.array(found).T)
    np.testing.assert_allclose(scatter, covariance, rtol=0.3)
    assert np.mean(factor) == pytest.approx(1.0, abs=0.2), "residuals speak of the stated noise"


def test_a_prior_holds_what_frequencies_do_not_know():
    """Scaling all springs and the mass alike would need all masses; two frequencies leave two of four springs open."""
    f = frequencies(TRUE)
    item = FrequencySet("a", f[:1], 1e-3 * f[:1], partly({k: TRUE[k] for k in ("k2", "k3", "mass")}))
    free = [Parameter("k1", 900.0), Parameter("k4", 3500.0, prior_log_std=0.05)]
    update = update_parameters([item], free)
    assert update.std["k4"] / update.values["k4"] == pytest.approx(0.05, rel=0.05)
    assert update.values["k1"] == pytest.approx(TRUE["k1"], rel=5e-3)
    assert len(update.singular_values) == 2
    assert update.singular_values[1] == 0.0


def test_axial_modes_are_not_taken_for_bending_modes():
    rig = load_rig("steel-lap-joint")
    structure = assemble(rig)
    transverse = structure.counted
    K = structure.stiffness(3.9e8, 7.6e7)
    everything = normal_modes(structure.M, K, 8)
    kinetic = np.sum(
        everything.Phi[~transverse] * (structure.M[np.ix_(~transverse, ~transverse)] @ everything.Phi[~transverse]),
        axis=0,
    )
    axial = np.flatnonzero(kinetic > 0.5)
    assert len(axial) >= 1, "the rig has an axial mode in this range, or this test shows nothing"
    assert 900 < everything.frequency_Hz[axial[0]] < 1200
    omega, Phi = pair_modes(Pencil(structure.M, K, transverse), np.arange(1, 6))
    assert np.min(np.abs(omega / (2 * np.pi) - everything.frequency_Hz[axial[0]])) > 5.0
    assert Phi.shape == (len(K), 5)


def test_measured_shapes_pair_modes_that_changed_places():
    """Two uncoupled oscillators: fitting from the wrong side of their crossing needs the shapes."""

    def pencil(values):
        dK = {"k1": np.diag([1.0, 0.0]), "k2": np.diag([0.0, 1.0])}
        K = values["k1"] * dK["k1"] + values["k2"] * dK["k2"]
        return Pencil(np.eye(2), K, np.full(2, True), {}, dK)

    f = np.sqrt([100.0, 150.0]) / (2 * np.pi)
    start = [Parameter("k1", 220.0), Parameter("k2", 90.0)]
    common = {"name": "a", "frequency_Hz": f, "std_Hz": 1e-3 * f, "pencil": pencil}
    by_shape = update_parameters([FrequencySet(**common, shape_rows=np.eye(2), shapes=np.eye(2))], start)
    assert by_shape.values["k1"] == pytest.approx(100.0, rel=1e-6)
    by_number = update_parameters([FrequencySet(**common)], start)
    assert by_number.values["k1"] == pytest.approx(150.0, rel=1e-6)


def test_profile_of_a_well_determined_parameter_is_its_confidence_interval_and_of_an_open_one_is_open():
    f = frequencies(TRUE)
    known = {k: TRUE[k] for k in ("k2", "k3", "mass")}
    with_idle = FrequencySet("a", f, 1e-3 * f, lambda v: chain()({**known, "k1": v["k1"], "k4": v["k4"]}))
    free = [Parameter("k1", 950.0), Parameter("k4", 3000.0), Parameter("idle", 1.0)]
    update = update_parameters([with_idle], free)
    profile = profile_likelihood([with_idle], free, update, "k1")
    log_std = np.sqrt(update.covariance[0, 0])
    assert np.log(profile.upper / update.values["k1"]) == pytest.approx(1.96 * log_std, rel=0.03)
    assert np.log(update.values["k1"] / profile.lower) == pytest.approx(1.96 * log_std, rel=0.03)
    assert profile.determined
    idle = profile_likelihood([with_idle], free, update, "idle")
    assert not idle.determined
    assert (idle.lower, idle.upper) == (0.0, np.inf)
    last = weak_directions(update)[-1]
    assert set(last.combination) == {"idle"}
    assert last.relative_std > 1e6


def test_moduli_of_two_preloads_and_a_shared_mass_come_back_from_the_lap_joints_frequencies():
    rig = load_rig("steel-lap-joint")
    structure = assemble(rig)
    mass = point_mass_effect(structure, 0.3, name="extra", start_kg=0.002)
    heavier = with_mass_at(structure, structure.layout.place(0.3), 0.007)
    true = {"120N": (2.5e8, 6e7), "540N": (7e8, 3e7)}
    measured = {}
    for preload, moduli in true.items():
        pencil = Pencil(heavier.M, heavier.stiffness(*moduli), structure.counted)
        measured[preload] = pair_modes(pencil, np.arange(1, 6))[0] / (2 * np.pi)
    update = update_moduli(rig, measured, relative_std=1e-4, structure=structure, effects=[mass])
    assert update.values["extra"] == pytest.approx(0.007, rel=1e-3)
    for preload, (E, G) in true.items():
        assert update.values[f"normal_modulus[{preload}]"] == pytest.approx(E, rel=1e-3)
        assert update.values[f"shear_modulus[{preload}]"] == pytest.approx(G, rel=1e-2)


def test_frequencies_may_name_their_mode_and_leave_one_out():
    rig = load_rig("steel-lap-joint")
    structure = assemble(rig)
    pencil = Pencil(structure.M, structure.stiffness(3e8, 5e7), structure.counted)
    f = pair_modes(pencil, np.array([1, 2, 4]))[0] / (2 * np.pi)
    update = update_moduli(rig, {"120N": f}, numbers={"120N": np.array([1, 2, 4])}, structure=structure)
    assert update.values["normal_modulus[120N]"] == pytest.approx(3e8, rel=1e-2)
    assert update.worst_percent < 1e-2
