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
from twin.identify.residuals.harmonics import by_added_stiffness, friction_harmonics
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
        for joint, law in zip(residual_model.evidence.rig.joints, baseline.laws, strict=False)
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
    return of_openings, [
        _of_added(residual_model, baseline, np.column_stack([log_amplitude, np.angle(response / steps.force[:, 0])])),
        *_of_harmonics(residual_model, baseline, log_amplitude[:, None]),
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


def _of_added(residual_model: ResidualModel, baseline: BaselineParameters, coordinates: Array) -> ResidualColumns:
    """What harmonics add to the fundamental's stiffness errs as they do, smoothly with the motion.

    By the error of the third one's share at each point, which are many.
    """
    error = OF_RESIDUALS.share_error[0] / np.sqrt(max(len(residual_model.points), 1))
    columns = error * by_added_stiffness(residual_model, baseline)[:, :, None] * smooth_columns(coordinates)[:, None]
    columns = np.concatenate([columns, 1j * columns], axis=2)
    steps = np.concatenate([columns.real, columns.imag], axis=1)
    return replace(_none(residual_model, steps.shape[2]), steps=steps)


def _of_harmonics(
    residual_model: ResidualModel, baseline: BaselineParameters, coordinates: Array
) -> list[ResidualColumns]:
    """Odd harmonics err smoothly with the amplitude, beside each point's share on its own.

    The shares along a layer, and what friction makes of the slips, of which the law says nothing.
    """
    harmonics, found = residual_model.harmonics, []
    if harmonics is None:
        return []
    curves = smooth_columns(coordinates)
    made = [friction_harmonics(residual_model, baseline, harmonics.orders)]
    for joint in np.unique(residual_model.points.joint):
        own = residual_model.points.joint == joint
        along = np.linspace(-1, 1, np.count_nonzero(own))
        # Legendre's first and second polynomials, of unit mean square; what all points share is free anyway.
        made += [harmonics.shares[..., own] @ (np.sqrt(3) * along)]
        made += [harmonics.shares[..., own] @ (np.sqrt(5) * (1.5 * along**2 - 0.5))]
    for each in made:
        for order in np.flatnonzero(np.any(each, axis=(0, 2))):
            columns = np.zeros((*each.shape, 2 * curves.shape[1]), complex)
            one = each[:, order, :, None] * curves[:, None]
            columns[:, order] = np.concatenate([one, 1j * one], axis=2)
            found.append(replace(_none(residual_model, columns.shape[3]), harmonics=columns))
    return found
