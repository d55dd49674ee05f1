"""Resonances that frequency responses show, followed by a model whose modes may be elsewhere and otherwise shown.

A modal fit: natural frequencies, damping ratios and what each response shows of each mode are free, and all that lies
beyond these modes is the model's.  So the frequencies do not hinge on a level or a shape that the model has wrong.
"""

from dataclasses import dataclass, replace

import numpy as np

from twin.arrays import Array
from twin.identify.gauss_newton import StepRule, minimise
from twin.identify.limits import LIMITS as IDENTIFY
from twin.identify.linear.linear_fit import on_the_resonances
from twin.identify.linear.linear_model import LinearModel, LinearParameters
from twin.identify.responses.limits import LIMITS
from twin.identify.spectra.broadband import BinnedResponse


@dataclass(frozen=True)
class Followed:
    """A modal fit."""

    base: LinearParameters
    """With the frequency discrepancies and damping ratios found."""
    factors: Array
    """Modal factors of the outputs, (o, m)."""
    damping_std: Array
    """Of the logarithms of the damping ratios, (m,)."""
    chi2_per_dof: float
    """With :data:`LIMITS.following_tight` model errors."""


def follow(model: LinearModel, data: BinnedResponse, nominal: LinearParameters) -> Followed:
    """Fit the modes of a binned response, from the model's on the resonances that show."""
    m, outputs = IDENTIFY.damped_modes, model.outputs
    known = np.ones((len(outputs), m))
    for row, output in zip(known, outputs, strict=True):
        row[: len(output.modal_factor)] = output.modal_factor
    start = on_the_resonances(model, nominal, data.resonances_Hz)
    unseen = start.frequency_discrepancy == 0
    if unseen.any() and not unseen.all():
        # A mode that does not show is off as those that do.
        shift = np.where(unseen, np.median(start.frequency_discrepancy[~unseen]), start.frequency_discrepancy)
        start = replace(start, frequency_discrepancy=shift)
    blocks = start.blocks(start.joints)
    columns = np.r_[blocks["frequency_discrepancy"], blocks["log_zeta"]]
    vector, x = start.vector, np.concatenate([start.vector[columns], np.log(known).ravel()])
    size = np.repeat([LIMITS.following_frequency, LIMITS.following_damping, LIMITS.following_shown], [m, m, known.size])
    largest = np.repeat(LIMITS.largest_step, [m, m, known.size])

    def parts(x: Array) -> tuple[LinearModel, LinearParameters]:
        whole = vector.copy()
        whole[columns] = x[: 2 * m]
        shown = np.exp(x[2 * m :]).reshape(known.shape)
        outs = tuple(replace(o, modal_factor=tuple(row)) for o, row in zip(outputs, shown, strict=True))
        drive = model.ports.rows[model.ports.drive]
        return model.with_outputs(outs, [drive]), LinearParameters.from_vector(whole)

    solution = None
    for error in (LIMITS.following_loose, LIMITS.following_tight):
        noise = np.sqrt(data.variance + (error * data.depth) ** 2)

        def evaluate(x: Array, noise: Array = noise) -> tuple[Array, Array]:
            there, base = parts(x)
            R = there.receptance(data.omega, base)
            H = there.response(R, data.omega)
            r = (np.log(data.H / H) / noise).ravel()
            shown = there.shown_sensitivity(R[:, :, there.ports.drive]) * there.to_quantity(data.omega)[:, :, None]
            J = np.concatenate([there.sensitivity(R, data.omega, base)[:, :, columns], shown], axis=2)
            J = (J / (H * noise)[:, :, None]).reshape(len(r), -1)
            root = np.sqrt(2.0)
            return root * np.concatenate([r.real, r.imag]), root * np.vstack([J.real, J.imag])

        mean = np.concatenate([start.vector[columns], np.log(known).ravel()])
        solution = minimise(
            evaluate, x, mean=mean, precision=np.diag(1 / size**2), iterations=30, steps=StepRule(largest=largest)
        )
        x = solution.x
    assert solution is not None
    _, base = parts(x)
    freedom = max(1, len(solution.residual) - len(x))
    std = np.sqrt(np.diag(solution.covariance))[m : 2 * m]
    return Followed(base, np.exp(x[2 * m :]).reshape(known.shape), std, solution.chi2 / freedom)
