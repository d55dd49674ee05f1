"""Base parameters from a broadband run: Gauss-Newton on whitened frequency responses."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.linalg import solve_triangular

from twin.arrays import Array
from twin.identify.gauss_newton import StepRule, minimise
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import LinearModel, LinearParameters
from twin.identify.linear.poles import poles_near
from twin.identify.linear.receptance import padded
from twin.identify.spectra.broadband import BinnedResponse, Binning, bin_response, find_resonances, hidden_resonances
from twin.identify.spectra.driven_gaps import driven_through
from twin.identify.spectra.spectrum import BroadbandRecord
from twin.structure import rigid_motions

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


def whiten(covariance: Array, values: Array) -> Array:
    """Multiply by the inverse Cholesky factors: (b, o, o) and (b, o) or (b, o, k)."""
    L = np.linalg.cholesky(covariance)
    if values.ndim == 2:
        return np.linalg.solve(L, values[:, :, None])[:, :, 0]
    return np.linalg.solve(L, values)


def largest_step(base: LinearParameters) -> Array:
    """Largest change of each entry of ``base.vector`` in one step of a fit."""
    return base.blocks(base.joints).pack(LARGEST_STEP)


def base_bounds(joints: int = 1) -> tuple[Array, Array]:
    """Limits of ``base.vector``: no loss factor is negative, no damping ratio below a hundred-thousandth."""
    pack = LinearParameters.blocks(joints).pack
    lower = {"log_E": -np.inf, "log_G": -np.inf, "loss_E": 0.0, "loss_G": 0.0, "log_zeta": np.log(1e-5)}
    upper = {"log_E": np.inf, "log_G": np.inf, "loss_E": 1.0, "loss_G": 3.0, "log_zeta": np.log(0.3)}
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
    omega = data.omega

    def evaluate(vector: Array) -> tuple[Array, Array]:
        base = LinearParameters.from_vector(vector)
        R = model.receptance(omega, base)
        H = model.response(R, omega)
        r = whiten(covariance, np.log(data.H / H)).ravel()
        J = whiten(covariance, model.sensitivity(R, omega, base) / H[:, :, None]).reshape(len(r), -1)
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
    """Bin a broadband record and fit the base parameters to it, each round with a better reference.

    The first reference is what is assumed, detuned to the resonances that the data show; since bins assume only that
    the difference to it is smooth away from those, a wrong belief costs accuracy, which the following rounds give back.
    The frequency discrepancy stays wide here: what explains the resonances is for later to say.
    """
    resonances, band = _resonances_and_band(model, record, force)
    told_apart = resonances
    base = on_the_resonances(model, nominal, resonances)
    upright = signs = np.ones(len(model.outputs))

    def reduced(base: LinearParameters, signs: Array) -> tuple[BinnedResponse, LinearFit]:
        response, omega, zeta = _reference(model, base)
        data = _binned(
            model, record, _within(band, (-zeta + 1j) * omega),
            force=force, resonances=told_apart, band=band, reference=lambda omega: signs * response(omega),
        )  # fmt: skip
        return data, follow_resonances(model, replace(data, H=signs * data.H), base, nominal)

    led_astray = False
    for _ in range(3):
        data, fit = reduced(base, signs)
        if fit.chi2_per_dof > LIMITS.linear_fit_astray and not led_astray:
            led_astray = True
            # Resonances hardly move with the moduli where the layer is stiff, and shapes do: a false minimum.
            others = []
            for log_E, log_G in ELSEWHERE:
                there = replace(nominal, E=nominal.E * np.exp(log_E), G=nominal.G * np.exp(log_G))
                begun = on_the_resonances(model, there, resonances)
                others.append((data, follow_resonances(model, data, begun, there), upright))
            # Nor does a fit of logarithms find its way out of a wrong sign; whose it may be these bins tell, too.
            turned = min(
                upright - 2 * np.eye(len(upright)),
                key=lambda signs: follow_resonances(model, replace(data, H=signs * data.H), base, nominal).chi2_per_dof,
            )
            others.append((*reduced(base, turned), turned))
            best = min(others, key=lambda other: other[1].chi2_per_dof)
            if best[1].chi2_per_dof < LIMITS.linear_fit_found:
                data, fit, signs = best
                nominal = fit.nominal
        told_apart = np.concatenate([told_apart, hidden_resonances(data)])
        base = fit.base
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


def on_the_resonances(model: LinearModel, base: LinearParameters, resonances: Array) -> LinearParameters:
    """The same, detuned to the resonances that the data show."""
    return replace(base, frequency_discrepancy=_aligned(_complex_modes(model, base)[0], resonances))


def bin_broadband(
    model: LinearModel,
    record: BroadbandRecord,
    base: LinearParameters,
    *,
    force: str,
    reference: Callable[[Array], Array],
    resonances_Hz: Array,
) -> BinnedResponse:
    """Bin a broadband record against a reference that is better than the linear model.

    Parameters
    ----------
    base
        What the linear model has of the reference: its poles, detuned to the record's resonances, are near that one's.
    reference
        Responses (f, o) at omega.
    resonances_Hz
        Of an earlier binning: what showed only then stays told apart.
    """
    resonances, band = _resonances_and_band(model, record, force)
    _, omega, zeta = _reference(model, on_the_resonances(model, base, resonances))
    # The decays of the record's ends are as narrow as the resonances, and those shown are told to a line or two.
    poles = poles_near(reference, _within(band, (-zeta + 1j) * omega))
    return _binned(model, record, poles, force=force, resonances=resonances_Hz, band=band, reference=reference)


def _resonances_and_band(model: LinearModel, record: BroadbandRecord, force: str) -> tuple[Array, Array]:
    """What the record shows, up to where the model is meant to hold: the modes whose damping is identified."""
    channels = tuple(output.channel for output in model.outputs)
    resonances, band = find_resonances(record, force=force, channels=channels)
    band[1] = min(band[1], highest_Hz(model))
    return resonances[resonances < band[1]], band


def highest_Hz(model: LinearModel) -> float:
    """Up to where a model is meant to hold: below the last of the modes whose damping is identified."""
    return float(0.95 * model.basis.omega[LIMITS.damped_modes - 1] / (2 * np.pi))


def _binned(
    model: LinearModel,
    record: BroadbandRecord,
    poles: Array,
    *,
    force: str,
    resonances: Array,
    band: Array,
    reference: Callable[[Array], Array],
) -> BinnedResponse:
    channels = tuple(output.channel for output in model.outputs)

    def mended(part: BroadbandRecord) -> BroadbandRecord:
        return driven_through(part, reference, force=force, channels=channels, up_to_Hz=float(band[1]))

    binning = Binning(
        force=force, channels=channels, reference=reference, poles=poles,
        resonances_Hz=np.concatenate([resonances, poles.imag / (2 * np.pi)]), band_Hz=band, mended=mended,
    )  # fmt: skip
    return bin_response(record, binning)


def _within(band_Hz: Array, poles: Array) -> Array:
    """Those poles whose decays show in the band."""
    return poles[poles.imag < 2 * np.pi * 1.3 * band_Hz[1]]


def _aligned(values: Array, resonances_Hz: Array) -> Array:
    """Frequency discrepancy that put the model's first modes on the measured resonances, where one is near enough."""
    model_Hz = np.sqrt(values.real[: LIMITS.damped_modes]) / (2 * np.pi)
    frequency_discrepancy = np.zeros(LIMITS.damped_modes)
    for r, frequency in enumerate(model_Hz):
        near = [f for f in resonances_Hz if np.argmin(np.abs(np.log(model_Hz / f))) == r]
        if near:
            best = float(near[int(np.argmin(np.abs(np.log(np.array(near) / frequency))))])
            shift = np.log(best / frequency)
            frequency_discrepancy[r] = shift if abs(shift) < LIMITS.largest_alignment else 0.0
    return frequency_discrepancy


def _complex_modes(model: LinearModel, base: LinearParameters) -> tuple[Array, Array]:
    """Squares of the complex frequencies, with joint loss, and shapes with Phi' M Phi = 1, (n,) and (n, n)."""
    s = model.structure
    K = s.K0 + np.zeros((), complex)
    for joint, E, G in zip(s.joints, base.complex_E, base.complex_G, strict=True):
        K = K + E * joint.KE + G * joint.KG
    inverse = solve_triangular(np.linalg.cholesky(s.M), np.eye(len(s.M)), lower=True)
    values, vectors = np.linalg.eig(inverse @ K @ inverse.T)
    order = np.argsort(values.real)
    # Rigid motions last, as in the model's own basis.
    rigid = rigid_motions(np.sqrt(np.abs(values[order].real)))
    values[order[:rigid]] = 0.0
    order = np.r_[order[rigid:], order[:rigid]]
    vectors = vectors[:, order]
    if rigid:  # real, and of one frequency: any of them that span the same motions come, and need not be orthogonal
        motions = vectors[:, -rigid:]
        vectors[:, -rigid:] = np.linalg.svd(np.hstack([motions.real, motions.imag]))[0][:, :rigid]
    return values[order], inverse.T @ (vectors / np.sqrt(np.sum(vectors**2, axis=0)))


def _reference(model: LinearModel, base: LinearParameters) -> tuple[Callable[[Array], Array], Array, Array]:
    """A fast response function, and its natural frequencies and damping ratios.

    Tens of thousands of lines want a sum over complex modes instead of a solution at each; the modal damping acts on
    the complex modes then, and dampers on each mode by itself, a difference far below what a bin leaves free.
    """
    values, Phi = _complex_modes(model, base)
    values[: LIMITS.damped_modes] *= 1 + 2 * base.frequency_discrepancy
    omega_r = np.sqrt(values.real)
    zeta = padded(np.concatenate([base.zeta, model.basis.zeta]), len(values))
    viscous = np.sum((model.structure.B_C @ Phi) ** 2, axis=0).real
    zeta = zeta + viscous / (2 * np.where(omega_r > 0, omega_r, np.inf))
    residues = (model.ports.rows[model.ports.outputs] @ Phi) * (model.ports.rows[model.ports.drive] @ Phi)
    elastic = np.count_nonzero(values)
    near = np.r_[: min(40, elastic), elastic : len(values)]

    def response(omega: Array) -> Array:
        w = omega[:, None]
        D = 1.0 / (values[near] - w**2 + 2j * zeta[near] * omega_r[near] * w)
        static = np.sum(residues[:, 40:elastic] / values[40:elastic], axis=1)
        return (D @ residues[:, near].T + static) * model.to_quantity(omega)

    return response, omega_r[:elastic], zeta[:elastic] + values[:elastic].imag / (2 * values[:elastic].real)
