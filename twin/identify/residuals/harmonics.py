"""Higher harmonics of the stepped sines: they tell where on the structure a nonlinear force acts."""

from collections.abc import Callable

import numpy as np

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.limits import LIMITS
from twin.identify.linear.structural_modification import update_receptance
from twin.identify.measured_data import HARMONICS
from twin.identify.nonlinear.balance import Balance
from twin.identify.nonlinear.opening_harmonics import at_harmonic
from twin.identify.residuals.harmonics_by_unknowns import PointHarmonics
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals


def harmonic_residuals(residual_model: ResidualModel, baseline: BaselineParameters) -> HarmonicResiduals:
    """Harmonics 2 ... 7 of every step less their linear part, with their covariance.

    Parameters
    ----------
    residual_model
        Of the recorded steps.
    baseline
        The fitted base model.
    """
    steps = residual_model.evidence.steps
    orders = np.arange(2, HARMONICS + 1)
    balance = residual_model.step_receptance(baseline, inner=False)[2]
    linear, joint, field = harmonic_fields(residual_model, baseline, balance, orders)
    measured = np.moveaxis(steps.response[:, :, orders - 1], 1, 2)
    variance = np.moveaxis(steps.response_variance[:, :, orders - 1], 1, 2)
    residual = measured - linear
    ratio = linear / np.where(steps.force[:, orders - 1] == 0, 1.0, steps.force[:, orders - 1])[:, :, None]
    known = np.isfinite(variance)
    residual = np.where(known, residual, 0.0)
    own = np.where(known, variance, 1.0) + (LIMITS.linear_error * np.abs(linear)) ** 2
    force_variance = np.where(np.isfinite(steps.force_variance), steps.force_variance, 0.0)[:, orders - 1]
    through_force = force_variance[:, :, None, None] * ratio[..., :, None] * np.conj(ratio)[..., None, :]
    odd = (orders % 2 == 1)[None, :, None, None]
    size = np.sum(np.abs(residual) ** 2, axis=2)
    each = _made_by_each_point(residual_model, baseline, balance, orders)
    joint = np.where(np.any(each, axis=3), np.sum(each, axis=3), joint)
    direction = joint / np.maximum(np.linalg.norm(joint, axis=2, keepdims=True), 1e-300)
    anything = 100.0 * size[..., None, None] * direction[..., :, None] * np.conj(direction)[..., None, :]
    even = _even_error(residual_model, baseline, balance, orders, joint, size)
    tolerance = np.where(odd, LIMITS.signature_error**2 * size[..., None, None], even[..., None, None])
    # Where the points' shares make up for each other, as at an antiresonance, their errors do not.
    error = np.zeros(len(orders))
    error[np.isin(orders, LIMITS.odd_harmonics)] = LIMITS.share_error
    shares = error[:, None, None] * each
    covariance = through_force + odd * anything + (own[..., None] + tolerance) * np.eye(residual.shape[2])
    return HarmonicResiduals(orders, residual, covariance, shares, field, residual_model.model.structure)


def harmonic_fields(
    residual_model: ResidualModel,
    baseline: BaselineParameters,
    balance: Balance,
    orders: Array,
    *,
    stretch: float = 1.0,
) -> tuple[Array, Array, Array]:
    """Responses at multiples of the drive frequency, all frequencies times `stretch`.

    Returns
    -------
    linear : ndarray, (s, h, o)
        Response to the measured force harmonics.
    joint : ndarray, (s, h, o)
        Response to forces on the layer's openings, shared out as the law's softening: what its time form adds.
    field : ndarray, (s, h, o, n)
        Response of each output to a unit force on every degree of freedom.
    """
    steps, model, points = residual_model.evidence.steps, residual_model.step_model, residual_model.points
    time = residual_model.step_times
    first = stretch * residual_model.step_omega(baseline).real
    at = residual_model.moving[: 2 * len(points)]
    springs = balance.stiffness[:, : 2 * len(points)]
    opening = balance.motion[:, : len(points)]
    softened = -springs[:, : len(points)].real
    # In a joint without softening the openings alone share out whatever harmonics it has.
    softened = np.where(
        np.any(softened, axis=1, keepdims=True), softened, residual_model.local.weights[:, : len(points)]
    )
    dE, dG = residual_model.moduli_changes(baseline.base, time)
    linear, joint, field = [], [], []
    for h in orders:
        omega = h * first
        R = update_receptance(
            residual_model.receptance(omega, baseline.base, time, inner=False, points=True, drive=steps.drive),
            at, at_harmonic(springs, h),
        )  # fmt: skip
        factor = model.to_quantity(omega) * residual_model.channel_factors(omega)[0]
        linear.append(residual_model.responses(R, omega) * steps.force[:, h - 1, None])
        push = softened * np.abs(opening) * np.exp(1j * h * np.angle(opening))
        to_outputs = R[:, model.ports.outputs][:, :, at[: len(points)]]
        joint.append(np.einsum("sop,sp->so", to_outputs, push) * factor)
        field.append(
            model.output_field(omega, baseline.base, dE, dG, at=at, springs=at_harmonic(springs, h))
            * factor[:, :, None]
        )
    return np.stack(linear, axis=1), np.stack(joint, axis=1), np.stack(field, axis=1)


def _made_by_each_point(
    residual_model: ResidualModel, baseline: BaselineParameters, balance: Balance, orders: Array
) -> Array:
    """Odd harmonics (s, h, o, p) of the law's time form at each point of the layers; zero where it has none.

    High ones are made where the layer opens most, and are shared out otherwise than the softening is.
    """
    here = PointHarmonics.at(residual_model, baseline, balance)
    made = residual_model.read_of_openings(here.around) * here.balance.force[:, :, None]
    found = np.zeros((len(made), len(orders), *made.shape[2:]), complex)
    for number, order in enumerate(residual_model.orders):
        found[:, (orders == order) & (orders % 2 == 1)] = made[:, number, None]
    return found


def by_stiffness(
    residual_model: ResidualModel, baseline: BaselineParameters, of_ports: Callable[[Balance], Array]
) -> Array:
    """Changes (s, o, k) of the steps' residuals with the stiffness (s, n, k) of the ports at their balance, N/m."""
    R, omega, balance = residual_model.step_receptance(baseline)
    motion, influence = residual_model.port_motion(R, omega)
    more = of_ports(balance)
    changes = influence.motion @ more, influence.response @ more
    followed = residual_model.local.follow(baseline.laws, np.abs(motion), omega, influence, *changes, balance.added)
    return np.asarray(residual_model.measured_over_predicted(R, omega)[:, :, None] * followed[1])


def friction_harmonics(residual_model: ResidualModel, baseline: BaselineParameters, orders: Array) -> Array:
    """Odd harmonics (s, h, o) that the layer's friction makes of its slips, were it Coulomb's.

    Its force is a square wave: an h-th of the fundamental's, which is what damps.
    """
    balance, points = residual_model.step_receptance(baseline, inner=False)[2], len(residual_model.points)
    slip, damping = (values[:, points : 2 * points] for values in (balance.motion, balance.stiffness.imag))
    model, at = residual_model.model, residual_model.moving[points : 2 * points]
    found = np.zeros((len(slip), len(orders), len(residual_model.evidence.channels)), complex)
    for number in np.flatnonzero(orders % 2 == 1):
        h = orders[number]
        R, _, omega = residual_model.at_harmonic(h, baseline, balance)
        force = damping * np.abs(slip) * np.exp(1j * h * np.angle(slip)) / h
        factor = model.to_quantity(omega) * residual_model.channel_factors(omega)[0]
        found[:, number] = factor * np.einsum("sop,sp->so", R[:, model.ports.outputs][:, :, at], force)
    return found


def _even_error(
    residual_model: ResidualModel,
    baseline: BaselineParameters,
    balance: Balance,
    orders: Array,
    joint: Array,
    size: Array,
) -> Array:
    """Variance (s, h) of any model of the even harmonics.

    It is relative to what was measured or, where that is larger, to what a joint force as large as the second
    harmonic's would do: near a resonance a small error of frequency makes a large harmonic small.
    """
    if not len(residual_model.points):  # no joint could have made them
        return np.asarray(LIMITS.even_error**2 * size)
    beside = harmonic_fields(residual_model, baseline, balance, orders, stretch=1 + LIMITS.resonance_error)[1]
    gain, gain_beside = (np.sum(np.abs(values) ** 2, axis=2) for values in (joint, beside))
    likely = np.maximum(size, size[:, :1] / gain[:, :1] * np.maximum(gain, gain_beside))
    detuned = np.sum(np.abs(beside - joint) ** 2, axis=2) / np.minimum(gain, gain_beside)
    return np.asarray((LIMITS.even_error**2 + detuned) * likely)
