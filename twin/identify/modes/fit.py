"""Modal parameters from frequency responses: chart, stable poles, maximum likelihood, and the modes that pay."""

from dataclasses import dataclass

import numpy as np

from twin.arrays import Array
from twin.identify.limits import LIMITS
from twin.identify.modes.noise import noise_of_residual, noise_of_responses
from twin.identify.modes.rational import ChartPole, pole_chart
from twin.identify.modes.refinement import PoleFit, refine_poles
from twin.identify.modes.stabilisation import StableGroup, stable_groups

HIGHEST_ORDER = 60
LEAST_LINES = 20


@dataclass(frozen=True)
class Mode:
    """One identified mode."""

    frequency_Hz: float
    frequency_std_Hz: float
    damping_ratio: float
    damping_std: float
    residues: Array
    """Of R / (j omega - p), in the responses' unit times rad/s, (o,)."""
    share: float
    """Of the chart's orders that have it."""

    @property
    def pole(self) -> complex:
        """In the s plane, rad/s."""
        omega = 2 * np.pi * self.frequency_Hz
        return complex(omega * (-self.damping_ratio + 1j * np.sqrt(1 - self.damping_ratio**2)))


@dataclass(frozen=True, kw_only=True)
class ModalFit:
    """Modes of a band."""

    modes: tuple[Mode, ...]
    """Rising in frequency."""
    fit: PoleFit
    """All poles that were fitted, those just outside the band among them, with their residues."""
    chi2_per_dof: float
    """Of the weighted residual; standard deviations are widened by its root where it is above one."""
    residual_percent: float
    """Norm of the difference over that of the responses, per cent."""
    chart: tuple[ChartPole, ...]
    """All poles of all orders."""


def fit_modes(
    frequency_Hz: Array, H: Array, std: Array | None = None, *, highest_order: int = HIGHEST_ORDER,
    begun: PoleFit | None = None,
) -> ModalFit:  # fmt: skip
    """Identify all modes between the first line and the last.

    Parameters
    ----------
    frequency_Hz : ndarray, (f,)
        Rising, above zero; the steps need not be equal.
    H : ndarray, (f, o)
        Responses of any quantities to one force.
    std : ndarray, (f, o), optional
        Standard deviation of each response's error, the root of its complex variance; estimated from the responses'
        roughness if not given.
    highest_order
        Of the rational functions, about two for each mode and as many again for noise.
    begun
        Fit of rougher responses, from whose poles this one begins instead of from a chart's.

    Raises
    ------
    ValueError
        If there are too few lines, or they are not finite and rising, or no mode is found.
    """
    frequency_Hz, H = np.asarray(frequency_Hz, float), np.asarray(H, complex)
    if len(frequency_Hz) < LEAST_LINES or H.shape[0] != len(frequency_Hz) or H.ndim != 2:
        raise ValueError(f"at least {LEAST_LINES} lines of the responses are needed")
    if not (np.isfinite(H).all() and np.isfinite(frequency_Hz).all()):
        raise ValueError("the responses hold values that are not finite")
    if frequency_Hz[0] <= 0 or np.any(np.diff(frequency_Hz) <= 0):
        raise ValueError("the frequencies must rise from above zero")
    known, omega = std is not None, 2 * np.pi * frequency_Hz
    weight = _weight(np.asarray(std, float) if std is not None else noise_of_responses(H))
    chart, groups = ((), []) if begun else _candidate_poles(frequency_Hz, H, weight, highest_order)
    if begun is not None:
        groups = [StableGroup(w / (2 * np.pi), z, 1.0) for w, z in zip(begun.omega, begun.zeta, strict=True)]
    if not groups:
        raise ValueError("no pole is stable over the orders: no mode in this band, or too much noise")
    groups, fit = _worth_their_parameters(frequency_Hz, H, weight, groups)
    for _ in range(LIMITS.fit_rounds):
        if not known:  # what the fit leaves tells the noise better than the responses do
            weight = _weight(noise_of_residual(H - fit.responses(omega), fit.responses(omega)))
        missed = _candidate_poles(frequency_Hz, H - fit.responses(omega), weight, highest_order)[1]
        more = _together(_refined(groups, fit), missed)
        before = len(groups)
        groups, fit = _worth_their_parameters(frequency_Hz, H, weight, more)
        if known and len(groups) == before:
            break
    factor = max(1.0, fit.chi2 / fit.dof)
    sigma = np.sqrt(factor * np.diag(fit.covariance))
    m = len(groups)
    modes = [
        Mode(
            frequency_Hz=float(w / (2 * np.pi)), frequency_std_Hz=float(w / (2 * np.pi) * sigma[r]),
            damping_ratio=float(z), damping_std=float(z * sigma[m + r]), residues=fit.residues[:, r],
            share=groups[r].share,
        )
        for r, (w, z) in enumerate(zip(fit.omega, fit.zeta, strict=True))
        if frequency_Hz[0] <= w / (2 * np.pi) <= frequency_Hz[-1] and z < LIMITS.largest_damping
    ]  # fmt: skip
    return ModalFit(
        modes=tuple(sorted(modes, key=lambda mode: mode.frequency_Hz)), fit=fit,
        chi2_per_dof=fit.chi2 / fit.dof,
        residual_percent=float(100 * np.linalg.norm(fit.responses(omega) - H) / np.linalg.norm(H)), chart=chart,
    )  # fmt: skip


def _candidate_poles(
    frequency_Hz: Array, H: Array, weight: Array, highest_order: int
) -> tuple[tuple[ChartPole, ...], list[StableGroup]]:
    """The whole band's chart, and the stable poles of it and of charts of narrower bands.

    Weighted by the noise, a chart sees the smallest responses best; unweighted, the largest; and in a narrow band the
    sharp resonances that are a small part of a wide one.
    """

    def orders(lines: int, highest: int) -> range:
        return range(2, min(highest, lines // 4) + 1, 2)

    even = np.ones_like(weight) / np.abs(H).max(axis=0)
    whole = orders(len(frequency_Hz), highest_order)
    chart = pole_chart(frequency_Hz, H, weight, orders=whole)
    groups = _together(stable_groups(chart), stable_groups(pole_chart(frequency_Hz, H, even, orders=whole)))
    low = float(frequency_Hz[0])
    while low * LIMITS.fit_window < frequency_Hz[-1] * np.sqrt(LIMITS.fit_window):
        inside = (frequency_Hz >= low) & (frequency_Hz <= low * LIMITS.fit_window)
        narrow = orders(int(inside.sum()), highest_order // 2)
        if inside.sum() >= LEAST_LINES:
            found = stable_groups(pole_chart(frequency_Hz[inside], H[inside], weight[inside], orders=narrow))
            ends = frequency_Hz[inside][0], frequency_Hz[inside][-1]
            groups = _together(groups, [g for g in found if ends[0] < g.frequency_Hz < ends[1]])
        low *= np.sqrt(LIMITS.fit_window)
    return chart, groups


def _weight(std: Array) -> Array:
    """Real and imaginary part carry half of the variance each."""
    return np.asarray(np.sqrt(2) / std)


def _together(one: list[StableGroup], other: list[StableGroup]) -> list[StableGroup]:
    """Both lists' modes, those of the first where both have one."""
    new = [
        g for g in other
        if all(
            abs(g.frequency_Hz - k.frequency_Hz) > LIMITS.fit_same * max(k.damping_ratio, 1e-5) * k.frequency_Hz
            for k in one
        )
    ]  # fmt: skip
    return sorted([*one, *new], key=lambda g: g.frequency_Hz)


def _refined(groups: list[StableGroup], fit: PoleFit) -> list[StableGroup]:
    """The groups with the fit's poles."""
    poles = zip(groups, fit.omega, fit.zeta, strict=True)
    return [StableGroup(float(w / (2 * np.pi)), float(z), g.share) for g, w, z in poles]


def _worth_their_parameters(
    frequency_Hz: Array, H: Array, weight: Array, groups: list[StableGroup]
) -> tuple[list[StableGroup], PoleFit]:
    """Drop poles one by one, the least needed first, while Schwarz's criterion is for it."""

    def fitted(kept: list[StableGroup], **options: int) -> PoleFit:
        return refine_poles(
            frequency_Hz, H, weight,
            omega=2 * np.pi * np.array([g.frequency_Hz for g in kept]), zeta=np.array([g.damping_ratio for g in kept]),
            **options,
        )  # fmt: skip

    price = LIMITS.fit_needed * (2 + 2 * H.shape[1]) * np.log(2 * H.size)
    first = fitted(groups, iterations=0)
    plain = _contributions(frequency_Hz, weight, first) / max(1.0, first.chi2 / first.dof) > price
    groups = [group for group, worth in zip(groups, plain, strict=True) if worth] or groups
    fit = fitted(groups)
    while len(groups) > 1:
        scale = max(1.0, fit.chi2 / fit.dof)
        unresolved = _unresolved(frequency_Hz, fit)
        order = np.argsort(_contributions(frequency_Hz, weight, fit) * ~unresolved)
        least = int(order[0])
        without = groups[:least] + groups[least + 1 :]
        trial = fitted(without)
        if not unresolved.any() and (trial.chi2 - fit.chi2) / scale > price:
            break
        groups, fit = without, trial
    return groups, fit


def _unresolved(frequency_Hz: Array, fit: PoleFit) -> Array:
    """Poles within the band that are sharper than the lines can tell, or of any damping: noise has such, (m,)."""
    f = fit.omega / (2 * np.pi)
    spacing = np.interp(f, frequency_Hz, np.gradient(frequency_Hz))
    m = len(f)
    sigma = np.sqrt(np.diag(fit.covariance)[m:] * max(1.0, fit.chi2 / fit.dof))
    inside = (f > frequency_Hz[0]) & (f < frequency_Hz[-1])
    return np.asarray(inside & ((fit.zeta * f < LIMITS.fit_narrowest * spacing) | (sigma > LIMITS.fit_vague)))


def _contributions(frequency_Hz: Array, weight: Array, fit: PoleFit) -> Array:
    """Sum of squares of each mode's weighted part of the responses, (m,)."""
    parts = fit.parts(2 * np.pi * frequency_Hz)
    return np.asarray(np.sum(np.abs(weight[:, :, None] * parts) ** 2, axis=(0, 1)))
