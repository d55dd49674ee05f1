"""The linear rig with what an extension changes: receptances between its ports, and what the channels show of them."""

import numpy as np

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import LinearModel, LinearParameters
from twin.identify.linear.structural_modification import attach
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.identify.spectra.broadband import BinnedResponse
from twin.structure import points_of_joints


class LinearForwardModel:
    """The nominal rig of `evidence` with an extension beside what is known of it, without the joint's law.

    Attributes
    ----------
    model : LinearModel
        With the extension's structure, positions and ports.
    points : LayerPoints
        Of all joints.
    step_model : LinearModel
        The same with the points as ports behind all others.
    moduli : pair of ndarray, (j,)
        E', G' of the joints that the model's modes were computed with, N/m2.
    moduli_factors : pair of ndarray, (j,)
        The extension's, on E' and on G'.
    """

    def __init__(self, evidence: MeasuredData, modification: ModelModification | None = None) -> None:
        self.evidence = evidence
        self.modification = evidence.known.merged(modification) if modification else evidence.known
        model, extra = _changed_model(evidence, self.modification)
        joints = [joint.name for joint in model.structure.joints]
        towards = [self.modification.towards_middle.get(name, 0.0) for name in joints]
        self.points = points_of_joints(model.structure, [joint.layer_elements for joint in evidence.joints], towards)
        self.model, self.step_model = evidence.changed_models.ported(model, extra, self.points.rows)
        self.moduli = (self.model.reference_E, self.model.reference_G)
        factors = np.array([self.modification.moduli_factor.get(name, LIMITS.unchanged_moduli) for name in joints])
        self.moduli_factors = tuple(factors.reshape(-1, 2).T)
        self._drift_per_s = np.array([self.modification.layer_drift_per_s.get(name, 0.0) for name in joints])

    @property
    def step_times(self) -> Array:
        """Of each step since the first one, s."""
        steps = self.evidence.steps
        return np.asarray(steps.time_s - self.evidence.origin_s) if len(steps) else np.zeros(0)

    def run_times(self, data: BinnedResponse, omega: Array) -> Array:
        """Of a broadband run since the first step, s; one for each frequency (f,)."""
        return np.full(len(omega), data.time_s - self.evidence.origin_s)

    def moduli_changes(self, base: LinearParameters, time_s: Array) -> tuple[Array, Array]:
        """Complex changes (t, j) of the layers' E' and G' by the extension, at times since the run's first step."""
        more_E, more_G = self.moduli_factors
        dE = base.complex_E * (more_E * self.normal_left(time_s) - 1)
        return dE, np.broadcast_to(base.complex_G * (more_G - 1), dE.shape)

    def normal_left(self, time_s: Array) -> Array:
        """Share (t, j) that a drift has left of each joint's E', and of what its law takes off it at an opening."""
        return np.maximum(1 - self._drift_per_s * np.asarray(time_s)[:, None], LIMITS.least_left)

    def clock(self, omega: Array, time_s: Array) -> Array:
        """Frequency at which the undrifted model responds as the rig does at commanded `omega` and at `time_s`.

        Moduli that all fall to a part e of themselves make the rig do under a force F at omega what the undrifted one
        does under F / e at omega / sqrt(e): accelerations to a newton are the same, motions larger.
        """
        return omega * self.modification.frequency_factor / np.sqrt(self.moduli_left(time_s))

    def moduli_left(self, time_s: Array) -> Array:
        """Share of all moduli that a drift has left."""
        return 1 - np.clip(self.modification.beam_drift_per_s * time_s, -0.5, 0.5)

    def channel_factors(self, omega: Array) -> tuple[Array, Array]:
        """Measured over true: of the outputs (f, o), and of the force (f,)."""
        factor = self.modification.channel_factor
        ones = np.ones(len(omega), complex)
        out = [ones * factor[c](omega) if c in factor else ones for c in self.evidence.channels]
        force = self.evidence.force
        return np.stack(out, axis=1), ones * factor[force](omega) if force in factor else ones

    def responses(self, R: Array, omega: Array) -> Array:
        """Measured response per measured force (f, o) from receptances, with what the channels do to it."""
        return self.measured(self.driven(R, omega)[:, self.model.ports.outputs], omega)

    def measured(self, displacement: Array, omega: Array) -> Array:
        """What the channels show (f, o) of displacements of the outputs per drive force, in a frame on the base."""
        rides = np.array([output.place.reads == "displacement" for output in self.model.outputs])
        H = (displacement + self.modification.base_receptance * rides) * self.model.to_quantity(omega)
        outputs, force = self.channel_factors(omega)
        H = outputs * H / force[:, None]
        for channel, source, part in self.modification.cross_talk:
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
        for channel, source, part in self.modification.cross_talk:
            if channel in names and source in names:
                change[:, names.index(channel)] += part * change[:, names.index(source)]
        return change

    def log_response_change(self, change: Array, R: Array, omega: Array) -> Array:
        """Changes (f, o, u) of the outputs' displacements as changes of the logarithms of what is measured."""
        change = self.measured_change(change, omega)
        return change / self.responses(R, omega)[:, :, None]

    def receptance(
        self,
        omega: Array,
        base: LinearParameters,
        time_s: Array,
        *,
        inner: bool = True,
        points: bool = False,
        drive: Array | int = 0,
    ) -> Array:
        """Receptances between all ports without the joint's law, attachments included.

        Parameters
        ----------
        drive
            Number of the drive that acts, which stands at the first one's port then.
        inner
            Whether the ports that only sensitivities need are wanted.
        points
            Whether those of the layer's points are.
        """
        dE, dG = self.moduli_changes(base, time_s)
        model = self.step_model if points else self.model
        R = model.receptance(omega, base, dE=dE, dG=dG, inner=inner)
        first, acts = self.model.ports.drive, np.broadcast_to(drive, len(R))
        at = self.model.ports.extra.start
        for attachment in self.modification.attachments:
            Z = attachment.stiffness(omega)
            if attachment.drive is not None:
                Z[acts != attachment.drive] = 0.0
            width = Z.shape[1]
            R = attach(R, slice(at, at + width), Z)
            at += width
        for number in np.unique(acts[acts > 0]):
            order = np.arange(R.shape[1])
            order[[first, first + number]] = order[[first + number, first]]
            R[acts == number] = R[acts == number][:, order[:, None], order]
        return R

    def driven(self, R: Array, omega: Array) -> Array:
        """Displacements (f, p) of all ports by a unit drive force, with the inertia load of a clamp that moves."""
        into, p = R[:, :, self.model.ports.drive], self.model.ports
        if self.modification.base_receptance == 0.0:
            return into
        return into + self.modification.base_receptance * omega[:, None] ** 2 * R[:, :, p.extra.stop - 1]

    def base_change(
        self, model: LinearModel, R: Array, omega: Array, baseline: BaselineParameters, time_s: Array, ports: Array,
        into: Array,
    ) -> Array:  # fmt: skip
        """D displacement / d base parameters (f, q, b): the extension's factors on the moduli are factors on theirs."""
        change = model.displacement_sensitivity(R, omega, baseline.base, ports, into)
        more_E, more_G = self.moduli_factors
        left = self.normal_left(time_s)
        blocks = baseline.base.blocks(baseline.base.joints)
        for names, factor in ((("log_E", "loss_E"), more_E * left), (("log_G", "loss_G"), more_G * np.ones_like(left))):
            for name in names:
                change[:, :, blocks[name]] *= factor[:, None, :]
        return change


def _changed_model(evidence: MeasuredData, modification: ModelModification) -> tuple[LinearModel, Array]:
    """The linear model with the extension's structure and positions; and its ports (p, n)."""
    model = evidence.model
    if modification.changes_structure or modification.output_offset_m or modification.drive_offset_m:
        model = evidence.changed_models.model(modification, evidence.outputs)
    rows = [attachment.rows(model.structure) for attachment in modification.attachments]
    rows += [force.row(model.structure)[None] for force in modification.nonlinear]
    if modification.base_receptance:
        s = model.structure
        rows.append((s.M @ s.rigid_translation(evidence.rig.drive_place.direction))[None])
    return model, np.vstack([np.zeros((0, model.structure.size)), *rows])
