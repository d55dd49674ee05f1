"""Two lap joints in one fit: each has its own moduli and law, told apart by how the modes share them out."""

from dataclasses import replace

import numpy as np
import pytest

from twin.identify.base_fit import fit_base
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward import forward_model
from twin.identify.forward.broadband_response import broadband_response
from twin.identify.forward.predict import RigResponse, blank_data
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import Output, build_linear_model, nominal_parameters
from twin.identify.measured_data import HARMONICS
from twin.identify.model_modification import ModelModification
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.nonlinear.opening_harmonics import balance_openings
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.updated_rig import updated_rig
from twin.rigs import load_rig, preload_name
from twin.structure import layer_points

RIG = load_rig("two-lap-joints")
CHANNELS = ("acc1", "acc2")
KNOTS = np.geomspace(1e-8, 1e-5, 30)
BAND_Hz = np.geomspace(10.0, 600.0, 120)


def law(softening, loss, reach_m=1.5e-6):
    """A layer that loses stiffness as it opens, and energy as it slips."""
    return LayerLaw(KNOTS, KNOTS, softening * KNOTS / (KNOTS + reach_m), loss * (KNOTS / 1e-6) ** 1.2)


LAWS = law(1.5e8, 2e8), law(3.5e8, 5e7, 4e-6)


@pytest.fixture(scope="module")
def model():
    return build_linear_model(RIG, [Output(channel, "acceleration", RIG.place_of(channel)) for channel in CHANNELS])


@pytest.fixture(scope="module")
def base():
    nominal = nominal_parameters(RIG)
    return replace(
        nominal, E=nominal.E * [1.06, 0.95], G=nominal.G * [0.97, 1.05], loss_E=np.array([0.01, 0.02]),
        loss_G=np.array([0.03, 0.01]), zeta=nominal.zeta * 1.1,
    )  # fmt: skip


def dense_field(model, base, omega, loads, held=0.0):
    """Displacements (f, l, n) under loads (l, n) by solving the whole structure at each frequency."""
    s, modes = model.structure, model.basis
    count = len(base.zeta)
    zeta = np.concatenate([base.zeta, modes.zeta[count:]])
    MPhi = s.M @ modes.Phi
    C = MPhi @ np.diag(2 * zeta * modes.omega) @ MPhi.T
    K = s.K0 + held
    for joint, E, G, loss_E, loss_G in zip(s.joints, base.E, base.G, base.loss_E, base.loss_G, strict=True):
        K = K + E * (1 + 1j * loss_E) * joint.KE + G * (1 + 1j * loss_G) * joint.KG
    return np.array([np.linalg.solve(K + 1j * w * C - w**2 * s.M, loads.T).T for w in omega])


def dense_steps(model, base, omega, tip_m):
    """Accelerances (f, o) and motion (f, 12) of both joints' points where the last sensor moves by `tip_m` (f,)."""
    s = model.structure
    points = [layer_points(s, joint.layer_elements, joint=n) for n, joint in enumerate(RIG.joints)]
    outputs = np.array([s.row(RIG.place_of(channel)) for channel in CHANNELS])
    drive = s.row(RIG.drive_place)
    H, moved = [], []
    for w, tip in zip(omega, tip_m, strict=True):
        amplitude = [np.zeros(6), np.zeros(6)]
        for _ in range(400):
            held = np.zeros(s.M.shape, complex)
            for p, own, size in zip(points, LAWS, amplitude, strict=True):
                k = p.weights * np.concatenate([-own.softening_at(size[:3]), 1j * own.loss_at(size[3:])])
                held = held + p.rows.T @ (k[:, None] * p.rows)
            x = dense_field(model, base, [w], drive[None], held)[0, 0]
            x = x / abs(outputs[-1] @ x)
            last, amplitude = (
                amplitude,
                [0.5 * (a + np.abs(p.rows @ x) * tip) for p, a in zip(points, amplitude, strict=True)],
            )
            if max(np.max(np.abs(a - b)) for a, b in zip(last, amplitude, strict=True)) < 1e-16:
                break
        x = dense_field(model, base, [w], drive[None], held)[0, 0]
        H.append(-(w**2) * (outputs @ x))
        moved.append(np.concatenate(amplitude))
    return np.array(H), np.array(moved)


@pytest.fixture(scope="module")
def swept(model, base):
    """Frequencies about the first two modes, the tip's motion there, accelerances and the points' motion."""
    first, second = model.basis.omega[:2]
    shape = 1.0 / np.sqrt(1.0 + np.linspace(-3.0, 3.0, 13) ** 2)
    omega = np.concatenate([np.tile(w * np.linspace(0.985, 1.005, 13), 3) for w in (first, second)])
    tip = np.concatenate([level * shape for levels in ((1e-4, 4e-4, 1e-3), (5e-6, 2e-5, 5e-5)) for level in levels])
    return omega, tip, *dense_steps(model, base, omega, tip)


@pytest.fixture
def evidence(build, model, base, swept, monkeypatch):
    """Exact; the openings have no harmonics of their own, here or in the fit."""
    monkeypatch.setattr(forward_model, "HARMONIC_TURNS", 0)
    omega, tip, H, _ = swept
    response = H * (omega**2 * tip / np.abs(H[:, -1]))[:, None]
    force = response[:, -1] / H[:, -1]
    steps = build.steps(omega, force[:, None], response[:, :, None])
    x = dense_field(model, base, 2 * np.pi * BAND_Hz, model.ports.rows[model.ports.drive][None])[:, 0]
    bins = -((2 * np.pi * BAND_Hz[:, None]) ** 2) * (x @ model.ports.rows[model.ports.outputs].T)
    covariance = np.tile(1e-7 * np.eye(2) + 0j, (len(BAND_Hz), 1, 1))
    steel = build.evidence(model, steps, [build.bins(BAND_Hz, bins, covariance)])
    return replace(steel, rig=RIG, preload=preload_name(RIG))


def test_each_joint_follows_its_own_law(evidence, base, swept):
    """As the whole structure solved anew until each point's stiffness is that of its own amplitude."""
    residual_model = ResidualModel(evidence)
    R, omega, balance = residual_model.step_receptance(BaselineParameters(base, LAWS), inner=False)
    _, _, H, moved = swept
    np.testing.assert_allclose(residual_model.responses(R, omega), H, rtol=2e-5)
    opening, slip = moved[:, [0, 1, 2, 6, 7, 8]], moved[:, [3, 4, 5, 9, 10, 11]]
    np.testing.assert_allclose(np.abs(balance.motion), np.concatenate([opening, slip], axis=1), rtol=1e-3)
    exchanged = residual_model.step_receptance(BaselineParameters(base, LAWS[::-1]), inner=False)[0]
    assert np.max(np.abs(residual_model.responses(exchanged, omega) / H - 1)) > 0.02


def test_sensitivities_are_derivatives_for_both(evidence, base):
    """Of every kind of unknown, of each joint."""
    baseline, residual_model = BaselineParameters(base, LAWS), ResidualModel(evidence)
    residual_model = ResidualModel(evidence, held=residual_model.linearisation(baseline))
    J = residual_model.evaluate(baseline).jacobian
    blocks, vector = baseline.blocks, baseline.vector
    looked = [blocks[name].start + j for name in ("log_E", "log_G", "loss_E", "loss_G") for j in (0, 1)]
    looked += [part.start + 22 for j in (0, 1) for part in (baseline.softening(j), baseline.loss(j))]
    for entry in looked:
        step = (1e-5 if entry < baseline.of_laws.start else 1e-2) * max(abs(vector[entry]), 0.1)

        def residual(shift, entry=entry):
            moved = vector.copy()
            moved[entry] += shift
            return residual_model.evaluate(baseline.with_vector(moved), sensitivities=False).residual

        numeric = -(residual(step) - residual(-step)) / (2 * step)
        assert np.max(np.abs(J[:, entry] - numeric)) < 1e-3 * np.max(np.abs(J[:, entry])), entry


def test_both_joints_moduli_and_laws_come_back(evidence, base, swept):
    """From what is assumed of them, without noise; as far as the points moved."""
    fit = fit_base(evidence)
    baseline, solution = fit.baseline, fit.solution
    assert solution.chi2 < 0.02 * len(solution.residual)
    std = baseline.blocks.unpack(np.sqrt(np.diag(solution.covariance)))
    assert np.all(np.abs(np.log(baseline.base.E / base.E)) < np.maximum(2 * std["log_E"], 3e-3))
    assert np.all(np.abs(np.log(baseline.base.G / base.G)) < np.maximum(2 * std["log_G"], 3e-3))
    moved = swept[3]
    for joint, (found, true) in enumerate(zip(baseline.laws, LAWS, strict=True)):
        most = moved[:, 6 * joint : 6 * joint + 3].max(), moved[:, 6 * joint + 3 : 6 * joint + 6].max()
        opening, slip = (np.geomspace(0.2, 0.95, 10) * largest for largest in most)
        E = baseline.base.E[joint] - found.softening_at(opening)
        np.testing.assert_allclose(E, base.E[joint] - true.softening_at(opening), rtol=0.02)
        assert np.max(np.abs(found.loss_at(slip) - true.loss_at(slip))) < 0.05 * true.loss_at(slip).max()
    # A rig file has no place for these.
    blocks = baseline.blocks
    without = np.r_[blocks["loss_E"], blocks["frequency_discrepancy"]]
    fit = fit_base(evidence, start=baseline, held_at_zero=without)
    baseline, solution = fit.baseline, fit.solution
    written = updated_rig(evidence, baseline, solution)
    for joint, E in zip(written.joints, baseline.base.E, strict=True):
        assert joint.preload[evidence.preload].normal_modulus == pytest.approx(E)
        assert joint.law is not None
    # The file's laws predict what was measured: each on its joint.
    omega, tip, H, _ = swept
    response = RigResponse(blank_data(written, evidence.preload), channel="acc2", own_harmonics=False)
    held = response.held(omega / (2 * np.pi), omega**2 * tip)
    np.testing.assert_allclose(held.force_N, omega**2 * tip / np.abs(H[:, -1]), rtol=0.01)


def test_what_acts_on_one_joint_leaves_the_other_alone(evidence, base):
    """Half of the inner joint's moduli by an extension is half of them in the base parameters; a drift is its own."""
    baseline = BaselineParameters(base, LAWS)
    halved = ResidualModel(evidence, ModelModification(moduli_factor={"inner": (0.5, 0.5)}))
    other = replace(base, E=base.E * [0.5, 1.0], G=base.G * [0.5, 1.0])
    there = broadband_response(ResidualModel(evidence), evidence.broadband[0], BaselineParameters(other, LAWS))
    np.testing.assert_allclose(broadband_response(halved, evidence.broadband[0], baseline), there, rtol=1e-9)
    drifting = ResidualModel(evidence, ModelModification(layer_drift_per_s={"outer": 1e-3}))
    left = drifting.normal_left(np.array([0.0, 100.0]))
    np.testing.assert_allclose(left, [[1.0, 1.0], [1.0, 0.9]])
    changed = drifting.moduli_changes(base, np.array([100.0]))[0][0]
    np.testing.assert_allclose(changed, [0.0, -0.1 * base.complex_E[1]])


def test_odd_harmonics_may_be_shared_out_among_the_joints_otherwise_than_foretold(build, evidence, base, swept):
    """Within the errors of the law's time form, which a channel sees undiminished where the joints' shares cancel."""
    generator, baseline = np.random.default_rng(5), BaselineParameters(base, LAWS)
    omega, tip, H, _ = swept
    alone = np.zeros((len(omega), HARMONICS), complex)
    alone[:, 0] = omega**2 * tip / np.abs(H[:, -1])
    steps = build.steps(omega, alone, H[:, :, None] * alone[:, None])
    quiet = replace(steps, response_variance=1e-12 * steps.response_variance, force_variance=0 * steps.force_variance)
    model = ResidualModel(replace(evidence, steps=quiet))
    balance = model.step_receptance(baseline, inner=False)[2]
    around = [model.at_harmonic(order, baseline, balance) for order in model.orders]
    each = (
        model.read_of_openings(around)
        * balance_openings(LAWS, model.openings(baseline, balance, around)).force[:, :, None]
    )
    drawn = generator.standard_normal((2, *each[:, :, :1].shape))
    error = np.array(LIMITS.share_error)[:, None, None] * (drawn[0] + 1j * drawn[1]) / np.sqrt(2)

    def misfit(times):
        """Mean square of the whitened harmonics, with so many times the error."""
        response = model.evidence.steps.response.copy()
        response[:, :, np.array(model.orders) - 1] = np.moveaxis(np.sum((1 + times * error) * each, axis=3), 1, 2)
        seen = replace(model.evidence, steps=replace(model.evidence.steps, response=response))
        harmonics = harmonic_residuals(ResidualModel(seen), baseline)
        return np.mean(harmonics.whiten(harmonics.residual, harmonics.whitening(1.0)) ** 2)

    assert misfit(1.0) < 1.0
    assert misfit(10.0) > 10 * misfit(1.0)
