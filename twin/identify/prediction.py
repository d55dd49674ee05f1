"""Residuals of all evidence against an extended model, whitened, with their sensitivities to what is always unknown.

Unknowns of the base family: the base parameters (moduli, losses, modal damping, detuning), the spline law's values at
its knots, and two shares that say where in the layer the law acts: how much of the softening is in shear, and how much
of the loss in the normal direction.  All sensitivities are products of receptances (2011 paper, equation 15), taken on
the logarithm of the response as there (equation 16), but of its complex value, so that phase counts too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.evidence import Evidence
from twin.identify.extended_model import extended_model
from twin.identify.extension import Extension
from twin.identify.linear_fit import base_prior, whiten
from twin.identify.linear_model import BaseParameters, believed_parameters
from twin.identify.receptance import update_receptance
from twin.identify.unknowns import TIGHT, Slack, Unknowns

__all__ = ["HarmonicResiduals", "Prediction", "Predictor"]

Array = NDArray[Any]

COMMON_ERROR, RATIO_ERROR = 8e-4, 5e-4
"""Relative model error of a response that all channels share, and of their ratio: discretisation and truncation."""
LAW_ERROR, EVEN_LAW_ERROR = 1e-3, 0.5
"""Relative error of the law at a step, since it is a function of one amplitude and the layer's strains are a field;
and, for each unit of the response's even harmonics over its fundamental, how much more."""


@dataclass(frozen=True)
class HarmonicResiduals:
    """Higher harmonics less the linear response to the force's own, and the factors that whiten them.

    Attributes
    ----------
    orders : ndarray, (h,)
    residual : ndarray, (s, h, o)
    cholesky : ndarray, (s, h, o, o)
        Of their covariance: noise, the error of the linear part, and, in odd harmonics, anything at all in the
        direction of the joint's own signature, since the time form of the joint's law is not known beforehand.
    field : ndarray, (s, h, o, n)
        Response of the outputs to unit forces on all degrees of freedom, of the fitted base model.
    """

    orders: Array
    residual: Array
    cholesky: Array
    field: Array

    def select(self, keep: Array) -> HarmonicResiduals:
        """The steps where `keep` is true."""
        return HarmonicResiduals(self.orders, self.residual[keep], self.cholesky[keep], self.field[keep])

    def whiten(self, values: Array) -> Array:
        """Real vector of whitened values (s, h, o)."""
        white = np.linalg.solve(self.cholesky, values[..., None])[..., 0].ravel()
        return np.concatenate([white.real, white.imag]) * np.sqrt(2.0)


@dataclass(frozen=True)
class Prediction:
    """Whitened residual and sensitivities.

    Attributes
    ----------
    residual : ndarray, (r,)
        Measured minus predicted in units of its standard deviation; real and imaginary parts.
    jacobian : ndarray, (r, u)
        d(predicted) / d(unknowns), whitened alike.
    blocks : tuple of (name, slice)
        Parts of the residual: each broadband run, the steps' fundamentals, their harmonics.
    """

    residual: Array
    jacobian: Array
    blocks: tuple[tuple[str, slice], ...]

    @property
    def chi2(self) -> float:
        """Sum of squares."""
        return float(self.residual @ self.residual)


class Predictor:
    """Evaluates residuals of `evidence` for an extension of the believed rig."""

    def __init__(
        self,
        evidence: Evidence,
        extension: Extension | None = None,
        harmonics: HarmonicResiduals | None = None,
        *,
        slack: Slack = TIGHT,
    ) -> None:
        self.evidence = evidence
        self.extension = extension or Extension()
        self.harmonics = harmonics
        self.slack = slack
        self.model = extended_model(evidence, self.extension)
        E, G = self.model.reference_E, self.model.reference_G
        phi = self.model.basis.Phi[:, 0]
        s = self.model.structure
        self.shear_share = float(np.sum((s.B_G @ phi) ** 2) / np.sum((s.B_E @ phi) ** 2))
        self.moduli = (E, G)

    def prior(self, unknowns: Unknowns) -> tuple[Array, Array]:
        """Mean and precision (u, u) of the unknowns: wide, but the law smooth over neighbouring knots."""
        mean, std = base_prior(
            believed_parameters(self.evidence.rig, self.evidence.preload),
            detuning_std=self.slack.detuning_std,
            moduli_std=self.slack.moduli_std,
        )
        k = len(unknowns.law.knots)
        E = self.moduli[0]
        size = len(mean) + 2 * k + 2
        precision = np.zeros((size, size))
        precision[np.arange(len(mean)), np.arange(len(mean))] = 1 / std**2
        # A loss in G' must be many times G' to matter; its scale is what damps mode 1 like a loss in all of E' does.
        for offset, scale in ((len(mean), E), (len(mean) + k, E / self.shear_share * 0.1)):
            block = slice(offset, offset + k)
            second = np.diff(np.eye(k), 2, axis=0) if k > 2 else np.zeros((0, k))
            precision[block, block] += (np.eye(k) / 10.0**2 + second.T @ second / 0.5**2) / scale**2
        precision[-2, -2] = precision[-1, -1] = 1 / 0.5**2
        return np.concatenate([mean, np.zeros(2 * k + 2)]), precision

    def moduli_changes(self, unknowns: Unknowns, X: Array, time_s: Array) -> tuple[Array, Array]:
        """Complex changes of E' and G' at amplitudes X and times since the run's first step."""
        s, loss = unknowns.law.softening_at(X), unknowns.law.loss_at(X)
        a, b = unknowns.softening_in_shear, unknowns.loss_in_normal
        base, (more_E, more_G) = unknowns.base, self.extension.moduli_factor
        linear_E = base.E * (1 + 1j * base.loss_E) * (more_E * (1 - self.extension.layer_drift_per_s * time_s) - 1)
        linear_G = base.G * (1 + 1j * base.loss_G) * (more_G - 1)
        dE = linear_E - (1 - a) * s + 1j * b * self.shear_share * loss
        dG = linear_G - a * s / self.shear_share + 1j * (1 - b) * loss
        return dE, dG

    def clock(self, omega: Array, time_s: Array) -> Array:
        """Frequency at which the undrifted model responds as the rig does at commanded `omega` and at `time_s`.

        Moduli that all fall by a part e scale the natural frequencies by sqrt(1 - e); the change of the response's
        size by e itself is far smaller and left out.
        """
        fallen = np.clip(self.extension.beam_drift_per_s * time_s, -0.5, 0.5)
        return omega * self.extension.frequency_factor / np.sqrt(1 - fallen)

    def channel_factors(self, omega: Array) -> tuple[Array, Array]:
        """Measured over true: of the outputs (f, o), and of the force (f,)."""
        factor = self.extension.channel_factor
        ones = np.ones(len(omega), complex)
        out = [ones * factor[c](omega) if c in factor else ones for c in self.evidence.channels]
        force = self.evidence.force
        return np.stack(out, axis=1), ones * factor[force](omega) if force in factor else ones

    def responses(self, R: Array, omega: Array) -> Array:
        """Measured response per measured force (f, o) from receptances, with what the channels do to it."""
        H = self.model.response(R, omega)
        H = H + self._base_motion(R, omega)
        outputs, force = self.channel_factors(omega)
        H = outputs * H / force[:, None]
        for channel, source, part in self.extension.cross_talk:
            if channel not in self.evidence.channels:
                continue
            read = np.ones(len(omega)) if source == self.evidence.force else H[:, self.evidence.channels.index(source)]
            H[:, self.evidence.channels.index(channel)] += part * read
        return H

    def receptance(self, omega: Array, base: BaseParameters, dE: Array, dG: Array) -> Array:
        """Receptances between all ports, attachments included."""
        R = self.model.receptance(omega, base, dE=dE, dG=dG)
        at = self.model.ports.extra.start
        for attachment in self.extension.attachments:
            Z = attachment.stiffness(omega)
            width = Z.shape[1]
            R = _attach(R, slice(at, at + width), Z)
            at += width
        return R

    def evaluate(self, unknowns: Unknowns, *, sensitivities: bool = True) -> Prediction:
        """Residual of all evidence, with its sensitivities unless they are not wanted (the jacobian is zero then)."""
        residuals, jacobians, blocks = [], [], []
        row = 0
        for name, (r, J) in self._blocks(unknowns, sensitivities):
            residuals.append(r)
            jacobians.append(J)
            blocks.append((name, slice(row, row + len(r))))
            row += len(r)
        return Prediction(np.concatenate(residuals), np.vstack(jacobians), tuple(blocks))

    def _blocks(self, unknowns: Unknowns, sensitivities: bool) -> list[tuple[str, tuple[Array, Array]]]:
        out = [
            (f"broadband {i}", self._broadband(i, unknowns, sensitivities)) for i in range(len(self.evidence.broadband))
        ]
        if len(self.evidence.steps):
            R, omega = self.step_receptance(unknowns)
            out.append(("steps", self._steps(unknowns, R, omega, sensitivities)))
            if self.harmonics is not None:
                out.append(("harmonics", self._harmonics(unknowns, R)))
        return out

    def _broadband(self, index: int, unknowns: Unknowns, sensitivities: bool) -> tuple[Array, Array]:
        data = self.evidence.broadband[index]
        time = np.full(len(data.omega), data.time_s - self.evidence.origin_s)
        omega = self.clock(data.omega, time)
        dE, dG = self.moduli_changes(unknowns, np.zeros(len(omega)), time)
        R = self.receptance(omega, unknowns.base, dE, dG)
        H = self.responses(R, omega)
        common, ratio = self.slack.error_scale * COMMON_ERROR, self.slack.error_scale * RATIO_ERROR
        covariance = data.relative_covariance + common**2 + (ratio * data.depth[:, :, None]) ** 2 * np.eye(H.shape[1])
        # log of the ratio: the paper's dB residual and the phase at once, and no false minima of hidden resonances.
        r, root = whiten(covariance, np.log(data.H / H)).ravel(), np.sqrt(2.0)
        residual = root * np.concatenate([r.real, r.imag])
        jacobian = np.zeros((len(residual), len(unknowns.vector)))
        if sensitivities:
            plain = self.model.response(R, omega)
            J = whiten(covariance, self.model.sensitivity(R, omega, unknowns.base) / plain[:, :, None])
            J = J.reshape(len(r), -1)
            jacobian[:, : J.shape[1]] = root * np.vstack([J.real, J.imag])
        return residual, jacobian

    def step_receptance(self, unknowns: Unknowns) -> tuple[Array, Array]:
        """Receptances at the steps' drive frequencies, each with the law at its own amplitude; and omega."""
        steps = self.evidence.steps
        time = steps.time_s - self.evidence.origin_s
        omega = self.clock(steps.omega, time)
        R = self.receptance(omega, unknowns.base, *self.moduli_changes(unknowns, steps.amplitude_m, time))
        return self.with_nonlinear(R, omega), omega

    def _steps(self, unknowns: Unknowns, R: Array, omega: Array, sensitivities: bool) -> tuple[Array, Array]:
        steps = self.evidence.steps
        H = self.responses(R, omega)
        predicted = H * steps.force[:, :1]
        r = np.log(steps.response[:, :, 0] / predicted)
        J = self._step_sensitivity(R, omega, unknowns, steps.amplitude_m)
        return _whiten_steps(r, J, steps, self._law_columns(unknowns), self.slack.error_scale, sensitivities)

    def extra_harmonics(self, unknowns: Unknowns, R: Array) -> Array:
        """Harmonics (s, h, o) that the extension's nonlinear forces add, at receptances R of the fundamentals."""
        assert self.harmonics is not None
        h = self.harmonics
        forces = self._force_harmonics(unknowns, R, int(h.orders[-1]))[:, :, h.orders - 1]
        rows = np.array([force.row(self.evidence.model.structure) for force in self.extension.nonlinear])
        return -np.asarray(np.einsum("shop,sph->sho", h.field @ rows.T, forces))

    def _harmonics(self, unknowns: Unknowns, R: Array) -> tuple[Array, Array]:
        """Whitened harmonics less what the extension's nonlinear forces make; base parameters hardly move them."""
        assert self.harmonics is not None
        residual = self.harmonics.residual
        if self.extension.nonlinear:
            residual = residual - self.extra_harmonics(unknowns, R)
        r = self.harmonics.whiten(residual)
        return r, np.zeros((len(r), len(unknowns.vector)))

    def _step_sensitivity(self, R: Array, omega: Array, unknowns: Unknowns, X: Array) -> Array:
        """D log response / d unknowns, (s, o, u)."""
        p = self.model.ports
        H = self.model.response(R, omega)[:, :, None]
        base = self.model.sensitivity(R, omega, unknowns.base)
        into, out = R[:, :, p.drive], R[:, p.outputs, :]
        factor = self.model.to_quantity(omega)
        SE = -np.sum(out[:, :, p.normal] * into[:, None, p.normal], axis=2) * factor
        SG = -np.sum(out[:, :, p.shear] * into[:, None, p.shear], axis=2) * factor
        B = unknowns.law.basis(X)
        a, b, q = unknowns.softening_in_shear, unknowns.loss_in_normal, self.shear_share
        s, loss = (B @ unknowns.law.softening)[:, None], (B @ unknowns.law.loss)[:, None]
        softening = -(1 - a) * SE - a / q * SG
        losing = 1j * (b * q * SE + (1 - b) * SG)
        columns = [
            base,
            softening[:, :, None] * B[:, None, :],
            losing[:, :, None] * B[:, None, :],
            (s * (SE - SG / q))[:, :, None],
            (1j * loss * (q * SE - SG))[:, :, None],
        ]
        return np.concatenate(columns, axis=2) / H

    def _law_columns(self, unknowns: Unknowns) -> tuple[slice, slice, Array, Array]:
        n, k = len(unknowns.base.vector), len(unknowns.law.knots)
        return slice(n, n + k), slice(n + k, n + 2 * k), unknowns.law.softening, unknowns.law.loss

    @property
    def nonlinear_ports(self) -> slice:
        """Where the nonlinear forces' ports are."""
        stop = self.model.ports.extra.stop - (1 if self.extension.base_receptance else 0)
        return slice(stop - len(self.extension.nonlinear), stop)

    def _port_motion(self, R: Array, omega: Array) -> Array:
        """Complex amplitudes (s, p) at the nonlinear forces' ports, m.

        They follow from the measured motion of the reference channel, as the law's amplitude does, not from the force:
        near a sharp resonance the response to that is far more uncertain than the shape of the motion.
        """
        steps, reference = self.evidence.steps, self.evidence.reference
        per_reference = (
            R[:, self.nonlinear_ports, self.model.ports.drive] / self.responses(R, omega)[:, reference, None]
        )
        return np.asarray(per_reference * steps.response[:, reference, 0, None])

    def with_nonlinear(self, R: Array, omega: Array) -> Array:
        """Receptances with the equivalent stiffness of local nonlinearities at each step's own amplitude."""
        if not self.extension.nonlinear:
            return R
        updated = R
        # The ports' share of the motion depends on the stiffness there: fixed-point turns, enough for a correction.
        for _ in range(6):
            amplitude = np.abs(self._port_motion(updated, omega))
            k = [f.equivalent(amplitude[:, i], omega) for i, f in enumerate(self.extension.nonlinear)]
            updated = _attach(R, self.nonlinear_ports, np.stack(k, axis=1))
        return updated

    def harmonic_fields(self, unknowns: Unknowns, orders: Array, *, stretch: float = 1.0) -> tuple[Array, Array, Array]:
        """Responses at multiples of the drive frequency, all frequencies times `stretch`.

        Returns
        -------
        linear : ndarray, (s, h, o)
            Response to the measured force harmonics.
        joint : ndarray, (s, h, o)
            Response to a unit force on the layer's opening in the shape of mode 1: what the joint's law adds.
        field : ndarray, (s, h, o, n)
            Response of each output to a unit force on every degree of freedom.
        """
        steps, p = self.evidence.steps, self.model.ports
        time = steps.time_s - self.evidence.origin_s
        dE, dG = self.moduli_changes(unknowns, steps.amplitude_m, time)
        first = stretch * self.clock(steps.omega, time)
        opening = self.model.ports.rows[p.normal] @ self.model.basis.Phi[:, 0]
        linear, joint, field = [], [], []
        for h in orders:
            omega = h * first
            R = self.receptance(omega, unknowns.base, dE, dG)
            factor = self.model.to_quantity(omega) * self.channel_factors(omega)[0]
            linear.append(self.responses(R, omega) * steps.force[:, h - 1, None])
            joint.append((R[:, p.outputs, p.normal] @ opening) * factor)
            field.append(self.model.output_field(omega, unknowns.base, dE, dG) * factor[:, :, None])
        return np.stack(linear, axis=1), np.stack(joint, axis=1), np.stack(field, axis=1)

    def _force_harmonics(self, unknowns: Unknowns, R: Array, count: int) -> Array:
        """Harmonics (s, p, h) of the nonlinear forces at the steps' own motion, in the steps' phase."""
        steps = self.evidence.steps
        time = steps.time_s - self.evidence.origin_s
        motion = self._port_motion(R, self.clock(steps.omega, time))
        stiffness = unknowns.base.E + self.moduli_changes(unknowns, steps.amplitude_m, time)[0].real
        left = stiffness / self.moduli[0]
        turn = np.exp(1j * np.angle(motion)[:, :, None] * np.arange(1, count + 1))
        values = [f.harmonics(np.abs(motion[:, i]), count, left) for i, f in enumerate(self.extension.nonlinear)]
        return np.stack(values, axis=1) * turn

    def _base_motion(self, R: Array, omega: Array) -> Array | float:
        """Response to a clamp that moves with the drive force: rigid motion plus the inertia load it causes."""
        if self.extension.base_receptance == 0.0:
            return 0.0
        p = self.model.ports
        inertia = R[:, p.outputs, p.extra.stop - 1] * omega[:, None] ** 2
        return self.extension.base_receptance * (1 + inertia) * self.model.to_quantity(omega)


def _attach(R: Array, ports: slice, Z: Array) -> Array:
    """Receptances after attaching dynamic stiffness Z, (f, p) or (f, p, p), to `ports`."""
    if Z.ndim == 2:
        return update_receptance(R, ports, Z)
    A = np.eye(Z.shape[1]) + R[:, ports, ports] @ Z
    T = Z @ np.linalg.solve(A, np.broadcast_to(np.eye(Z.shape[1]), A.shape))
    return R - R[:, :, ports] @ T @ R[:, ports, :]


def _whiten_steps(
    r: Array, J: Array, steps: Any, law: tuple[slice, slice, Array, Array], error_scale: float, sensitivities: bool
) -> tuple[Array, Array]:
    """Whiten the steps' complex log residuals (s, o): noise, shared force noise, model error, the law's own error."""
    count, outputs = r.shape
    relative = steps.response_variance[:, :, 0] / np.abs(steps.response[:, :, 0]) ** 2
    shared = (
        steps.force_variance[:, 0] / np.abs(steps.force[:, 0]) ** 2
        + steps.unsettled**2
        + (error_scale * COMMON_ERROR) ** 2
    )
    circular = shared[:, None, None] + (relative + (error_scale * RATIO_ERROR) ** 2)[:, :, None] * np.eye(outputs)
    covariance = np.zeros((count, 2 * outputs, 2 * outputs))
    covariance[:, :outputs, :outputs] = covariance[:, outputs:, outputs:] = circular / 2
    # Even harmonics come of a joint that opens on one side: its law at the fundamental then heeds more than amplitude.
    even = np.nan_to_num(np.abs(steps.response[:, :, 1::2] / steps.response[:, :, :1]))
    law_error = np.hypot(LAW_ERROR, EVEN_LAW_ERROR * np.sqrt(np.sum(even**2, axis=2).mean(axis=1)))[:, None]
    stacked = np.concatenate([J.real, J.imag], axis=1)
    for block, values in ((law[0], law[2]), (law[1], law[3])):
        error = law_error * (stacked[:, :, block] @ values)
        covariance += error[:, :, None] * error[:, None, :]
    L = np.linalg.cholesky(covariance)
    white_r = np.linalg.solve(L, np.concatenate([r.real, r.imag], axis=1)[:, :, None])[:, :, 0]
    white_J = np.linalg.solve(L, stacked) if sensitivities else np.zeros_like(stacked)
    return white_r.ravel(), white_J.reshape(-1, J.shape[2])
