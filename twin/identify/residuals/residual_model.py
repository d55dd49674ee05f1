"""Residuals of all evidence against an extended model, whitened, with their sensitivities to what is always unknown.

Parameters of the base family: the base parameters (moduli, losses, modal damping, frequency discrepancy) and the
values of the joint's law at its knots.  All sensitivities are products of receptances (2011 paper, equation 15), taken
on the logarithm of the response as there (equation 16), but of its complex value, so that phase counts too.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward.broadband_response import felt_receptance, log_response_by_shown
from twin.identify.forward.forward_model import ForwardModel
from twin.identify.frequency_shifts import SHIFT, own_shifts, shifted_sweeps, swept_modes
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_fit import base_prior
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.identify.nonlinear.balance import Balance
from twin.identify.nonlinear.joint_law import curve_precision
from twin.identify.nonlinear.local_forces import Influence
from twin.identify.nonlinear.opening_harmonics import balance_openings
from twin.identify.nonlinear.running_amplitude import squares_of
from twin.identify.residuals.error_model import SOUND, ErrorModel, ErrorSources, StepErrors, error_sources
from twin.identify.residuals.harmonics_by_unknowns import harmonics_by_unknowns
from twin.identify.residuals.linearisation import Linearisation, with_more
from twin.identify.residuals.prediction import Columns, Prediction
from twin.identify.residuals.whitening import HarmonicResiduals, Whitening, real_ones
from twin.identify.spectra.broadband import BinnedResponse


class ResidualModel(ForwardModel):
    """Evaluates residuals of `evidence` for an extension of the nominal rig."""

    def __init__(
        self,
        evidence: MeasuredData,
        modification: ModelModification | None = None,
        harmonics: HarmonicResiduals | None = None,
        *,
        errors: ErrorModel = SOUND,
        held: Linearisation | None = None,
    ) -> None:
        super().__init__(evidence, modification)
        self.harmonics = harmonics
        self.laws = len(self.model.structure.joints)
        self.errors = errors
        self._hold(held)

    def _hold(self, held: Linearisation | None) -> None:
        self._held = held
        if held is not None and held.balance is not None:
            self.local = self.local_at(held.balance)

    def holding(self, held: Linearisation) -> ResidualModel:
        """The same with other weights, balance and harmonics."""
        other = copy(self)
        other._hold(held)
        return other

    def prior(self, baseline: BaselineParameters) -> tuple[Array, Array]:
        """Mean and precision (u, u) of the unknowns: wide, but the law smooth over neighbouring knots."""
        nominal, linear = nominal_parameters(self.evidence.rig, self.evidence.preload), self.evidence.linear
        if linear is not None and self.errors.moduli < SOUND.moduli:
            # While a fit finds its way the moduli are held, but where the broadband run can be followed at all.
            nominal = replace(nominal, E=linear.nominal.E, G=linear.nominal.G)
        mean, base = base_prior(
            nominal, frequency_discrepancy_std=self.errors.frequency, moduli_std=self.errors.moduli,
            scatter=self.evidence.frequency_scatter,
        )  # fmt: skip
        precision = self.inferred_precision(baseline, self.errors)
        precision[: len(mean), : len(mean)] = base
        if count := len(baseline.shown):
            shown = baseline.blocks["shown"]
            precision[shown, shown] = np.eye(count) / self.evidence.shape_error**2
        return np.concatenate([mean, np.zeros(len(precision) - len(mean))]), precision

    def inferred_precision(self, baseline: BaselineParameters, errors: ErrorModel) -> Array:
        """Precision (u, u) of the joints' laws and of the shifts alone, whose priors are inferred."""
        precision = np.zeros((len(baseline.blocks),) * 2)
        for joint, law in enumerate(baseline.laws):
            E, G = (moduli[joint] for moduli in self.moduli)
            curves = (
                (baseline.softening(joint), law.opening_knots, E),
                (baseline.loss(joint), law.slip_knots, LIMITS.loss_scale * G),
            )
            for (block, knots, scale), own, usual in zip(curves, errors.roughness, SOUND.roughness, strict=True):
                precision[block, block] = curve_precision(knots, usual) * (usual / own / scale) ** 2
        about, shifts = swept_modes(self.evidence, len(baseline.shifts)), baseline.blocks["shifts"]
        precision[shifts, shifts] = errors.shift_precision(about)
        return precision

    def evaluate(self, baseline: BaselineParameters, *, sensitivities: bool = True) -> Prediction:
        """Residual of all evidence, with its sensitivities unless they are not wanted (the jacobian is zero then)."""
        held = self._held or self.linearisation(baseline, sensitivities=sensitivities)
        out = [
            (f"broadband {i}", self._broadband(i, baseline, whitening, sensitivities))
            for i, whitening in enumerate(held.broadband)
        ]
        if len(self.evidence.steps):
            near = self.balance_at(held, baseline)
            R, omega, balance = self.step_receptance(baseline, inner=sensitivities, held=near)
            change = self._step_changes(baseline, R, omega, balance, held) if sensitivities else None
            out.append(("steps", self._steps(R, omega, held.steps, change)))
            if self.harmonics is not None:
                whitening = held.harmonics or self.harmonics.whitening(self.errors.harmonics)
                out.append(("harmonics", self._harmonics(baseline, R, balance, whitening, change)))
        return Prediction.of(out, len(baseline.blocks))

    def balance_at(self, held: Linearisation, baseline: BaselineParameters) -> Balance:
        """The balance where the unknowns are others, and where contact is lost in another way."""
        balance = held.balance_with(baseline)
        lost = held.lost
        if lost is None or not self.modification.opening:
            return balance
        now = balance_openings(held.baseline.laws, lost.openings, self.slaps, start=lost.balance.motion)
        return with_more(balance, now.more - lost.balance.more)

    def added_beyond(
        self, held: Linearisation, baseline: BaselineParameters, *, start: Array | None = None
    ) -> tuple[Array, Array]:
        """Stiffness (s, 2 p) that harmonics add at the points beyond what a residual with `held` has them add.

        Also the openings' harmonics (s, h, p), which may `start` from those of a model nearby.
        """
        found = self.step_receptance(baseline, inner=False, held=self.balance_at(held, baseline))[2]
        openings = self.openings(baseline, found)
        start = start if start is not None and start.shape == openings.driven.shape else None
        harmonics = balance_openings(baseline.laws, openings, self.slaps, start=start)
        squares = squares_of(openings.slips(harmonics), openings.orders)
        return self.added_by_harmonics(baseline, self.local, found, harmonics, squares), harmonics.motion

    def _broadband(
        self, index: int, baseline: BaselineParameters, whitening: Whitening, sensitivities: bool
    ) -> tuple[Array, Columns]:
        data = self.evidence.broadband[index]
        R, omega = felt_receptance(self, data, baseline, inner=sensitivities or len(baseline.shown) > 0)
        # log of the ratio: the paper's dB residual and the phase at once, and no false minima of hidden resonances.
        log_ratio = np.log(data.H / self.responses(R, omega))
        columns: Columns = []
        if len(baseline.shown):
            by_shown = log_response_by_shown(self, R, omega)
            log_ratio = log_ratio - by_shown @ baseline.shown
            columns.append((baseline.blocks["shown"], real_ones(whitening.columns(by_shown))))
        if sensitivities:
            change = self._broadband_change(data, baseline, R, omega)
            columns.append((slice(change.shape[2]), real_ones(whitening.columns(change))))
            if own_shifts(self.evidence, baseline.shifts):
                by_shift = SHIFT * change[:, :, baseline.blocks["frequency_discrepancy"]].sum(axis=2)
                columns.append((baseline.blocks["shifts"].start + index, real_ones(whitening(by_shift))))
        return real_ones(whitening(log_ratio)), columns

    def _broadband_change(self, data: BinnedResponse, baseline: BaselineParameters, R: Array, omega: Array) -> Array:
        """D log response / d base parameters (b, o, u)."""
        p, into, time = self.model.ports, self.driven(R, omega), self.run_times(data, omega)
        baseline = replace(baseline, base=self.base_in(data, baseline))
        change = self.base_change(self.model, R, omega, baseline, time, np.arange(R.shape[1])[p.outputs], into)
        return self.log_response_change(change, R, omega)

    def measured_over_predicted(self, R: Array, omega: Array) -> Array:
        """Responses (s, o) of the steps, over those that these receptances make of the measured force."""
        steps = self.evidence.steps
        return np.asarray(steps.response[:, :, 0] / (self.responses(R, omega) * steps.force[:, :1]))

    def _steps(
        self, R: Array, omega: Array, whitening: Whitening, change: tuple[Array, Array] | None
    ) -> tuple[Array, Columns]:
        """Residuals of the inverse response, which is nearly linear in every stiffness, times the measured one."""
        ratio = self.measured_over_predicted(R, omega)
        white = whitening(np.concatenate([ratio.real - 1, ratio.imag], axis=1))
        if change is None:
            return white, []
        J = ratio[:, :, None] * change[0]
        return white, [(slice(None), whitening.columns(np.concatenate([J.real, J.imag], axis=1)))]

    def _error_sources(self, baseline: BaselineParameters, state: tuple[Array, Array, Balance] | None) -> ErrorSources:
        def by_stiffness(change: Array) -> Array:
            return np.asarray(change[:, :, baseline.blocks["frequency_discrepancy"]] / 2)

        runs = []
        for data in self.evidence.broadband:
            R, omega = felt_receptance(self, data, baseline, inner=True)
            runs.append(by_stiffness(self._broadband_change(data, baseline, R, omega)))
        steps, outputs = self.evidence.steps, self.evidence.steps.response.shape[1]
        stiffness, unsettled = np.zeros((0, outputs, 1)), np.zeros(0)
        amplitude = ratio = np.zeros((0, outputs))
        if state is not None:
            R, omega, balance = state
            stiffness = by_stiffness(self._step_changes(baseline, R, omega, balance)[0])
            amplitude = self._by_amplitude(baseline, R, omega, balance)
            ratio, unsettled = self.measured_over_predicted(R, omega), balance.missed
        of_steps = StepErrors(steps, stiffness, amplitude, self.evidence.reference, ratio, unsettled)
        return error_sources(self.evidence.broadband, runs, of_steps, self.harmonics)

    def _by_amplitude(self, baseline: BaselineParameters, R: Array, omega: Array, balance: Balance) -> Array:
        """D log response (s, o) / d log amplitude of the reference channel: through the law and the local forces."""
        motion, influence = self.port_motion(R, omega)
        ones = np.ones((*motion.shape, 1), complex)
        still = np.zeros((len(motion), len(self.evidence.channels), 1), complex)
        followed = self.local.follow(baseline.laws, np.abs(motion), omega, influence, ones, still, balance.added)
        return followed[1][:, :, 0]

    def linearisation(self, baseline: BaselineParameters, *, sensitivities: bool = True) -> Linearisation:
        """What a fit that begins at these unknowns may hold; without sensitivities, what residuals at these need."""
        state = self.step_receptance(baseline) if len(self.evidence.steps) else None
        made_of, errors = self._error_sources(baseline, state), self.errors
        white = made_of.of_broadband(errors.broadband), made_of.of_steps(errors.steps)
        if state is None:
            return Linearisation(*white, None, None, baseline, None, made_of)
        found, harmonics = state[2], made_of.of_harmonics(errors.harmonics)
        by_unknowns, lost = harmonics_by_unknowns(self, baseline, found) if sensitivities else (None, None)
        return Linearisation(*white, found, lost, baseline, by_unknowns, made_of, harmonics=harmonics)

    def port_motion(self, R: Array, omega: Array) -> tuple[Array, Influence]:
        """Complex amplitudes (s, n) at the moving ports, m, and how stiffness there changes things.

        The amplitudes follow from the measured motion of the reference channel, not from the force: near a sharp
        resonance the response to that is far more uncertain than the shape of the motion.
        """
        reference, n = self.evidence.reference, self.moving
        into = self.driven(R, omega)
        per_reference = into[:, n] / self.responses(R, omega)[:, reference, None]
        motion = per_reference * self.undrifted_reading[:, None]
        to_outputs = -R[:, self.model.ports.outputs][:, :, n] * into[:, None, n]
        by_response = self.log_response_change(to_outputs, R, omega)
        by_motion = -R[:, n[:, None], n] * into[:, None, n] / into[:, n, None] - by_response[:, None, reference]
        return motion, Influence(by_motion, by_response)

    def extra_harmonics(self, baseline: BaselineParameters, R: Array, balance: Balance) -> Array:
        """Harmonics (s, h, o) that the extension's own forces add, at what :meth:`step_receptance` returned."""
        assert self.harmonics is not None
        added = np.zeros_like(self.harmonics.residual)
        if self.modification.nonlinear:
            added = added + self._by_local_forces(self.local.harmonics(*self._forced(baseline, R))[..., None])[..., 0]
        return added + self._by_lost_contact(baseline, balance) if self.modification.opening else added

    def _by_lost_contact(self, baseline: BaselineParameters, balance: Balance) -> Array:
        """Even harmonics (s, h, o) of a layer that opens; the odd ones are any law's."""
        assert self.harmonics is not None
        p, orders = len(self.points), self.harmonics.orders
        lost = self._held.lost if self._held is not None else None
        if lost is None:
            around = [self.at_harmonic(h, baseline, balance) for h in self.orders]
            openings, read, start = self.openings(baseline, balance, around), self.read_of_openings(around), None
        else:
            openings, read, start = lost.openings, lost.read, lost.balance.motion
        openings = replace(openings, fundamental=balance.motion[:, :p])
        force = balance_openings(baseline.laws, openings, self.slaps, start=start).force
        own = [openings.orders.index(h) for h in orders]
        even = np.where(orders % 2 == 0, 1.0, 0.0)[:, None] * force[:, own]
        return -np.asarray(np.einsum("shop,shp->sho", read[:, own], even))

    def _harmonics(
        self, baseline: BaselineParameters, R: Array, balance: Balance, whitening: Whitening,
        change: tuple[Array, Array] | None,
    ) -> tuple[Array, Columns]:  # fmt: skip
        """Whitened harmonics less what the extension's own forces make.

        The base family decides little of what lost contact does, and its sensitivities to that are left out.
        """
        assert self.harmonics is not None
        residual, forces = self.harmonics.residual, None
        if self.modification.opening:
            residual = residual - self._by_lost_contact(baseline, balance)
        if self.modification.nonlinear:
            forced = self._forced(baseline, R)
            forces = self.local.harmonics(*forced)
            residual = residual - self._by_local_forces(forces[..., None])[..., 0]
        r = self.harmonics.whiten(residual, whitening)
        if change is None or forces is None:
            return r, []
        changes = self.local.harmonic_changes(forces, *forced, change[1][:, 2 * len(self.points) :])
        return r, [(slice(None), self.harmonics.whiten(self._by_local_forces(changes), whitening))]

    def _by_local_forces(self, forces: Array) -> Array:
        """Harmonics (s, h, o, u) of the outputs by harmonics (s, n, h, u) of the nonlinear forces."""
        assert self.harmonics is not None
        rows = np.array([force.row(self.harmonics.structure) for force in self.modification.nonlinear])
        at = self.harmonics.field @ rows.T
        return -np.asarray(np.einsum("shop,sphu->shou", at, forces[:, :, self.harmonics.orders - 1]))

    def _step_changes(
        self, baseline: BaselineParameters, R: Array, omega: Array, balance: Balance, held: Linearisation | None = None
    ) -> tuple[Array, Array]:
        """D log / d unknowns of the measured responses (s, o, u), and of the motion at the moving ports (s, n, u)."""
        p, into, moving = self.model.ports, self.driven(R, omega), self.moving
        ports = np.concatenate([np.arange(R.shape[1])[p.outputs], moving])
        change = self.base_change(self.step_model, R, omega, baseline, self.step_times, ports, into)
        change = np.pad(change, [(0, 0), (0, 0), (0, len(baseline.blocks) - change.shape[2])])
        outputs = len(self.evidence.channels)
        response = self.log_response_change(change[:, :outputs], R, omega)
        moved = change[:, outputs:] / into[:, moving, None] - response[:, self.evidence.reference, None]
        motion, influence = self.port_motion(R, omega)
        amplitude, points = np.abs(motion), len(self.points)
        by_harmonics = held.derivative(baseline) if held is not None else None
        if by_harmonics is not None:
            # A law's harmonics are felt at every joint's points.
            response += influence.response[:, :, : 2 * points] @ by_harmonics
            moved += influence.motion[:, :, : 2 * points] @ by_harmonics
        for joint, (softer, lossier) in enumerate(self.local.by_law(baseline.laws, amplitude, balance.added.squares)):
            own = self.local.of_joint(joint)
            for which, columns, k in (
                (own, baseline.softening(joint), softer),
                (points + own, baseline.loss(joint), lossier),
            ):
                response[:, :, columns] += influence.response[:, :, which] @ k
                moved[:, :, columns] += influence.motion[:, :, which] @ k
        for number, rows in shifted_sweeps(self.evidence, baseline.shifts):
            for each, felt in ((response, influence.response), (moved, influence.motion)):
                # All natural frequencies are those at other ones of the drive, where no law's stiffness changes.
                by_frequencies = each[rows][:, :, baseline.blocks["frequency_discrepancy"]].sum(axis=2)
                by_law = (felt[rows] @ balance.stiffness[rows][:, :, None])[:, :, 0]
                each[rows, :, baseline.blocks["shifts"].start + number] = SHIFT * (by_frequencies + 2 * by_law)
        moved, response = self.local.follow(baseline.laws, amplitude, omega, influence, moved, response, balance.added)
        return response, moved

    def _forced(self, baseline: BaselineParameters, R: Array) -> tuple[Array, int, Array]:
        """Motion at the nonlinear forces' ports, how many harmonics are wanted, and omega."""
        assert self.harmonics is not None
        omega = self.step_omega(baseline)
        motion, _ = self.port_motion(R, omega)
        return motion[:, 2 * len(self.points) :], int(self.harmonics.orders[-1]), omega.real
