"""Residuals of all evidence against an extended model, whitened, with their sensitivities to what is always unknown.

Unknowns of the base family: the base parameters (moduli, losses, modal damping, detuning), the spline law's values at
its knots, and two shares that say where in the layer the law acts: how much of the softening is in shear, and how much
of the loss in the normal direction.  All sensitivities are products of receptances (2011 paper, equation 15), taken on
the logarithm of the response as there (equation 16), but of its complex value, so that phase counts too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.broadband import BinnedResponse
from twin.identify.evidence import Evidence
from twin.identify.extended_rig import ExtendedRig
from twin.identify.extension import Extension, JointState
from twin.identify.linear_fit import base_prior, whiten
from twin.identify.linear_model import believed_parameters
from twin.identify.unknowns import TIGHT, Slack, Unknowns
from twin.identify.whitening import COMMON_ERROR, RATIO_ERROR, HarmonicResiduals, step_factor

__all__ = ["Prediction", "Predictor"]

Array = NDArray[Any]

SHARE_STD = 0.1
"""Of the shares that say where in the layer the law acts; zero is the papers' softening of E' and loss in G'."""


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


class Predictor(ExtendedRig):
    """Evaluates residuals of `evidence` for an extension of the believed rig."""

    def __init__(
        self,
        evidence: Evidence,
        extension: Extension | None = None,
        harmonics: HarmonicResiduals | None = None,
        *,
        slack: Slack = TIGHT,
        step_factor: Array | None = None,
    ) -> None:
        super().__init__(evidence, extension)
        self.harmonics = harmonics
        self.slack = slack
        self._factor = step_factor

    def prior(self, unknowns: Unknowns) -> tuple[Array, Array]:
        """Mean and precision (u, u) of the unknowns: wide, but the law smooth over neighbouring knots."""
        believed, linear = believed_parameters(self.evidence.rig, self.evidence.preload), self.evidence.linear
        if linear is not None and self.slack.moduli_std < TIGHT.moduli_std:
            # While a fit finds its way the moduli are held, but where the broadband run can be followed at all.
            believed = replace(believed, E=linear.believed.E, G=linear.believed.G)
        mean, base = base_prior(
            believed,
            detuning_std=self.slack.detuning_std,
            moduli_std=self.slack.moduli_std,
        )
        k = len(unknowns.law.knots)
        E = self.moduli[0]
        size = len(mean) + 2 * k + 2
        precision = np.zeros((size, size))
        precision[: len(mean), : len(mean)] = base
        # A loss in G' must be many times G' to matter; its scale is what damps mode 1 like a loss in all of E' does.
        for part, scale in enumerate((E, 0.1 * E / self.shear_share)):
            block = slice(len(mean) + part * k, len(mean) + (part + 1) * k)
            # The same curvature, however many knots there are.
            bend = self.slack.law_bend * (19 / max(k - 1, 1)) ** 2
            second = np.diff(np.eye(k), 2, axis=0) if k > 2 else np.zeros((0, k))
            precision[block, block] += (np.eye(k) / 10.0**2 + second.T @ second / bend**2) / scale**2
        precision[-2, -2] = precision[-1, -1] = 1 / SHARE_STD**2
        return np.concatenate([mean, np.zeros(2 * k + 2)]), precision

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
            R, omega = self.step_receptance(unknowns, inner=sensitivities or self._factor is None)
            change = self._step_changes(unknowns, R, omega) if sensitivities else None
            out.append(("steps", self._steps(unknowns, R, omega, change)))
            if self.harmonics is not None:
                out.append(("harmonics", self._harmonics(unknowns, R, change)))
        return out

    def broadband_response(self, data: BinnedResponse, unknowns: Unknowns) -> Array:
        """Responses per force (b, o) at the bins of a broadband run, unit/N."""
        return self.responses(*self.felt_receptance(data, unknowns, inner=False))

    def _broadband(self, index: int, unknowns: Unknowns, sensitivities: bool) -> tuple[Array, Array]:
        data = self.evidence.broadband[index]
        R, omega = self.felt_receptance(data, unknowns, inner=sensitivities)
        H = self.responses(R, omega)
        common, ratio = self.slack.error_scale * COMMON_ERROR, self.slack.error_scale * RATIO_ERROR
        covariance = data.relative_covariance + common**2 + (ratio * data.depth[:, :, None]) ** 2 * np.eye(H.shape[1])
        # log of the ratio: the paper's dB residual and the phase at once, and no false minima of hidden resonances.
        r, root = whiten(covariance, np.log(data.H / H)).ravel(), np.sqrt(2.0)
        residual = root * np.concatenate([r.real, r.imag])
        jacobian = np.zeros((len(residual), len(unknowns.vector)))
        if sensitivities:
            p, into = self.model.ports, self.driven(R, omega)
            time = np.full(len(omega), data.time_s - self.evidence.origin_s)
            change = self._base_change(R, omega, unknowns, time, np.arange(R.shape[1])[p.outputs], into)
            change = self.measured_change(change, omega)
            J = whiten(covariance, change / H[:, :, None]).reshape(len(r), -1)
            jacobian[:, : J.shape[1]] = root * np.vstack([J.real, J.imag])
        return residual, jacobian

    def _steps(
        self, unknowns: Unknowns, R: Array, omega: Array, change: tuple[Array, Array] | None
    ) -> tuple[Array, Array]:
        steps = self.evidence.steps
        r = np.log(steps.response[:, :, 0] / (self.responses(R, omega) * steps.force[:, :1]))
        factor = self._factor
        if factor is None:
            factor = self._law_factor((change or self._step_changes(unknowns, R, omega))[0], unknowns)
        white = np.linalg.solve(factor, np.concatenate([r.real, r.imag], axis=1)[:, :, None])[:, :, 0].ravel()
        if change is None:
            return white, np.zeros((len(white), len(unknowns.vector)))
        J = np.concatenate([change[0].real, change[0].imag], axis=1)
        return white, np.linalg.solve(factor, J).reshape(len(white), -1)

    def step_factor(self, unknowns: Unknowns) -> Array | None:
        """Cholesky factors (s, 2 o, 2 o) of the steps' covariance, which depends on the law; None without steps.

        Given to another predictor it is held: a fit whose weights moved with its parameters would creep.
        """
        if not len(self.evidence.steps):
            return None
        R, omega = self.step_receptance(unknowns)
        return self._law_factor(self._step_changes(unknowns, R, omega)[0], unknowns)

    def _law_factor(self, J: Array, unknowns: Unknowns) -> Array:
        n, k = len(unknowns.base.vector), len(unknowns.law.knots)
        by_softening = J[:, :, n : n + k] @ unknowns.law.softening
        by_loss = J[:, :, n + k : n + 2 * k] @ unknowns.law.loss
        return step_factor(self.evidence.steps, (by_softening, by_loss), self.slack.error_scale)

    def motion_at_forces(self, unknowns: Unknowns) -> Array:
        """Complex amplitudes (s, n) of the steps at the ports of the extension's nonlinear forces, m."""
        return self.port_motion(*self.step_receptance(unknowns))[0]

    def extra_harmonics(self, unknowns: Unknowns, R: Array) -> Array:
        """Harmonics (s, h, o) that the extension's nonlinear forces add, at receptances R of the fundamentals."""
        forces = self.local.harmonics(*self._forced(unknowns, R))
        return self._by_local_forces(forces[..., None])[..., 0]

    def _harmonics(self, unknowns: Unknowns, R: Array, change: tuple[Array, Array] | None) -> tuple[Array, Array]:
        """Whitened harmonics less what the extension's nonlinear forces make."""
        assert self.harmonics is not None
        residual, forces = self.harmonics.residual, None
        if self.extension.nonlinear:
            forced = self._forced(unknowns, R)
            forces = self.local.harmonics(*forced)
            residual = residual - self._by_local_forces(forces[..., None])[..., 0]
        r = self.harmonics.whiten(residual)
        if change is None or forces is None:
            return r, np.zeros((len(r), len(unknowns.vector)))
        changes = self.local.harmonic_changes(forces, *forced, change[1], self._left_change(unknowns))
        return r, self.harmonics.whiten(self._by_local_forces(changes))

    def _by_local_forces(self, forces: Array) -> Array:
        """Harmonics (s, h, o, u) of the outputs by harmonics (s, n, h, u) of the nonlinear forces."""
        assert self.harmonics is not None
        rows = np.array([force.row(self.harmonics.structure) for force in self.extension.nonlinear])
        at = self.harmonics.field @ rows.T
        return -np.asarray(np.einsum("shop,sphu->shou", at, forces[:, :, self.harmonics.orders - 1]))

    def _base_change(
        self, R: Array, omega: Array, unknowns: Unknowns, time_s: Array, ports: Array, into: Array
    ) -> Array:
        """D displacement / d base parameters (f, q, b): the extension's factors on the moduli are factors on theirs."""
        change = self.model.displacement_sensitivity(R, omega, unknowns.base, ports, into)
        more_E, more_G = self.extension.moduli_factor
        change[:, :, [0, 2]] *= (more_E * self.normal_left(time_s))[:, None, None]
        change[:, :, [1, 3]] *= more_G
        return change

    def _step_changes(self, unknowns: Unknowns, R: Array, omega: Array) -> tuple[Array, Array]:
        """D log / d unknowns of the measured responses (s, o, u), and of the motion at nonlinear ports (s, n, u)."""
        p, steps, into = self.model.ports, self.evidence.steps, self.driven(R, omega)
        all_ports = np.arange(R.shape[1])
        ports = np.concatenate([all_ports[p.outputs], all_ports[self.nonlinear_ports]])
        time = steps.time_s - self.evidence.origin_s
        base = self._base_change(R, omega, unknowns, time, ports, into)
        left = self.normal_left(time)
        SE = -np.sum(R[:, ports, p.normal] * into[:, None, p.normal], axis=2) * left[:, None]
        SG = -np.sum(R[:, ports, p.shear] * into[:, None, p.shear], axis=2)
        B = unknowns.law.basis(self.amplitude_m)
        BS = unknowns.law.basis(self.amplitude_m / left)
        a, b, q = unknowns.softening_in_shear, unknowns.loss_in_normal, self.shear_share
        s, loss = (BS @ unknowns.law.softening)[:, None], (B @ unknowns.law.loss)[:, None]
        softening = -(1 - a) * SE - a / q * SG
        losing = 1j * (b * q * SE + (1 - b) * SG)
        columns = [
            base,
            softening[:, :, None] * BS[:, None, :],
            losing[:, :, None] * B[:, None, :],
            (s * (SE - SG / q))[:, :, None],
            (1j * loss * (q * SE - SG))[:, :, None],
        ]
        change = np.concatenate(columns, axis=2)
        outputs = len(self.evidence.channels)
        response = self.log_response_change(change[:, :outputs], R, omega)
        if not self.extension.nonlinear:
            return response, change[:, outputs:]
        motion, influence = self.port_motion(R, omega)
        moved = change[:, outputs:] / into[:, self.nonlinear_ports, None]
        moved = moved - response[:, self.evidence.reference, None]
        moved, response = self.local.follow(np.abs(motion), omega, influence, moved, response)
        return response, moved

    def _forced(self, unknowns: Unknowns, R: Array) -> tuple[Array, int, JointState]:
        """Motion at the nonlinear ports, how many harmonics are wanted, and what surrounds the joint."""
        assert self.harmonics is not None
        steps = self.evidence.steps
        time = steps.time_s - self.evidence.origin_s
        omega = self.clock(steps.omega, time)
        motion, _ = self.port_motion(R, omega)
        stiffness = unknowns.base.E + self.moduli_changes(unknowns, self.amplitude_m, time)[0].real
        joint = JointState(stiffness / self.moduli[0], self.harmonics.compliance, omega)
        return motion, int(self.harmonics.orders[-1]), joint

    def _left_change(self, unknowns: Unknowns) -> Array:
        """D left / d unknowns (s, u), of the share of E' that the law leaves."""
        steps, law = self.evidence.steps, unknowns.law
        time = steps.time_s - self.evidence.origin_s
        left = self.normal_left(time)
        change = np.zeros((len(steps), len(unknowns.vector)))
        change[:, 0] = unknowns.base.E * self.extension.moduli_factor[0] * left
        n, k = len(unknowns.base.vector), len(law.knots)
        change[:, n : n + k] = -(1 - unknowns.softening_in_shear) * left[:, None] * law.basis(self.amplitude_m / left)
        change[:, -2] = left * law.softening_at(self.amplitude_m / left)
        return change / self.moduli[0]
