"""Coupled responses predicted, and the joints' stiffness and loss factors identified from measured ones.

All lines of all responses are fitted at once by Gauss-Newton on logarithms, the residual of which a resonance that is
off does not make endless.  Unknown are the joints and, within what their own measurement leaves, the synthesised parts:
so the joints' standard deviations hold the noise of both measurements (Tsai and Chou, Journal of Sound and Vibration
125, 1988, identify a joint so, line by line).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from recordings.errors import InputError
from recordings.quantities import quantity
from recordings.responses import Responses
from twin.arrays import Array
from twin.identify.gauss_newton import Solution, StepRule, minimise
from twin.identify.responses.matching import Matched, match_responses
from twin.identify.responses.reduction import noise_of
from twin.substructuring.expansion import Expansion
from twin.substructuring.limits import LIMITS
from twin.substructuring.measured_part import same_lines
from twin.substructuring.substructures import Substructures

Gap = tuple[str, str]
"""Connection and motion."""


@dataclass(frozen=True)
class JointValues:
    """What the connections are."""

    stiffness: Mapping[Gap, float]
    stiffness_std: Mapping[Gap, float]
    """N/m or N m/rad, by connection and motion, without the rigid ones."""
    loss_factor: Mapping[str, float]
    loss_std: Mapping[str, float]
    """By connection."""

    @staticmethod
    def of(parts: Substructures) -> JointValues:
        """Those of the rig file, of which no deviation is known."""
        stiffness: dict[Gap, float] = {
            (one.name, dof): k for one in parts.rig.connection for dof, k in one.stiffness.items()
        }
        loss = {one.name: one.loss_factor for one in parts.rig.connection if one.stiffness}
        return JointValues(stiffness, dict.fromkeys(stiffness, 0.0), loss, dict.fromkeys(loss, 0.0))


@dataclass(frozen=True, eq=False)
class CoupledPrediction:
    """Coupled responses."""

    frequency_Hz: Array
    """(f,)."""
    H: Array
    """Response of each sensor over the force of each drive, in SI units, complex (f, o, d)."""
    std: Array
    """Root of its complex variance, (f, o, d): what the measurements leave open of parts and, if identified, of
    joints."""


@dataclass(frozen=True, eq=False)
class JointFit:
    """Identified joints."""

    values: JointValues
    before: CoupledPrediction
    after: CoupledPrediction
    """At the lines that were fitted, (f,)."""
    measured: Array
    """NaN where nothing was measured, complex (f, o, d)."""
    chi2_per_dof: float
    """Standard deviations are widened by its root where it is above one."""
    parts: Substructures
    """With the measured parts' parameters as they are beside these joints."""
    covariance: Array
    """Of the logarithms of stiffnesses, the loss factors and the parts' parameters, (n, n)."""
    notes: tuple[str, ...]

    @property
    def errors(self) -> tuple[float, float]:
        """Relative error of the prediction before and after: its size, the median over all lines and responses."""
        before, after = (float(np.nanmedian(np.abs(p.H / self.measured - 1))) for p in (self.before, self.after))
        return before, after


@dataclass(frozen=True, eq=False)
class _Model:
    """Responses with their derivatives by logarithms of stiffnesses, loss factors and the parts' parameters."""

    parts: Substructures
    frequency_Hz: Array
    Y: Array
    expansions: tuple[Expansion, ...]

    @staticmethod
    def at(parts: Substructures, frequency_Hz: Array) -> _Model:
        return _Model(parts, frequency_Hz, *parts.uncoupled(2 * np.pi * frequency_Hz))

    def vector(self, values: JointValues) -> Array:
        """Joints first, then the parts' parameters."""
        joints = [*np.log([*values.stiffness.values()]), *values.loss_factor.values()]
        return np.concatenate([joints, *(part.synthesis.vector for part in self.parts.parts)])

    def parts_at(self, x: Array) -> Substructures:
        """With the measured parts' parameters that a vector has."""
        sizes = [len(part.synthesis.vector) for part in self.parts.parts]
        return self.parts.with_vectors(np.split(x[len(x) - sum(sizes) :], np.cumsum(sizes)[:-1]))

    def values(self, x: Array, std: Array) -> JointValues:
        file = JointValues.of(self.parts)
        n = len(file.stiffness)
        k = dict(zip(file.stiffness, np.exp(x[:n]).tolist(), strict=True))
        loss = dict(zip(file.loss_factor, x[n : n + len(file.loss_factor)].tolist(), strict=True))
        k_std = {gap: value * float(s) for (gap, value), s in zip(k.items(), std, strict=False)}
        return JointValues(k, k_std, loss, dict(zip(loss, std[n : n + len(loss)].tolist(), strict=True)))

    def evaluate(self, x: Array, *, derivatives: bool = True) -> tuple[Array, Array]:
        """H (f, o, d) and its derivatives (f, o, d, n); none of these (n = 0) if not wanted."""
        omega, rig = 2 * np.pi * self.frequency_Hz, self.parts.rig
        first = JointValues.of(self.parts)
        gaps, losses = [*first.stiffness], [*first.loss_factor]
        n = len(gaps) + len(losses)
        parts = self.parts_at(x)
        slope = np.zeros((len(self.parts.joints), n), complex)
        F = np.zeros(len(slope), complex)
        for row, (connection, dof) in enumerate(self.parts.joints):
            if dof in connection.stiffness:
                a, b = gaps.index((connection.name, dof)), len(gaps) + losses.index(connection.name)
                F[row] = np.exp(-x[a]) / (1 + 1j * x[b])
                slope[row, a], slope[row, b] = -F[row], -1j * F[row] / (1 + 1j * x[b])
        coupled = parts.coupled(omega, self.Y, self.expansions, np.broadcast_to(F, (len(omega), len(F))))
        drives, sensors = len(rig.drives), rig.response_sensors
        outputs = slice(drives, drives + len(sensors))
        factor = np.stack([(1j * omega) ** quantity(s.quantity).derivative for s in sensors], axis=1)[..., None]
        H = factor * coupled.receptance[:, outputs, :drives]
        if not derivatives:
            return H, np.zeros((*H.shape, 0))
        held = coupled.forces[:, : len(F)]
        columns = [np.einsum("fco,fcd,cn->fodn", held[:, :, outputs], held[:, :, :drives], slope, optimize=True)]
        for part, expansion in zip(parts.parts, self.expansions, strict=True):
            through = np.swapaxes(expansion.transform, 1, 2) @ coupled.loads[:, part.ports]
            left = np.swapaxes(through[:, :, outputs], 1, 2)
            columns.append(np.stack([
                part.synthesis.derivatives(omega, left, through[:, :, drive]) for drive in range(drives)
            ], axis=2))  # fmt: skip
        return H, factor[..., None] * np.concatenate(columns, axis=3)

    def predicted(self, x: Array, covariance: Array) -> CoupledPrediction:
        H, J = self.evaluate(x)
        variance = np.einsum("fodn,nm,fodm->fod", J, covariance, J.conj(), optimize=True).real
        return CoupledPrediction(self.frequency_Hz, H, np.sqrt(np.maximum(variance, 0.0)))


def predict(parts: Substructures, fit: JointFit | None = None) -> CoupledPrediction:
    """Coupled responses of the rig's sensors over the forces of its drives, at the lines of the measured parts.

    Parameters
    ----------
    fit
        Identified joints; the rig file's if not given.

    Raises
    ------
    InputError
        If the interface is singular.
    """
    if fit is not None:
        model = _Model.at(fit.parts, fit.parts.frequency_Hz)
        return model.predicted(model.vector(fit.values), fit.covariance)
    model = _Model.at(parts, parts.frequency_Hz)
    joints = JointValues.of(parts)
    known = _covariance_of_parts(parts, len(joints.stiffness) + len(joints.loss_factor))
    return model.predicted(model.vector(joints), known)


def identify_joints(parts: Substructures, file: Responses) -> JointFit:
    """Identify stiffness and loss factor of all connections that are not rigid.

    Parameters
    ----------
    file
        Measured responses of the whole: of the rig's sensors over the forces of its drives.

    Raises
    ------
    InputError
        If nothing can be identified, or the responses do not fit the rig.
    """
    start = JointValues.of(parts)
    if not start.stiffness:
        raise InputError(parts.rig.name, "connection", "all are rigid: nothing to identify", "give one a stiffness")
    frequency_Hz, measured, std = _measured(parts, file)
    model = _Model.at(parts, frequency_Hz)
    seen = np.isfinite(measured) & (std < LIMITS.noisiest)
    x0 = model.vector(start)
    n, joints = len(x0), len(start.stiffness) + len(start.loss_factor)
    prior = [LIMITS.guessed] * len(start.stiffness) + [LIMITS.guessed_loss] * len(start.loss_factor)
    precision = block_diag(np.diag(1 / np.square(prior)), *(part.synthesis.information for part in parts.parts))
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    stiff = slice(0, len(start.stiffness))
    lower[stiff], upper[stiff] = x0[stiff] - np.log(LIMITS.bounds), x0[stiff] + np.log(LIMITS.bounds)
    lower[len(start.stiffness) : joints], upper[len(start.stiffness) : joints] = 0.0, LIMITS.guessed_loss

    def residual(x: Array, loose: float, *, derivatives: bool = True) -> tuple[Array, Array]:
        H, J = model.evaluate(x, derivatives=derivatives)
        weight = np.sqrt(2 / (std[seen] ** 2 + loose**2))
        r, J = weight * np.log(measured[seen] / H[seen]), weight[:, None] * J[seen] / H[seen][:, None]
        return np.concatenate([r.real, r.imag]), np.vstack([J.real, J.imag])

    def tried(factor: float) -> Array:
        x = x0.copy()
        x[stiff] += np.log(factor)
        return x

    x = min(
        (tried(factor) for factor in LIMITS.tried),
        key=lambda x: float(np.sum(residual(x, LIMITS.loose[0], derivatives=False)[0] ** 2)),
    )
    solution: Solution
    for loose in LIMITS.loose:
        solution = minimise(
            lambda x, loose=loose: residual(x, loose), x, mean=x0, precision=precision,  # type: ignore[misc]
            steps=StepRule(bounds=(lower, upper)),
        )  # fmt: skip
        x = solution.x
    chi2 = solution.chi2 / max(1, 2 * int(seen.sum()) - joints)
    covariance = solution.covariance * max(1.0, chi2)
    values = model.values(x, np.sqrt(np.diag(covariance)))
    fitted = model.parts_at(x)
    notes = [
        f"{name} {dof}: these responses hardly show its stiffness" for (name, dof), value in values.stiffness.items()
        if values.stiffness_std[name, dof] > LIMITS.vague * value
    ]  # fmt: skip
    if chi2 > LIMITS.poor:
        notes.append(f"the joints leave {chi2:.3g} times the noise's chi2: deviations are widened by its root")
    before = model.predicted(x0, _covariance_of_parts(parts, joints))
    after = _Model.at(fitted, frequency_Hz).predicted(x, covariance)
    return JointFit(values, before, after, measured, chi2, fitted, covariance, tuple(notes))


def _covariance_of_parts(parts: Substructures, joints: int) -> Array:
    """Covariance (n, n) of what the parts' measurements leave open, the joints' numbers given."""
    return np.asarray(block_diag(
        np.zeros((joints, joints)), *(np.linalg.inv(part.synthesis.information) for part in parts.parts)
    ))  # fmt: skip


def _measured(parts: Substructures, file: Responses) -> tuple[Array, Array, Array]:
    """Lines within those of the parts, responses (f, o, d) there, and their relative standard deviations."""
    rig, told = parts.rig, None
    found: dict[tuple[str, int], Matched] = {}
    for column, drive in enumerate(rig.drives):
        try:
            matched: Sequence[Matched] = match_responses(file, rig.driven_by(drive))[0]
        except InputError as error:
            told = error
            continue
        found |= {(one.channel, column): one for one in matched}
    if not found:
        assert told is not None
        raise told
    first = next(iter(found.values())).found
    own = parts.frequency_Hz
    inside = (first.frequency_Hz >= own[0]) & (first.frequency_Hz <= own[-1])
    if inside.sum() < LIMITS.fewest_lines:
        raise InputError(
            file.path, first.place, f"has {inside.sum()} lines from {own[0]:g} to {own[-1]:g} Hz, where the parts were "
            "measured", f"{LIMITS.fewest_lines} are needed",
        )  # fmt: skip
    channels = [sensor.channel for sensor in rig.response_sensors]
    shape = int(inside.sum()), len(channels), len(rig.drives)
    H, std = np.full(shape, np.nan + 0j), np.full(shape, np.inf)
    for (channel, column), one in found.items():
        response, row = one.found, channels.index(channel)
        if not same_lines(response.frequency_Hz, first.frequency_Hz):
            raise InputError(file.path, response.place, "has other lines than the first", "export all on one axis")
        asked = rig.response_sensors[row].quantity
        change = quantity(asked).derivative - quantity(response.quantity or asked).derivative
        omega = 2 * np.pi * first.frequency_Hz[inside]
        H[:, row, column] = one.sign * response.H[inside] * (1j * omega) ** change
        std[:, row, column] = np.sqrt(np.maximum(noise_of(response)[inside], np.finfo(float).eps))
    return first.frequency_Hz[inside], H, std
