"""The rig with what an extension changes: what its channels answer to the drive, at each step and in broadband runs.

Every step has the joint's law at its own amplitude, and local nonlinear forces the stiffness that their own motion
gives them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.broadband import BinnedResponse
from twin.identify.evidence import Evidence
from twin.identify.extended_model import extended_model
from twin.identify.extension import Extension, NoiseMotion
from twin.identify.linear_model import BaseParameters
from twin.identify.local_forces import Influence, LocalForces
from twin.identify.receptance import attach
from twin.identify.response_amplitude import response_amplitude
from twin.identify.unknowns import Unknowns

__all__ = ["ExtendedRig"]

Array = NDArray[Any]


class ExtendedRig:
    """The believed rig of `evidence` with an extension beside what is known of it.

    Attributes
    ----------
    model : LinearModel
        With the extension's structure, positions and ports.
    amplitude_m : ndarray, (s,)
        X of each step, that the joint's law goes by.
    shear_share : float
        Of mode 1's layer energy: its shear part per unit of modulus over its normal part.
    moduli : tuple of float
        E', G' that the model's modes were computed with, N/m2.
    """

    def __init__(self, evidence: Evidence, extension: Extension | None = None) -> None:
        self.evidence = evidence
        self.extension = evidence.known.merged(extension) if extension else evidence.known
        self.model = extended_model(evidence, self.extension)
        self.amplitude_m = response_amplitude(evidence, self.extension)
        self.local = LocalForces(self.extension.nonlinear)
        phi, s = self.model.basis.Phi[:, 0], self.model.structure
        self.shear_share = float(np.sum((s.B_G @ phi) ** 2) / np.sum((s.B_E @ phi) ** 2))
        self.moduli = (self.model.reference_E, self.model.reference_G)

    def moduli_changes(self, unknowns: Unknowns, X: Array, time_s: Array) -> tuple[Array, Array]:
        """Complex changes of E' and G' at amplitudes X and times since the run's first step.

        What a drift has left of E' opens the further under the same load: X is the load, and softening goes by opening.
        """
        left = self.normal_left(time_s)
        s, loss = unknowns.law.softening_at(X / left), unknowns.law.loss_at(X)
        a, b = unknowns.softening_in_shear, unknowns.loss_in_normal
        base, (more_E, more_G) = unknowns.base, self.extension.moduli_factor
        linear_E = base.E * (1 + 1j * base.loss_E) * (more_E * left - 1)
        linear_G = base.G * (1 + 1j * base.loss_G) * (more_G - 1)
        dE = linear_E - left * ((1 - a) * s - 1j * b * self.shear_share * loss)
        dG = linear_G - a * s / self.shear_share + 1j * (1 - b) * loss
        return dE, dG

    def normal_left(self, time_s: Array) -> Array:
        """Share that a drift has left of E', and of what its law takes off it at an opening."""
        return np.asarray(1 - self.extension.layer_drift_per_s * time_s)

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

    def measured_change(self, change: Array, omega: Array) -> Array:
        """Changes (f, o, u) of the outputs' displacements as the channels show them."""
        outputs, force = self.channel_factors(omega)
        change = (self.model.to_quantity(omega) * outputs / force[:, None])[:, :, None] * change
        names = self.evidence.channels
        for channel, source, part in self.extension.cross_talk:
            if channel in names and source in names:
                change[:, names.index(channel)] += part * change[:, names.index(source)]
        return change

    def log_response_change(self, change: Array, R: Array, omega: Array) -> Array:
        """Changes (f, o, u) of the outputs' displacements as changes of the logarithms of what is measured."""
        change = self.measured_change(change, omega)
        return change / self.responses(R, omega)[:, :, None]

    def receptance(self, omega: Array, base: BaseParameters, dE: Array, dG: Array, *, inner: bool = True) -> Array:
        """Receptances between all ports, attachments included; without `inner` ones not those that only they need."""
        R = self.model.receptance(omega, base, dE=dE, dG=dG, inner=inner)
        at = self.model.ports.extra.start
        for attachment in self.extension.attachments:
            Z = attachment.stiffness(omega)
            width = Z.shape[1]
            R = attach(R, slice(at, at + width), Z)
            at += width
        return R

    def broadband_response(self, data: BinnedResponse, unknowns: Unknowns) -> Array:
        """Predicted response per force (f, o) of a broadband run."""
        return self.responses(*self.felt_receptance(data, unknowns))

    def felt_receptance(self, data: BinnedResponse, unknowns: Unknowns, *, inner: bool = False) -> tuple[Array, Array]:
        """Receptances of a broadband run with what local nonlinear forces do in its noise; and the rig's own omega."""
        R, omega = self.broadband_receptance(data, unknowns, data.omega, inner=inner)
        if self.local.act_in_noise:
            R = self.in_noise(R, omega, self.noise_motion(R, omega, data))
        return R, omega

    def broadband_receptance(
        self, data: BinnedResponse, unknowns: Unknowns, omega: Array, *, inner: bool = False
    ) -> tuple[Array, Array]:
        """Receptances at the run's time, without local nonlinear forces; and the rig's own omega."""
        time = np.full(len(omega), data.time_s - self.evidence.origin_s)
        omega = self.clock(omega, time)
        dE, dG = self.moduli_changes(unknowns, np.zeros(len(omega)), time)
        return self.receptance(omega, unknowns.base, dE, dG, inner=inner), omega

    def noise_motion(self, R: Array, omega: Array, data: BinnedResponse) -> tuple[NoiseMotion, ...]:
        """How the port of each local nonlinear force moves in a broadband run.

        As with steps, the motion is that of the measured channels, carried to the ports by the model's shapes.
        """
        H = self.responses(R, omega)
        measured = np.sum(np.conj(H) * data.H, axis=1) / np.sum(np.abs(H) ** 2, axis=1)
        motion = self.driven(R, omega)[:, self.nonlinear_ports] * measured[:, None]
        power = np.abs(motion) ** 2 * data.force_power[:, None]
        return tuple(NoiseMotion(omega, column) for column in power.T)

    def in_noise(self, R: Array, omega: Array, motion: tuple[NoiseMotion, ...]) -> Array:
        """Receptances with the linear substitutes of the local nonlinear forces at this :meth:`noise_motion`."""
        return attach(R, self.nonlinear_ports, self.local.substitutes(motion, omega))

    def step_receptance(self, unknowns: Unknowns, *, inner: bool = True) -> tuple[Array, Array]:
        """Receptances at the steps' drive frequencies, each with the law at its own amplitude; and omega."""
        steps = self.evidence.steps
        time = steps.time_s - self.evidence.origin_s
        omega = self.clock(steps.omega, time)
        dE, dG = self.moduli_changes(unknowns, self.amplitude_m, time)
        return self.with_nonlinear(self.receptance(omega, unknowns.base, dE, dG, inner=inner), omega), omega

    def with_nonlinear(self, R: Array, omega: Array) -> Array:
        """Receptances with the equivalent stiffness of local nonlinearities at each step's own amplitude."""
        if not self.extension.nonlinear:
            return R
        return self.local.balance(
            omega,
            R,
            attach=lambda stiffness: attach(R, self.nonlinear_ports, stiffness),
            motion=lambda R: self.port_motion(R, omega),
        )

    @property
    def nonlinear_ports(self) -> slice:
        """Where the nonlinear forces' ports are."""
        stop = self.model.ports.extra.stop - (1 if self.extension.base_receptance else 0)
        return slice(stop - len(self.extension.nonlinear), stop)

    def driven(self, R: Array, omega: Array) -> Array:
        """Displacements (f, p) of all ports by a unit drive force, with the inertia load of a clamp that moves."""
        into, p = R[:, :, self.model.ports.drive], self.model.ports
        if self.extension.base_receptance == 0.0:
            return into
        return into + self.extension.base_receptance * omega[:, None] ** 2 * R[:, :, p.extra.stop - 1]

    def port_motion(self, R: Array, omega: Array) -> tuple[Array, Influence]:
        """Complex amplitudes (s, n) at the nonlinear forces' ports, m, and how stiffness there changes things.

        The amplitudes follow from the measured motion of the reference channel, as the law's does, not from the force:
        near a sharp resonance the response to that is far more uncertain than the shape of the motion.
        """
        steps, reference, n = self.evidence.steps, self.evidence.reference, self.nonlinear_ports
        into = self.driven(R, omega)
        per_reference = into[:, n] / self.responses(R, omega)[:, reference, None]
        motion = per_reference * steps.response[:, reference, 0, None]
        by_response = self.log_response_change(-R[:, self.model.ports.outputs, n] * into[:, None, n], R, omega)
        by_motion = -R[:, n, n] * into[:, None, n] / into[:, n, None] - by_response[:, None, reference]
        return motion, Influence(by_motion, by_response)

    def _base_motion(self, R: Array, omega: Array) -> Array | float:
        """Response to a clamp that moves with the drive force: rigid motion plus the inertia load it causes."""
        if self.extension.base_receptance == 0.0:
            return 0.0
        p = self.model.ports
        inertia = R[:, p.outputs, p.extra.stop - 1] * omega[:, None] ** 2
        return self.extension.base_receptance * (1 + inertia) * self.model.to_quantity(omega)
