"""A rig's numbers updated to the modes that frequency responses show, with their uncertainty.

Least squares of the logarithms of natural frequencies and of modal constants beside what is known beforehand (Friswell
and Mottershead, Finite Element Model Updating in Structural Dynamics, 1995, chapter 8): they are nearly linear in the
logarithms of stiffnesses, however sharp the resonances are.  What the numbers leave of both is kept in the model.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from recordings.responses import Responses
from twin.arrays import Array
from twin.identify.estimate import Estimate
from twin.identify.limits import LIMITS as IDENTIFY
from twin.identify.measured_data import MeasuredData
from twin.identify.responses.evidence import Gathered, gather_responses
from twin.identify.responses.limits import LIMITS
from twin.identify.responses.parameters import UpdatedParameter, parameters_of
from twin.rigs import Place, Rig, StructureRig, moduli_values
from twin.structure import assemble, elastic_modes


@dataclass(frozen=True)
class UpdatedValue:
    """A number before and after."""

    name: str
    unit: str
    before: Estimate
    after: Estimate
    """In the unit; of a clamp rotation per moment, 0 for rigid."""
    told: bool
    """Whether the data tell it, or it is rather what was assumed."""


@dataclass(frozen=True)
class FrequencyPair:
    """A measured natural frequency beside the model's, Hz, and how alike their shapes are at the sensors.

    The modal assurance criterion is None where one sensor measured: it has no shape.
    """

    mode: int
    measured_Hz: float
    before_Hz: float
    after_Hz: float
    mac_before: float | None
    mac_after: float | None


@dataclass(frozen=True)
class Updated:
    """A rig with updated numbers, damping, and what is left of natural frequencies and of what sensors show."""

    rig: Rig
    preload: str
    """Of the joints."""
    sources: tuple[str, ...]
    notes: tuple[str, ...]
    """Files, and what an engineer should know of the data."""
    scatter: float
    """Of the natural frequencies from case to case, relative."""
    values: tuple[UpdatedValue, ...]
    pairs: tuple[FrequencyPair, ...]
    damping: Mapping[int, Estimate]
    """Ratio of each mode that was measured, by the mode's number."""
    found: Gathered | None = None
    """The responses; None where a modal table was all there was."""

    def predicted(self, index: int) -> Array:
        """Responses (b, o) of the updated model at the bins of one case."""
        assert self.found is not None
        evidence, data = self.found.evidence, self.found.evidence.broadband[index]
        assert evidence.linear is not None
        outputs = tuple(
            replace(output, modal_factor=row) for output, row in zip(evidence.outputs, self.found.factors, strict=True)
        )
        model = evidence.model.with_places(outputs, [evidence.rig.drive_place])
        base = evidence.linear.base.shifted(data.frequency_offset)
        return np.asarray(model.response(model.receptance(data.omega, base), data.omega))


def update_rig(
    files: Sequence[Responses], rig: Rig, *, preload: str | None = None, scatter: float | None = None
) -> Updated:
    """Update what the responses' modes tell of a rig.

    Parameters
    ----------
    files, preload, scatter
        As for :func:`~twin.identify.responses.gather_responses`.
    """
    rig = with_rest(rig, [], {}, 0.0, 0.0)
    found = gather_responses(files, rig, preload=preload, scatter=scatter)
    parameters = parameters_of(rig, found.evidence.preload)
    before = modes_of(rig, found.evidence.preload, _places(found.evidence))
    x, covariance, updated = np.array([p.start for p in parameters]), np.zeros((len(parameters),) * 2), rig
    for _ in range(LIMITS.updating_rounds if parameters else 0):
        x, covariance = _fitted(rig, parameters, found, x)
        updated = applied(rig, parameters, x)
        found = gather_responses(files, updated, preload=preload, scatter=scatter)
    after, measured = modes_of(updated, found.evidence.preload, _places(found.evidence)), _measured(found)
    evidence = found.evidence
    assert evidence.linear is not None
    pairs = tuple(
        FrequencyPair(
            int(mode) + 1,
            *(float(each.Hz[mode]) for each in (measured, before, after)),
            *(mac(measured.constants[:, mode], each.constants[:, mode]) for each in (before, after)),
        )
        for mode in np.flatnonzero(found.shown)
    )
    # Of a mode above the band, too: what its flank does within is in the responses.
    offsets = evidence.linear.base.frequency_discrepancy.tolist()
    factors = {output.channel: list(row) for output, row in zip(evidence.outputs, found.factors, strict=True)}
    kept = with_rest(updated, offsets, factors, found.scatter, evidence.frequency_scatter)
    ratios = zip(evidence.linear.base.zeta, found.damping_std, found.shown, strict=True)
    zeta = {
        mode: Estimate(float(value), float(value * std)) for mode, (value, std, shown) in enumerate(ratios, 1) if shown
    }
    return Updated(
        with_damping(kept, zeta), evidence.preload, evidence.sources, found.notes, found.scatter,
        told(parameters, x, covariance), pairs, zeta, found,
    )  # fmt: skip


def with_damping(rig: Rig, ratios: Mapping[int, Estimate]) -> Rig:
    """The rig with damping ratios of some modes, by their numbers; modes between take what was assumed of them."""
    if not ratios:
        return rig
    nominal = rig.damping.modal_ratio
    assumed = [nominal[min(mode, len(nominal) - 1)] for mode in range(max(max(ratios), len(nominal)))]
    both = [ratios.get(mode, Estimate(value, 0.0)) for mode, value in enumerate(assumed, 1)]
    both.append(Estimate(nominal[-1], 0.0))  # modes beyond the list take its last entry
    update = {"modal_ratio": [one.value for one in both], "modal_ratio_std": [one.std for one in both]}
    return rig.model_copy(update={"damping": rig.damping.model_copy(update=update)})


def with_rest(
    rig: Rig, offsets: list[float], factors: Mapping[str, list[float]], scatter: float, offset_std: float
) -> Rig:
    """The rig with what its numbers do not explain of natural frequencies and of what sensors show of each mode."""
    own = {"offset": offsets, "scatter": scatter or rig.natural_frequencies.scatter, "offset_std": offset_std}
    update: dict[str, Any] = {"natural_frequencies": rig.natural_frequencies.model_copy(update=own)}
    if isinstance(rig, StructureRig):
        update["sensor"] = [s.model_copy(update={"modal_factor": factors.get(s.channel, [])}) for s in rig.sensor]
    return rig.model_copy(update=update)


def mac(one: Array, other: Array) -> float | None:
    """Modal assurance criterion (Allemang and Brown 1982); None of a single number, which has no shape."""
    alike = abs(np.vdot(one, other)) ** 2 / (np.vdot(one, one) * np.vdot(other, other)).real
    return float(alike) if len(one) > 1 else None


@dataclass(frozen=True)
class MatchedModes:
    """Natural frequencies (m,), Hz, and shapes or modal constants (o, m) at places."""

    Hz: Array
    constants: Array


def _places(evidence: MeasuredData) -> tuple[Place, ...]:
    return tuple(output.place for output in evidence.outputs)


def _measured(found: Gathered) -> MatchedModes:
    """Modes that the responses show."""
    evidence = found.evidence
    assert evidence.linear is not None
    nominal = modes_of(evidence.rig, evidence.preload, _places(evidence))
    shift = np.sqrt(1 + 2 * evidence.linear.base.frequency_discrepancy)
    return MatchedModes(nominal.Hz * shift, nominal.constants * np.array(found.factors))


def modes_of(rig: Rig, preload: str, places: Sequence[Place], *, count: int = IDENTIFY.damped_modes) -> MatchedModes:
    """The first modes of a rig, with their modal constants between places and the drive, 1/kg."""
    structure = assemble(rig)
    modes = elastic_modes(structure.M, structure.stiffness(*moduli_values(rig, preload)), count)
    drive = structure.row(rig.drive_place) @ modes.Phi
    read = np.array([structure.row(place) @ modes.Phi for place in places]).reshape(-1, modes.Phi.shape[1])
    return MatchedModes(modes.frequency_Hz, read * drive)


def applied(rig: Rig, parameters: Sequence[UpdatedParameter], x: Array) -> Rig:
    """The rig with its parameters at these values."""
    for parameter, value in zip(parameters, x, strict=True):
        rig = parameter.apply(rig, float(value))
    return rig


def _fitted(
    rig: Rig, parameters: Sequence[UpdatedParameter], found: Gathered, start: Array
) -> tuple[Array, Array]:  # fmt: skip
    """Coordinates of the parameters (p,) and their covariance (p, p), beside a gain of each response."""
    evidence, measured, shown = found.evidence, _measured(found), found.shown
    places, error = _places(evidence), np.hypot(evidence.frequency_scatter, LIMITS.updating_model)

    def residual(trial: Rig, gains: Array) -> Array:
        model = modes_of(trial, evidence.preload, places)
        # A mode's constant vanishes where a sensor sits on its node: the loss below makes such a one no gross witness.
        level = np.log(np.abs(measured.constants / model.constants)) - gains[:, None]
        return np.concatenate(
            [np.log(measured.Hz / model.Hz)[shown] / error, level[:, shown].ravel() / LIMITS.updating_shape]
        )

    return fit_parameters(rig, parameters, residual, start, gains=len(places))


def fit_parameters(
    rig: Rig,
    parameters: Sequence[UpdatedParameter],
    misfit: Callable[[Rig, Array], Array],
    start: Array,
    *,
    gains: int = 0,
) -> tuple[Array, Array]:
    """Coordinates of the parameters (p,) and their covariance (p, p), to data and to what is known beforehand.

    Parameters
    ----------
    misfit
        Of a rig and of logarithms of gains: residuals of the data in their standard deviations.
    """
    count, none = len(parameters), np.zeros(gains)
    mean, std = (
        np.array([*(p.start for p in parameters), *none]),
        np.array([*(p.std for p in parameters), *(none + LIMITS.updating_gain)]),
    )
    lower = np.array([*(p.lower for p in parameters), *(none - np.inf)])

    def residual(x: Array) -> Array:
        return np.concatenate([misfit(applied(rig, parameters, x[:count]), x[count:]), (x - mean) / std])

    def slopes(x: Array) -> Array:
        here = residual(x)
        steps = 1e-3 * std
        return np.column_stack([(residual(x + h * e) - here) / h for h, e in zip(steps, np.eye(len(x)), strict=True)])

    begun = np.maximum(np.concatenate([start, none]), lower + 1e-3 * std)
    solution = least_squares(
        residual, begun, bounds=(lower, np.inf), jac=slopes, x_scale=std, xtol=1e-5, loss="soft_l1", f_scale=2.0
    )
    J = slopes(solution.x)
    covariance = np.linalg.inv(J.T @ J)
    return solution.x[:count], covariance[:count, :count]


def told(parameters: Sequence[UpdatedParameter], x: Array, covariance: Array) -> tuple[UpdatedValue, ...]:
    """Each number before and after."""
    spread = np.sqrt(np.diag(covariance))
    return tuple(_told(p, float(at), float(std)) for p, at, std in zip(parameters, x, spread, strict=True))


def _told(parameter: UpdatedParameter, at: float, std: float) -> UpdatedValue:
    def estimate(x: float, spread: float) -> Estimate:
        value = parameter.told(x)
        return Estimate(value, abs(parameter.told(x + spread) - value))

    return UpdatedValue(
        parameter.name, parameter.unit, estimate(parameter.start, parameter.std), estimate(at, std),
        std < LIMITS.updating_told * parameter.std,
    )  # fmt: skip
