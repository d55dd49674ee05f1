"""Residuals of all evidence against a dense solution, their sensitivities against finite differences."""

from dataclasses import replace

import numpy as np
import pytest
from beam_rows import deflection
from swept import SWEPT, BAND_Hz

from twin.identify.forward.broadband_response import broadband_response
from twin.identify.frequency_shifts import SHIFT
from twin.identify.model_modification import Attachment, ModelModification, NonlinearForce
from twin.identify.nonlinear import local_forces
from twin.identify.residuals.error_model import SOUND
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.residual_model import ResidualModel
from twin.structure import layer_points

pytestmark = pytest.mark.usefixtures("fundamentals_alone")


def steps_sizes(baseline, residual_model):
    """Steps of the differences: a part of what each unknown may be wrong by."""
    _, precision = residual_model.prior(baseline)
    size = 0.02 / np.sqrt(np.diag(precision))
    size[:2], size[2:4], size[4:9], size[9:14] = 2e-3, 1e-3, 2e-2, 2e-5
    size[14:] = 1e-2 * np.abs(baseline.vector[14:]).max()
    return size


def differences(residual_model, baseline, entry, step):
    """Central differences of the residual, extrapolated twice (Romberg)."""

    def residual(shift):
        vector = baseline.vector.copy()
        vector[entry] += shift
        return residual_model.evaluate(baseline.with_vector(vector), sensitivities=False).residual

    a, b, c = ((residual(h) - residual(-h)) / (2 * h) for h in (step, step / 2, step / 4))
    ab, bc = (4 * b - a) / 3, (4 * c - b) / 3
    return (16 * bc - ab) / 15


def compare(residual_model, baseline, blocks=("broadband 0", "steps"), *, nothing=1e-9):
    """Largest error of each analytic column, beside the column's own largest entry, block by block.

    Changes of the residual by less than `nothing` do not count.
    """
    found = residual_model.evaluate(baseline)
    where = dict(found.blocks)
    errors = {block: [] for block in blocks}
    for entry, step in enumerate(steps_sizes(baseline, residual_model)):
        numeric = -differences(residual_model, baseline, entry, step)
        for block in blocks:
            analytic, expected = found.jacobian[where[block], entry], numeric[where[block]]
            size = max(np.max(np.abs(analytic)), np.max(np.abs(expected)))
            errors[block].append(np.max(np.abs(analytic - expected)) / (size + nothing / step))
    return {block: np.array(values) for block, values in errors.items()}


def test_evidence_of_the_model_itself_leaves_nothing(evidence, baseline):
    """The dense structure with the same law: what is left is truncation, far below the model error it is given."""
    found = ResidualModel(evidence).evaluate(baseline)
    assert [name for name, _ in found.blocks] == ["broadband 0", "steps"]
    assert len(found.residual) == 4 * (len(BAND_Hz) + len(evidence.steps)) == len(found.jacobian)
    assert np.max(np.abs(found.residual)) < 0.02
    assert found.chi2 == pytest.approx(np.sum(found.residual**2))


@pytest.mark.parametrize("from_force", [True, False])
def test_the_law_goes_by_the_motion_not_by_what_leaks_into_its_channel(evidence, baseline, from_force):
    """Below a resonance the leak adds to the reading, above it takes away; the joint knows nothing of that."""
    steps, here, part = evidence.steps, evidence.reference, 0.4
    source, leak = (evidence.force, steps.force) if from_force else ("acc1", steps.response[:, 0])
    response = steps.response.copy()
    response[:, here, 0] += part * leak[:, 0]
    read = np.abs(response[:, here, 0] / steps.response[:, here, 0])
    steps = replace(steps, response=response, amplitude_m=read * steps.amplitude_m)
    modification = ModelModification(cross_talk=((evidence.channels[here], source, part),))
    found = ResidualModel(replace(evidence, steps=steps), modification).evaluate(baseline)
    assert np.max(np.abs(found.residual[dict(found.blocks)["steps"]])) < 0.02


def test_every_sensitivity_is_the_derivative_of_the_residual(evidence, baseline):
    """Where nothing is left over, so that the whitening's own change with the unknowns does not count."""
    residual_model = ResidualModel(evidence)
    errors = compare(residual_model, baseline)
    assert np.max(errors["broadband 0"]) < 1e-5
    assert np.max(errors["steps"]) < 2e-4


def test_shifts_of_the_run_and_the_sweep_have_their_sensitivities(evidence, baseline):
    """But for the whitening's own change with them, and for modes beyond the damped ones."""
    residual_model, shifted = ResidualModel(evidence), replace(baseline, shifts=np.array([0.5, -1.0]))
    found = residual_model.evaluate(shifted)
    for own, other in ((0, "steps"), (1, "broadband 0")):
        entry = shifted.blocks["shifts"].start + own
        analytic, numeric = found.jacobian[:, entry], -differences(residual_model, shifted, entry, 0.02)
        assert np.max(np.abs(analytic - numeric)) < 0.01 * np.max(np.abs(numeric))
        assert not np.any(analytic[dict(found.blocks)[other]])


@pytest.mark.parametrize("widths", [0.01, 0.3])
def test_a_shift_of_a_sweep_is_exact_however_large(evidence, baseline, steel_dense, swept, widths):
    """The dense structure's resonances lie off by parts of their width, which first order would miss by its square."""
    omega, tip, _, _ = swept
    off = widths * baseline.base.zeta[0]
    moved = replace(baseline.base, frequency_discrepancy=baseline.base.frequency_discrepancy + off)
    H, _ = steel_dense.with_law(omega, tip, moved, baseline.laws[0])
    force = (tip * omega**2 / np.abs(H[:, 1]))[:, None] * evidence.steps.force / evidence.steps.force[:, :1]
    response = evidence.steps.response.copy()
    response[:, :, 0] = H * force[:, :1]
    there = replace(evidence, steps=replace(evidence.steps, response=response, force=force))
    shifts = np.array([0.0, off / SHIFT]), np.zeros(2)
    found = [ResidualModel(there).evaluate(replace(baseline, shifts=each)) for each in shifts]
    left, unshifted = (each.residual[dict(each.blocks)["steps"]] for each in found)
    assert np.max(np.abs(left)) < 5e-3 * np.max(np.abs(unshifted)) + 0.02


@pytest.mark.parametrize("around_Hz", [26.3, 156.0], ids=["mode-1", "mode-2"])
def test_sensitivities_are_exact_with_what_a_fit_holds(
    build, steel_model, steel_dense, baseline, monkeypatch, around_Hz
):
    """The whitening, and what the layer's harmonics add; responses are then anything, and the harmonics are there.

    A stiffness follows its port's amplitude by the implicit function theorem.
    """
    monkeypatch.undo()
    # What a balance leaves would else be seen in columns that hardly matter.
    monkeypatch.setattr(local_forces, "NEWTON", local_forces.NEWTON._replace(settled=1e-13))
    omega = 2 * np.pi * around_Hz * np.linspace(0.98, 1.02, 21)
    tip = np.full(21, 1.5e-3) * (26.3 / around_Hz) ** 1.7
    H, _ = steel_dense.with_law(omega, tip, baseline.base, baseline.laws[0])
    force = (tip * omega**2 / np.abs(H[:, 1]))[:, None] * np.array([1.05, 1.0])
    steps = build.steps(omega, force[:, :1], (H * force)[:, :, None])
    evidence = build.evidence(steel_model, steps)
    held = ResidualModel(evidence).linearisation(baseline)
    assert np.max(np.abs(held.balance.more)) > 1e-3 * np.max(np.abs(held.balance.stiffness[:, :3]))
    assert np.max(held.balance.unsettled) < 1e-9
    errors = compare(ResidualModel(evidence, held=held), baseline, blocks=("steps",), nothing=1e-4)["steps"]
    assert np.max(errors) < 1e-6


def explained(evidence, baseline, modification):
    """The same evidence with responses as the extended model has them at the motion of the reference."""
    residual_model, steps, data = ResidualModel(evidence, modification), evidence.steps, evidence.broadband[0]
    R, omega, _ = residual_model.step_receptance(baseline)
    H = residual_model.responses(R, omega)
    response, force = steps.response.copy(), steps.force.copy()
    force[:, 0] = response[:, 1, 0] / H[:, 1]
    response[:, 0, 0] = H[:, 0] * force[:, 0]
    data = replace(data, H=broadband_response(residual_model, data, baseline))
    return replace(evidence, steps=replace(steps, response=response, force=force), broadband=(data,))


MASS = Attachment(lambda s: deflection(s, 0.35)[None], lambda omega: -(omega[:, None] ** 2) * 0.01 + 0j)
DELAYED = {"acc1": lambda omega: 1.1 * np.exp(-1e-5j * omega), "force": lambda omega: 1.05 + 0j * omega}
TIP_SPRING = NonlinearForce(lambda s: deflection(s, 0.42), lambda a, omega: 1e8 * 0.75 * a**2 + 0j, None)
SPRING_ELSEWHERE = NonlinearForce(lambda s: deflection(s, 0.30), lambda a, omega: 3e9 * a**2 * (1 + 0.1j), None)


def slip_row(s):
    """A strain of the layer, which moves far more with the layer's stiffness than any place on the beams does."""
    return s.joints[0].B_G[3] / np.linalg.norm(s.joints[0].B_G[3])


SLIDING = NonlinearForce(slip_row, lambda a, omega: 3e8 / (1 + (a / 2e-7) ** 2) * (1 + 0.3j), None)
EXACT = {
    "channel-factor": ModelModification(channel_factor=DELAYED),
    "attachment": ModelModification(attachments=(MASS,)),
    "frequency-factor": ModelModification(frequency_factor=1.0002),
    "beam-drift": ModelModification(beam_drift_per_s=1e-5),
    "beam-modulus": ModelModification(beam_modulus={"lower": 0.97}),
    "moved-sensor": ModelModification(output_offset_m={"acc1": 0.01}),
    "clamp": ModelModification(clamp_rad_per_Nm={"lower": 1e-6}),
    "layer-gradient": ModelModification(layer_gradient={"joint": 0.5}),
    "nonlinear-at-the-reference": ModelModification(nonlinear=(TIP_SPRING,)),
    "nonlinear-elsewhere": ModelModification(nonlinear=(SPRING_ELSEWHERE,)),
    "softening-slip": ModelModification(nonlinear=(SLIDING,)),
    "two-nonlinear": ModelModification(nonlinear=(SLIDING, SPRING_ELSEWHERE), attachments=(MASS,)),
}
INEXACT = {
    "moduli-factor": ModelModification(moduli_factor={"joint": (1.3, 0.8)}),
    "layer-drift": ModelModification(layer_drift_per_s={"joint": 1e-3}),
    "cross-talk": ModelModification(cross_talk=(("acc1", "acc2", 0.05),)),
    "base-motion": ModelModification(base_receptance=1e-8),
}


def check(evidence, baseline, modification):
    errors = compare(ResidualModel(explained(evidence, baseline, modification), modification), baseline)
    assert np.max(errors["broadband 0"]) < 1e-5
    assert np.max(errors["steps"]) < 2e-4


@pytest.mark.parametrize("name", EXACT)
def test_sensitivities_hold_beside_what_extends_the_model(evidence, baseline, name):
    check(evidence, baseline, EXACT[name])


@pytest.mark.parametrize("name", INEXACT)
def test_sensitivities_hold_where_the_extension_scales_or_adds(evidence, baseline, name):
    check(evidence, baseline, INEXACT[name])


def test_a_model_that_may_be_wrong_in_its_stiffness_may_miss_a_resonance(evidence, baseline, steel_dense):
    """By a part in a thousand of every natural frequency, that is by twice as much of every mode's stiffness."""
    data = evidence.broadband[0]
    moved = replace(baseline.base, frequency_discrepancy=baseline.base.frequency_discrepancy + 1e-3)
    wrong = replace(evidence, broadband=(replace(data, H=steel_dense.accelerance(data.omega, moved)),))
    block = slice(0, 4 * len(data.omega))
    held, free = (
        ResidualModel(wrong, errors=SOUND.loosened(size, 1e-4, 0.1)).evaluate(baseline).residual[block]
        for size in (0.0, 5e-3)
    )
    assert np.sum(held**2) > 2 * len(held)
    assert np.sum(free**2) < 0.2 * len(free)


def test_a_response_that_still_grows_is_predicted_at_its_complex_frequency(build, steel_model, steel_dense, baseline):
    """F and q go as exp((j omega + s) t): the rig is K + (j omega + s) C + (j omega + s)^2 M then, with its law."""
    growth = 0.05 * np.exp(1j * np.linspace(0, 6, len(SWEPT)))
    omega = SWEPT - 1j * growth
    tip = 1.5e-3 * (0.2 + 0.8 / (1 + ((SWEPT / (2 * np.pi) - 26.4) / 0.3) ** 2))
    H, _ = steel_dense.with_law(omega, tip, baseline.base, baseline.laws[0])
    force = (tip * np.abs(omega) ** 2 / np.abs(H[:, 1]))[:, None]
    for assumed, least, most in ((growth, 0.0, 0.02), (0.0, 50.0, np.inf)):
        steps = build.steps(SWEPT, force, (H * force)[:, :, None], growth=assumed)
        residual = ResidualModel(build.evidence(steel_model, steps)).evaluate(baseline).residual
        assert least <= np.max(np.abs(residual)) < most


@pytest.fixture
def ringing(steel_model, steel_dense, baseline, evidence, swept):
    """The steps with a cubic spring's third harmonic, and a second one that the force itself has; where it was read."""
    steps, place, k = evidence.steps, 0.36, 4e7
    s, points = steel_model.structure, layer_points(steel_model.structure, 3)
    row, drive = deflection(s, place), deflection(s, 0.05)
    out = np.array([s.row(o.place) for o in steel_model.outputs])
    moved = np.abs(swept[3])
    moduli = np.concatenate(
        [-baseline.laws[0].softening_at(moved[:, :3]) + 0j, 1j * baseline.laws[0].loss_at(moved[:, 3:])], 1
    )
    springs = (points.weights * moduli)[:, :, None] * points.rows

    def field(load, order):
        """With what the law makes of the layer's points at each step: springs, and losses that follow the velocity."""
        held = points.rows.T @ (springs.real + 1j * order * springs.imag)
        return steel_dense.field(load[None], order * steps.omega, baseline.base, held=held)[:, 0]

    motion = field(drive, 1) @ row * steps.force[:, 0]
    third = -k / 4 * np.abs(motion) ** 3 * np.exp(3j * np.angle(motion))
    response = steps.response.copy()
    response[:, :, 1:] = 0.0
    for h, load, size in ((2, drive, steps.force[:, 1]), (3, row, third), (3, drive, steps.force[:, 2])):
        response[:, :, h - 1] += -((h * steps.omega[:, None]) ** 2) * (field(load, h) @ out.T) * size[:, None]

    def harmonics(a, count, omega):
        values = np.zeros((len(a), count), complex)
        values[:, 0], values[:, 2] = 0.75 * k * a**3, 0.25 * k * a**3
        return values

    spring = NonlinearForce(lambda s: deflection(s, place), lambda a, omega: 0j * a, harmonics)
    return replace(evidence, steps=replace(steps, response=response)), ModelModification(nonlinear=(spring,))


def test_a_cubic_springs_third_harmonic_is_that_of_the_dense_structure(ringing, baseline):
    evidence, modification = ringing
    base = ResidualModel(evidence)
    harmonics = harmonic_residuals(base, baseline)
    without = ResidualModel(evidence, harmonics=harmonics).evaluate(baseline)
    with_spring = ResidualModel(evidence, modification, harmonics).evaluate(baseline)
    block = dict(without.blocks)["harmonics"]
    assert np.sqrt(np.mean(without.residual[block] ** 2)) > 1
    assert np.max(np.abs(with_spring.residual[block])) < 0.01 * np.max(np.abs(without.residual[block]))
    # The second harmonic is the force's own, and is taken off beforehand.
    second = harmonics.residual[:, harmonics.orders == 2]
    assert np.max(np.abs(second)) < 1e-4 * np.max(np.abs(evidence.steps.response[:, :, 1]))


def test_harmonics_reduced_with_a_clamp_that_turns_are_carried_by_that_mesh(ringing, baseline):
    """It has one degree of freedom more than the assumed one."""
    evidence, modification = ringing
    turning = ModelModification(clamp_rad_per_Nm={"lower": 2e-11})
    residuals = [harmonic_residuals(ResidualModel(evidence, each), baseline) for each in (None, turning)]
    assert residuals[1].field.shape[-1] == residuals[0].field.shape[-1] + 1
    plain, turned = (
        ResidualModel(evidence, modification.merged(each), harmonics).evaluate(baseline, sensitivities=False).residual
        for each, harmonics in zip((ModelModification(), turning), residuals, strict=True)
    )
    np.testing.assert_allclose(turned, plain, atol=0.05)


def test_a_harmonic_that_was_not_measured_says_nothing(ringing, baseline):
    evidence, _ = ringing
    variance = evidence.steps.response_variance.copy()
    variance[:, :, 4] = np.inf
    blind = replace(evidence, steps=replace(evidence.steps, response_variance=variance))
    harmonics = harmonic_residuals(ResidualModel(blind), baseline)
    assert np.all(harmonics.residual[:, harmonics.orders == 5] == 0)
    assert np.all(np.isfinite(harmonics.whitening(1.0).factor))


def test_sensitivities_of_harmonics_are_the_derivative_of_the_residual(ringing, baseline):
    """Of two forces, whose size and phase follow the motion at their ports."""
    evidence, modification = ringing
    (spring,) = modification.nonlinear

    def harmonics(a, count, omega):
        return 2e8 * a[:, None] ** 2 / (1 + np.arange(count)) ** 2 * (1 - 0.4j)

    sliding = NonlinearForce(slip_row, SLIDING.equivalent, harmonics)
    both = ModelModification(nonlinear=(spring, sliding))
    residual_model = ResidualModel(evidence, both, harmonic_residuals(ResidualModel(evidence), baseline))
    errors = compare(residual_model, baseline, blocks=("harmonics",))["harmonics"]
    assert np.max(errors) < 1e-4
    assert residual_model.evaluate(baseline).jacobian[dict(residual_model.evaluate(baseline).blocks)["harmonics"]].any()


def test_without_the_inner_receptances_the_residual_is_the_same(evidence, baseline):
    residual_model = ResidualModel(evidence, ModelModification(attachments=(MASS,)))
    with_them, without = (residual_model.evaluate(baseline, sensitivities=s) for s in (True, False))
    np.testing.assert_allclose(without.residual, with_them.residual, rtol=1e-8, atol=1e-8)
    assert not without.jacobian.any()
