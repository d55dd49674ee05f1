"""Base parameters from a broadband run: Gauss-Newton on whitened frequency responses."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from recordings.numbers import SMALLEST, STIFFEST
from twin.arrays import Array
from twin.identify.gauss_newton import StepRule, minimise
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import LinearModel, LinearParameters
from twin.identify.modes.from_record import response_of_record
from twin.identify.spectra.broadband import BinnedResponse
from twin.identify.spectra.spectrum import BroadbandRecord
from twin.structure import elastic_modes

MODULI_STD = 0.1 / np.sqrt(3)
"""Prior of the logarithms of E' and G': no experimenter knows them to better than ten per cent, evenly spread."""
LARGEST_STEP = {
    "log_E": 0.3,
    "log_G": 0.3,
    "loss_E": 0.1,
    "loss_G": 0.3,
    "log_zeta": 0.5,
    "frequency_discrepancy": 0.01,
}
"""Of the base parameters in one step of a fit."""
ELSEWHERE = tuple(pair for pair in product((-0.5, 0.0, 0.4), repeat=2) if any(pair))
"""Logarithms of factors on all joints' E' and G' to begin from."""


@dataclass(frozen=True, kw_only=True)
class LinearFit:
    """Base parameters with covariance (of ``base.vector``), and how well they fit."""

    base: LinearParameters
    covariance: Array
    chi2_per_dof: float
    """Of the whitened residual."""
    nominal: LinearParameters
    """Centre of the prior."""


def base_prior(
    nominal: LinearParameters,
    *,
    frequency_discrepancy_std: float = LIMITS.frequency_std,
    moduli_std: float = MODULI_STD,
    scatter: float = 0.0,
) -> tuple[Array, Array]:
    """Mean and precision (u, u) of ``base.vector`` before any data: what an experimenter may be wrong about.

    Parameters
    ----------
    frequency_discrepancy_std
        Of the natural frequencies' own errors.  A fit that begins with a wide one follows the measured resonances
        whatever is wrong with the model, and tightening it then asks the physical parameters to explain them: a way
        round the false minima that sharp resonances have.
    moduli_std
        Of the logarithms of the layers' E' and G'.
    scatter
        Of the natural frequencies from one assembly to the next, beside that.
    """
    blocks = nominal.blocks(nominal.joints)
    frequency_discrepancy = np.full(LIMITS.damped_modes, frequency_discrepancy_std)
    # The last of these modes lies above the band: nothing measured would hold a wide frequency discrepancy of it in
    # place.
    frequency_discrepancy[-1] = min(frequency_discrepancy_std, LIMITS.frequency_std)
    frequency_discrepancy = np.hypot(frequency_discrepancy, scatter)
    moduli = {"log_E": moduli_std, "log_G": moduli_std, "loss_E": 0.05, "loss_G": 0.2}
    covariance = np.diag(
        blocks.pack(moduli | {"log_zeta": LIMITS.each_damping_std, "frequency_discrepancy": frequency_discrepancy}) ** 2
    )
    covariance[blocks["log_zeta"], blocks["log_zeta"]] += LIMITS.damping_std**2
    return nominal.vector, np.linalg.inv(covariance)


def whitening(covariance: Array) -> Array:
    """Matrices (b, o, o) that give errors of these covariances unit ones: the inverse Cholesky factors."""
    return np.linalg.inv(np.linalg.cholesky(covariance))


def largest_step(base: LinearParameters) -> Array:
    """Largest change of each entry of ``base.vector`` in one step of a fit."""
    return base.blocks(base.joints).pack(LARGEST_STEP)


def base_bounds(joints: int = 1) -> tuple[Array, Array]:
    """Limits of ``base.vector``: moduli as a rig file takes them, loss factors from 0, damping ratios from 1e-5."""
    pack = LinearParameters.blocks(joints).pack
    softest, stiffest = np.log(1.01 * SMALLEST), np.log(0.99 * STIFFEST)  # rounding must not lead beyond
    lower = {"log_E": softest, "log_G": softest, "loss_E": 0.0, "loss_G": 0.0, "log_zeta": np.log(1e-5)}
    upper = {"log_E": stiffest, "log_G": stiffest, "loss_E": 1.0, "loss_G": 3.0, "log_zeta": np.log(0.3)}
    return pack(lower | {"frequency_discrepancy": -0.3}), pack(upper | {"frequency_discrepancy": 0.3})


def fit_linear(
    model: LinearModel,
    data: BinnedResponse,
    start: LinearParameters,
    *,
    nominal: LinearParameters,
    frequency_discrepancy_std: float = LIMITS.frequency_std,
    moduli_std: float = MODULI_STD,
    model_error: float = 0.0,
) -> LinearFit:
    """Fit the base parameters to a binned response.

    Parameters
    ----------
    start
        Where to begin.
    nominal
        Centre of the prior.
    frequency_discrepancy_std, moduli_std
        See :func:`base_prior`.
    model_error
        Relative error of the model's responses, beside the data's noise.
    """
    covariance = data.relative_covariance + model_error**2 * np.eye(len(data.channels))
    mean, precision = base_prior(nominal, frequency_discrepancy_std=frequency_discrepancy_std, moduli_std=moduli_std)
    omega, white = data.omega, whitening(covariance)

    def evaluate(vector: Array) -> tuple[Array, Array]:
        base = LinearParameters.from_vector(vector)
        R = model.receptance(omega, base)
        H = model.response(R, omega)
        r = (white @ np.log(data.H / H)[:, :, None]).ravel()
        J = (white @ (model.sensitivity(R, omega, base) / H[:, :, None])).reshape(len(r), -1)
        return np.sqrt(2) * np.concatenate([r.real, r.imag]), np.sqrt(2) * np.vstack([J.real, J.imag])

    solution = minimise(
        evaluate, start.vector, mean=mean, precision=precision, iterations=15,
        steps=StepRule(bounds=base_bounds(nominal.joints), largest=largest_step(nominal)),
    )  # fmt: skip
    return LinearFit(
        base=LinearParameters.from_vector(solution.x),
        covariance=solution.covariance,
        chi2_per_dof=solution.chi2 / max(1, len(solution.residual) - len(mean)),
        nominal=nominal,
    )


def reduce_broadband(
    model: LinearModel, record: BroadbandRecord, nominal: LinearParameters, *, force: str
) -> tuple[BinnedResponse, LinearFit]:
    """Bin a broadband record, whatever the model, and fit the base parameters to it.

    The frequency discrepancy stays wide here: what explains the resonances is for later to say.
    """
    # Up to where the model is meant to hold: the modes whose damping is identified.
    data = response_of_record(
        record, force=force, channels=tuple(output.channel for output in model.outputs),
        band_Hz=(0.0, highest_Hz(model)), highest_order=LIMITS.reduced_order,
    )  # fmt: skip

    def followed(nominal: LinearParameters, signs: Array | float = 1.0) -> LinearFit:
        begun = on_the_resonances(model, nominal, data.resonances_Hz)
        return follow_resonances(model, replace(data, H=signs * data.H), begun, nominal)

    fit = followed(nominal)
    if fit.chi2_per_dof > LIMITS.linear_fit_astray:
        # Resonances hardly move with the moduli where the layer is stiff, and shapes do: a false minimum.  Nor does a
        # fit of logarithms find its way out of a wrong sign.
        others = [
            followed(replace(nominal, E=nominal.E * np.exp(log_E), G=nominal.G * np.exp(log_G)))
            for log_E, log_G in ELSEWHERE
        ]
        others += [followed(nominal, signs) for signs in 1 - 2 * np.eye(len(model.outputs))]
        best = min(others, key=lambda other: other.chi2_per_dof)
        if best.chi2_per_dof < LIMITS.linear_fit_found:
            fit = best
    return data, fit


def follow_resonances(
    model: LinearModel, data: BinnedResponse, base: LinearParameters, nominal: LinearParameters
) -> LinearFit:
    """A fit that follows the resonances, the moduli held near what is assumed."""
    return fit_linear(
        model,
        data,
        base,
        nominal=nominal,
        frequency_discrepancy_std=LIMITS.wide_frequency,
        moduli_std=0.02,
        model_error=0.02,
    )


def on_the_resonances(model: LinearModel, base: LinearParameters, resonances_Hz: Array) -> LinearParameters:
    """The same, with the model's first modes on the measured resonances, where one is near enough."""
    structure, count = model.structure, LIMITS.damped_modes
    model_Hz = elastic_modes(structure.M, structure.stiffness(base.E, base.G), count).frequency_Hz
    frequency_discrepancy = np.zeros(count)
    for r, frequency in enumerate(model_Hz):
        near = [f for f in resonances_Hz if np.argmin(np.abs(np.log(model_Hz / f))) == r]
        if near:
            shift = min((np.log(f / frequency) for f in near), key=abs)
            frequency_discrepancy[r] = shift if abs(shift) < LIMITS.largest_alignment else 0.0
    return replace(base, frequency_discrepancy=frequency_discrepancy)


def highest_Hz(model: LinearModel) -> float:
    """Up to where a model is meant to hold: below the last of the modes whose damping is identified."""
    return float(0.95 * model.basis.omega[LIMITS.damped_modes - 1] / (2 * np.pi))
