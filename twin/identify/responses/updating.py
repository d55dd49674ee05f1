"""A rig's numbers updated to the modes that frequency responses show, with their uncertainty.

Least squares of the logarithms of natural frequencies and of modal constants beside what is known beforehand (Friswell
and Mottershead, Finite Element Model Updating in Structural Dynamics, 1995, chapter 8): they are nearly linear in the
logarithms of stiffnesses, however sharp the resonances are.  What the numbers leave of both is kept in the model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from recordings.responses import Responses
from twin.identify.estimate import Estimate
from twin.identify.linear_model import DAMPED_MODES
from twin.identify.measured_data import MeasuredData
from twin.identify.responses.evidence import Gathered, gather_responses
from twin.identify.responses.parameters import UpdatedParameter, parameters_of
from twin.rigs import Rig, StructureRig
from twin.structure import assemble, normal_modes, rigid_motions

__all__ = ["FrequencyPair", "Updated", "UpdatedValue", "update_rig"]

Array = NDArray[Any]

MODEL = 1e-3
"""Relative error of a natural frequency that a good model keeps when all its numbers are right."""
MOST_RIGID = 6
ROUNDS = 2
"""Of following the resonances and of updating, one from the other."""
SHAPE, GAIN = 0.05, 0.05
"""Relative error of a modal constant of a good model, and of a sensor's sensitivity beside the force's."""
TOLD = 0.7
"""Standard deviation over the one beforehand up to which the data tell a number."""


@dataclass(frozen=True)
class UpdatedValue:
    """A number before and after.

    Attributes
    ----------
    before, after : Estimate
        In the unit; of a clamp rotation per moment, 0 for rigid.
    told : bool
        Whether the data tell it, or it is rather what was assumed.
    """

    name: str
    unit: str
    before: Estimate
    after: Estimate
    told: bool


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
    """A rig with updated numbers, damping, and what is left of natural frequencies and of what sensors show.

    Attributes
    ----------
    damping : tuple of Estimate
        Ratios of the first modes.
    """

    rig: Rig
    found: Gathered
    values: tuple[UpdatedValue, ...]
    pairs: tuple[FrequencyPair, ...]
    damping: tuple[Estimate, ...]

    def predicted(self, index: int) -> Array:
        """Responses (b, o) of the updated model at the bins of one case."""
        evidence, data = self.found.evidence, self.found.evidence.broadband[index]
        assert evidence.linear is not None
        outputs = tuple(
            replace(output, modal_factor=row) for output, row in zip(evidence.outputs, self.found.factors, strict=True)
        )
        model, base = evidence.model.with_places(outputs, evidence.rig.drive_place), evidence.linear.base
        base = replace(base, frequency_discrepancy=base.frequency_discrepancy + data.frequency_offset)
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
    rig = _with_rest(rig, [], {}, 0.0, 0.0)
    found = gather_responses(files, rig, preload=preload, scatter=scatter)
    parameters = parameters_of(rig, found.evidence.preload)
    before = _modes(rig, found.evidence)
    x, covariance, updated = np.array([p.start for p in parameters]), np.zeros((len(parameters),) * 2), rig
    for _ in range(ROUNDS if parameters else 0):
        x, covariance = _fitted(rig, parameters, found, x)
        updated = _applied(rig, parameters, x)
        found = gather_responses(files, updated, preload=preload, scatter=scatter)
    after, measured = _modes(updated, found.evidence), _measured(found)
    evidence = found.evidence
    assert evidence.linear is not None
    pairs = tuple(
        FrequencyPair(
            int(mode) + 1,
            *(float(each.Hz[mode]) for each in (measured, before, after)),
            *(_mac(measured.constants[:, mode], each.constants[:, mode]) for each in (before, after)),
        )
        for mode in np.flatnonzero(found.shown)
    )
    values = tuple(
        _told(p, float(at), float(std)) for p, at, std in zip(parameters, x, np.sqrt(np.diag(covariance)), strict=True)
    )
    offsets = np.where(found.shown, evidence.linear.base.frequency_discrepancy, 0.0)
    factors = {
        output.channel: [float(factor) if shown else 1.0 for factor, shown in zip(row, found.shown, strict=True)]
        for output, row in zip(evidence.outputs, found.factors, strict=True)
    }
    kept = _with_rest(updated, offsets.tolist(), factors, found.scatter, evidence.frequency_scatter)
    zeta = tuple(
        Estimate(float(value), float(value * std))
        for value, std in zip(evidence.linear.base.zeta, found.damping_std, strict=True)
    )
    ratios = [*(one.value for one in zeta), *(rig.damping.modal_ratio[DAMPED_MODES:] or rig.damping.modal_ratio[-1:])]
    damping = rig.damping.model_copy(update={"modal_ratio": ratios, "modal_ratio_std": [one.std for one in zeta]})
    return Updated(kept.model_copy(update={"damping": damping}), found, values, pairs, zeta)


def _with_rest(
    rig: Rig, offsets: list[float], factors: Mapping[str, list[float]], scatter: float, offset_std: float
) -> Rig:
    """The rig with what its numbers do not explain of natural frequencies and of what sensors show of each mode."""
    own = {"offset": offsets, "scatter": scatter or rig.natural_frequencies.scatter, "offset_std": offset_std}
    update: dict[str, Any] = {"natural_frequencies": rig.natural_frequencies.model_copy(update=own)}
    if isinstance(rig, StructureRig):
        update["sensor"] = [s.model_copy(update={"modal_factor": factors.get(s.channel, [])}) for s in rig.sensor]
    return rig.model_copy(update=update)


def _mac(one: Array, other: Array) -> float | None:
    """Modal assurance criterion (Allemang and Brown 1982)."""
    return float((one @ other) ** 2 / ((one @ one) * (other @ other))) if len(one) > 1 else None


@dataclass(frozen=True)
class _Modes:
    """Natural frequencies (m,), Hz, and modal constants (o, m) of the responses, 1/kg."""

    Hz: Array
    constants: Array


def _measured(found: Gathered) -> _Modes:
    """Modes that the responses show."""
    evidence = found.evidence
    assert evidence.linear is not None
    nominal = _modes(evidence.rig, evidence)
    shift = np.sqrt(1 + 2 * evidence.linear.base.frequency_discrepancy)
    return _Modes(nominal.Hz * shift, nominal.constants * np.array(found.factors))


def _modes(rig: Rig, evidence: MeasuredData) -> _Modes:
    structure, moduli = assemble(rig), rig.moduli(evidence.preload)
    E, G = (np.array([getattr(m, name) for m in moduli]) for name in ("normal_modulus", "shear_modulus"))
    modes = normal_modes(structure.M, structure.stiffness(E, G), DAMPED_MODES + MOST_RIGID)
    first = rigid_motions(modes.omega)
    kept = slice(first, first + DAMPED_MODES)
    Phi = modes.Phi[:, kept]
    drive = structure.row(rig.drive_place) @ Phi
    read = np.array([structure.row(output.place) @ Phi for output in evidence.outputs])
    return _Modes(modes.omega[kept] / (2 * np.pi), read * drive)


def _applied(rig: Rig, parameters: Sequence[UpdatedParameter], x: Array) -> Rig:
    for parameter, value in zip(parameters, x, strict=True):
        rig = parameter.apply(rig, float(value))
    return rig


def _fitted(
    rig: Rig, parameters: Sequence[UpdatedParameter], found: Gathered, start: Array
) -> tuple[Array, Array]:  # fmt: skip
    """Coordinates of the parameters (p,) and their covariance (p, p), beside a gain of each response."""
    evidence, measured, shown, count = found.evidence, _measured(found), found.shown, len(parameters)
    gains = np.zeros(len(evidence.outputs))
    mean, std = (
        np.array([*(getattr(p, name) for p in parameters), *rest])
        for name, rest in (("start", gains), ("std", gains + GAIN))
    )
    error = np.hypot(evidence.frequency_scatter, MODEL)

    def residual(x: Array) -> Array:
        model = _modes(_applied(rig, parameters, x[:count]), evidence)
        level = np.log(np.abs(measured.constants / model.constants)) - x[count:, None]
        return np.concatenate([
            np.log(measured.Hz / model.Hz)[shown] / error, level[:, shown].ravel() / SHAPE, (x - mean) / std
        ])  # fmt: skip

    lower = np.array([*(p.lower for p in parameters), *(gains - np.inf)])
    begun = np.maximum(np.concatenate([start, gains]), lower + 1e-3 * std)
    step = 1e-3 * std

    def slopes(x: Array) -> Array:
        here = residual(x)
        return np.column_stack([(residual(x + h * e) - here) / h for h, e in zip(step, np.eye(len(x)), strict=True)])

    # A mode's constant vanishes where a sensor sits on its node: such a one is no gross witness.
    solution = least_squares(
        residual, begun, bounds=(lower, np.inf), jac=slopes, x_scale=std, xtol=1e-5, loss="soft_l1", f_scale=2.0
    )  # fmt: skip
    J = slopes(solution.x)
    covariance = np.linalg.inv(J.T @ J)
    return solution.x[:count], covariance[:count, :count]


def _told(parameter: UpdatedParameter, at: float, std: float) -> UpdatedValue:
    def estimate(x: float, spread: float) -> Estimate:
        value = parameter.told(x)
        return Estimate(value, abs(parameter.told(x + spread) - value))

    return UpdatedValue(
        parameter.name, parameter.unit, estimate(parameter.start, parameter.std), estimate(at, std),
        std < TOLD * parameter.std,
    )  # fmt: skip
