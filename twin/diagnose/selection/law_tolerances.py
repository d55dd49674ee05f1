"""What joints' laws leave out, as directions of the residuals with a standard normal amount each in a sound rig."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from twin.arrays import Array
from twin.diagnose.gaussian_process import smooth_columns
from twin.diagnose.limits import LIMITS
from twin.diagnose.residual_columns import ResidualColumns
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.limits import LIMITS as OF_RESIDUALS
from twin.identify.model_modification import ModelModification
from twin.identify.nonlinear.balance import Balance
from twin.identify.residuals.harmonics import by_stiffness, friction_harmonics
from twin.identify.residuals.residual_model import ResidualModel

SMALL = 1e-3
"""Share of a tolerance over which its difference is taken."""


def law_tolerances(
    residual_model: ResidualModel, baseline: BaselineParameters, residual: Array, left_by: Callable[..., Array]
) -> tuple[list[Array], list[ResidualColumns]]:
    """Directions in which a joint differs from any law of this kind.

    Parameters
    ----------
    residual
        Whitened, (r,).
    left_by
        What a modification leaves of it.

    Returns
    -------
    list of ndarray, (r, k)
        Whitened.
    list of ResidualColumns
        And not.
    """
    softening = [
        (joint, law)
        for joint, law in zip(residual_model.evidence.joints, baseline.laws, strict=False)
        if np.any(law.softening)
    ]
    of_openings = []
    for joint, _ in softening:
        # One mode's law takes in another mean of the opening over an element, and with it two modes' laws differ.
        little = ModelModification(towards_middle={joint.name: LIMITS.score_test_towards_middle * SMALL})
        of_openings.append((residual - left_by(little))[:, None] / SMALL)
    if not softening or not len(residual_model.evidence.steps):
        return of_openings, []
    steps = residual_model.evidence.steps
    response = steps.response[:, residual_model.evidence.reference, 0]
    log_amplitude = np.log(np.abs(response) / steps.omega**2)
    motion = np.column_stack([log_amplitude, np.angle(response / steps.force[:, 0])])
    along, by_amplitude = _along_layers(residual_model), smooth_columns(log_amplitude[:, None])
    return of_openings, [
        *_of_stiffness(residual_model, baseline, along, by_amplitude, smooth_columns(motion)),
        *_of_harmonics(residual_model, baseline, along, by_amplitude),
    ]


def _none(residual_model: ResidualModel, count: int) -> ResidualColumns:
    """So many columns of nothing."""
    evidence, harmonics = residual_model.evidence, residual_model.harmonics
    shape = (0, 0, 0) if harmonics is None else harmonics.residual.shape
    return ResidualColumns(
        tuple(np.zeros((*data.H.shape, count), complex) for data in evidence.broadband),
        np.zeros((len(evidence.steps), 2 * len(evidence.channels), count)),
        np.zeros((*shape, count), complex),
    )


def _along_layers(residual_model: ResidualModel) -> Array:
    """Legendre's first and second polynomials (p, k) over the points of each layer, of unit mean square."""
    joints = residual_model.points.joint
    found = []
    for joint in np.unique(joints):
        x = np.linspace(-1, 1, np.count_nonzero(joints == joint))
        for polynomial in (np.sqrt(3) * x, np.sqrt(5) * (1.5 * x**2 - 0.5)):
            found.append(np.zeros(len(joints)))
            found[-1][joints == joint] = polynomial
    return np.column_stack(found)


def _of_steps(residual_model: ResidualModel, columns: Array) -> ResidualColumns:
    """Columns (s, o, k) of the steps alone."""
    steps = np.concatenate([columns.real, columns.imag], axis=1)
    return replace(_none(residual_model, steps.shape[2]), steps=steps)


def _of_stiffness(
    residual_model: ResidualModel, baseline: BaselineParameters, along: Array, by_amplitude: Array, by_motion: Array
) -> list[ResidualColumns]:
    """What a joint takes off its stiffness, and loses, errs in three ways, each smoothly with the motion.

    The law differs along the layer, as the bolt's pressure does, by the third harmonic's error at a point; what
    harmonics add to the fundamental's stiffness errs as they do, at points of which there are many; and what loses in
    slip takes stiffness in slip, which the law says nothing of.
    """

    def of_ports(balance: Balance) -> Array:
        count, law = len(along), balance.stiffness - balance.more
        found = np.zeros((*law.shape, 2 * along.shape[1] + 2), complex)
        for number, ports in enumerate((slice(count), slice(count, 2 * count))):  # openings, then slips
            own = slice(number * along.shape[1], (number + 1) * along.shape[1])
            found[:, ports, own] = OF_RESIDUALS.share_error[0] * law[:, ports, None] * along
        found[:, count : 2 * count, -2] = LIMITS.law_tolerances_slip * law[:, count : 2 * count].imag
        found[:, :, -1] = OF_RESIDUALS.share_error[0] / np.sqrt(max(count, 1)) * balance.more
        return found

    felt = by_stiffness(residual_model, baseline, of_ports)
    # By amplitude alone: what differs with the phase as well would be another law before resonance than behind it.
    laws = felt[:, :, :-1, None] * by_amplitude[:, None, None]
    added = felt[:, :, -1:] * by_motion[:, None]
    each = (laws.reshape(*laws.shape[:2], -1), np.concatenate([added, 1j * added], axis=2))
    return [_of_steps(residual_model, columns) for columns in each]


def _of_harmonics(
    residual_model: ResidualModel, baseline: BaselineParameters, along: Array, by_amplitude: Array
) -> list[ResidualColumns]:
    """Harmonics err smoothly with the amplitude, beside what errs at each step on its own.

    Of odd ones the shares along a layer, where what all points share is free anyway, and what friction makes of the
    slips, of which the law says nothing; of even ones what a model has of them.
    """
    harmonics, found = residual_model.harmonics, []
    if harmonics is None:
        return []
    shared = np.moveaxis(harmonics.shares @ along, 3, 0)
    friction = friction_harmonics(residual_model, baseline, harmonics.orders)
    R, _, balance = residual_model.step_receptance(baseline)
    made = residual_model.extra_harmonics(baseline, R, balance)
    even = np.where(harmonics.orders % 2, 0.0, OF_RESIDUALS.even_error)[:, None] * made
    for each in (friction, *shared, even):
        for order in np.flatnonzero(np.any(each, axis=(0, 2))):
            columns = np.zeros((*each.shape, 2 * by_amplitude.shape[1]), complex)
            one = each[:, order, :, None] * by_amplitude[:, None]
            columns[:, order] = np.concatenate([one, 1j * one], axis=2)
            found.append(replace(_none(residual_model, columns.shape[3]), harmonics=columns))
    return found
