"""What small forces at further ports of a model change in its residuals, to first order: none is evaluated anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward.broadband_response import felt_receptance
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import Attachment, ModelModification, NoiseMotion, NonlinearForce
from twin.identify.nonlinear.balance import Balance
from twin.identify.nonlinear.local_forces import turned
from twin.identify.nonlinear.opening_harmonics import balance_openings, stiffness_sensitivity
from twin.identify.residuals.linearisation import Linearisation
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals, real_ones
from twin.identify.spectra.broadband import BinnedResponse
from twin.structure import Structure

AT_A_TIME = 16
"""Ports: receptances among all go by their square, and each group takes the model's own anew."""


@dataclass(frozen=True)
class PortForces:
    """What a small modification puts on some ports of a :class:`PortModel`."""

    attached: tuple[tuple[Attachment, NDArray[np.intp]], ...]
    """And which ports it is on."""
    nonlinear: tuple[tuple[NonlinearForce, int], ...]


def acts_at_ports(modification: ModelModification) -> bool:
    """Whether a modification is nothing but local forces and attachments, whichever drive acts."""
    attachments, nonlinear = modification.attachments, modification.nonlinear
    return modification == ModelModification(attachments=attachments, nonlinear=nonlinear) and all(
        attachment.drive is None for attachment in attachments
    )


def port_changes(
    with_ports: Callable[[Array], PortModel],
    structure: Structure,
    baseline: BaselineParameters,
    each: Sequence[ModelModification],
) -> Iterator[Array]:
    """Changes of the residual (r,) by small modifications that act at ports, in their order.

    Parameters
    ----------
    with_ports
        The model with ports (n, d) beside its own.
    structure
        That it has.
    """
    for ports, forces in _groups(structure, each):
        yield from with_ports(ports).changes(baseline, forces).T


def _groups(structure: Structure, each: Sequence[ModelModification]) -> Iterator[tuple[Array, list[PortForces]]]:
    """Ports (n, d), not many at a time, and what acts on them; neighbours often share theirs."""
    number: dict[bytes, int] = {}
    rows: list[Array] = []
    forces: list[PortForces] = []

    def at(row: Array) -> int:
        if row.tobytes() not in number:
            number[row.tobytes()] = len(rows)
            rows.append(row)
        return number[row.tobytes()]

    for one in each:
        attached = [(a, np.array([at(row) for row in a.rows(structure)])) for a in one.attachments]
        forces.append(PortForces(tuple(attached), tuple((f, at(f.row(structure))) for f in one.nonlinear)))
        if len(rows) >= AT_A_TIME:
            yield np.array(rows), forces
            number, rows, forces = {}, [], []
    if forces:
        yield np.array(rows).reshape(-1, structure.size), forces


class PortModel(ResidualModel):
    """A residual model with further ports, on which nothing acts.

    Parameters
    ----------
    ports : ndarray, (n, d)
        Rows on the structure's degrees of freedom.
    """

    def __init__(
        self,
        evidence: MeasuredData,
        modification: ModelModification,
        harmonics: HarmonicResiduals | None,
        *,
        ports: Array,
        held: Linearisation,
    ) -> None:
        free = Attachment(lambda structure: ports, lambda omega: np.zeros((len(omega), len(ports)), complex))
        super().__init__(evidence, modification.merged(ModelModification(attachments=(free,))), harmonics, held=held)
        self.held, self.rows = held, ports
        before = sum(len(a.rows(self.model.structure)) for a in self.modification.attachments[:-1])
        self.at = self.model.ports.extra.start + before + np.arange(len(ports))

    def changes(self, baseline: BaselineParameters, each: Sequence[PortForces]) -> Array:
        """D predicted (r, k), whitened as the residual is, by each of these forces."""
        held = self.held
        blocks = [
            real_ones(whitening.columns(self._of_broadband(data, baseline, each)))
            for data, whitening in zip(self.evidence.broadband, held.broadband, strict=True)
        ]
        if len(self.evidence.steps):
            blocks += self._of_steps(baseline, each)
        return np.concatenate(blocks)

    def _of_broadband(self, data: BinnedResponse, baseline: BaselineParameters, each: Sequence[PortForces]) -> Array:
        """Changes (b, o, k) of the log responses."""
        R, omega = felt_receptance(self, data, baseline)
        into, H = self.driven(R, omega)[:, self.at], self.responses(R, omega)
        measured = np.sum(np.conj(H) * data.H, axis=1) / np.sum(np.abs(H) ** 2, axis=1)
        power = np.abs(into * measured[:, None]) ** 2 * data.force_power[:, None]
        force = _attached(each, omega, into)
        for k, one in enumerate(each):
            for local, port in one.nonlinear:
                if local.random is not None:
                    force[:, port, k] += local.random(NoiseMotion(omega, power[:, port]), omega) * into[:, port]
        return self.log_response_change(-R[:, self.model.ports.outputs][:, :, self.at] @ force, R, omega)

    def _of_steps(self, baseline: BaselineParameters, each: Sequence[PortForces]) -> list[Array]:
        """Whitened changes (r, k) of the steps, and of their harmonics where these are data."""
        steps, reference, held = self.evidence.steps, self.evidence.reference, self.held
        R, omega, balance = self.step_receptance(baseline, inner=False, held=self.balance_at(held, baseline))
        motion, influence = self.port_motion(R, omega)
        scale = steps.response[:, reference, 0] / self.responses(R, omega)[:, reference]
        driven = self.driven(R, omega)
        at_ports = driven[:, self.at] * scale[:, None]
        orders = self.harmonics.orders if self.harmonics is not None else np.zeros(0, int)
        count = int(max([1, *self.orders, *orders]))
        force = _attached(each, omega, at_ports)
        own = np.zeros((count, *force.shape), complex)
        for k, one in enumerate(each):
            for local, port in one.nonlinear:
                x, here = at_ports[:, port], omega.real
                force[:, port, k] += local.equivalent(np.abs(x), here) * x
                own[:, :, port, k] += (local.harmonics(np.abs(x), count, here) * turned(x, count)).T
        per_force = force / scale[:, None, None]
        response = self.log_response_change(-R[:, self.model.ports.outputs][:, :, self.at] @ per_force, R, omega)
        moved = -R[:, self.moving][:, :, self.at] @ per_force / driven[:, self.moving, None]
        moved = moved - response[:, None, reference]
        points = len(self.points)
        if points:
            added = self._added(baseline, balance, each, own)
            response = response + influence.response[:, :, :points] @ added
            moved = moved + influence.motion[:, :, :points] @ added
        change = self.local.follow(
            baseline.laws, np.abs(motion), omega, influence, moved, response, balance.added
        )[::-1]  # fmt: skip
        found = [columns for _, columns in self._steps(baseline, R, omega, held.steps, change)[1]]
        if self.harmonics is not None:
            whitening = held.harmonics or self.harmonics.whitening(self.errors.harmonics)
            read = -np.einsum("shon,pn,hspk->shok", self.harmonics.field, self.rows, own[orders - 1], optimize=True)
            columns = self.harmonics.whiten(read, whitening)
            for _, of_others in self._harmonics(baseline, R, balance, whitening, change)[1]:
                columns = columns + of_others
            found.append(columns)
        return found

    def _added(self, baseline: BaselineParameters, balance: Balance, each: Sequence[PortForces], own: Array) -> Array:
        """Changes (s, p, k) of the stiffness that the openings' harmonics add, at fundamentals that are held."""
        points, drive = len(self.points), self.model.ports.drive
        opening = self.moving[:points]
        around = [self.at_harmonic(h, baseline, balance) for h in self.orders]
        openings = self.openings(baseline, balance, around)
        harmonics = balance_openings(baseline.laws, openings, self.slaps)
        moved = np.zeros((*harmonics.motion.shape, len(each)), complex)
        of_forces = self.forced_harmonics(baseline, balance, self.orders)
        for number, (h, (R, force, omega)) in enumerate(zip(self.orders, around, strict=True)):
            to_ports = R[:, self.at]
            motion = to_ports[:, :, drive] * force[:, None]
            motion -= np.einsum("spq,sq->sp", to_ports[:, :, opening], harmonics.force[:, number])
            motion -= np.einsum("spq,sq->sp", to_ports[:, :, self.nonlinear_ports], of_forces[number])
            forces = _attached(each, omega, motion) + (own[h - 1] if h else 0.0)
            moved[:, number] = -R[:, opening][:, :, self.at] @ forces
        return stiffness_sensitivity(baseline.laws, openings, harmonics.motion, moved, slaps=self.slaps)[1]


def _attached(each: Sequence[PortForces], omega: Array, motion: Array) -> Array:
    """Forces (f, n, k) of what is attached, by the motion (f, n) of the ports."""
    force = np.zeros((*motion.shape, len(each)), complex)
    for k, one in enumerate(each):
        for attachment, ports in one.attached:
            Z, x = attachment.stiffness(omega), motion[:, ports]
            force[:, ports, k] += Z * x if Z.ndim == 2 else np.einsum("fpq,fq->fp", Z, x)
    return force
