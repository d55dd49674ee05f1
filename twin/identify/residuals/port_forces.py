"""What small forces at further ports of a model change in its residuals, to first order: none is evaluated anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward.broadband_response import in_noise, noise_motion
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import Attachment, ModelModification, NonlinearForce
from twin.identify.nonlinear.balance import Balance
from twin.identify.nonlinear.local_forces import turned
from twin.identify.residuals.harmonics_by_unknowns import PointHarmonics
from twin.identify.residuals.linearisation import Linearisation
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals, real_ones
from twin.identify.spectra.broadband import BinnedResponse
from twin.structure import Structure

AT_A_TIME = 16
"""Ports: receptances among all go by their square, and each group takes the model's own anew."""

Change = Sequence[tuple[ModelModification, float]]
"""Small modifications, and how many times each."""


@dataclass(frozen=True)
class PortForces:
    """What a small modification puts on some ports of a :class:`PortModel`, and so many times."""

    attached: tuple[tuple[Attachment, NDArray[np.intp], float], ...]
    """With the ports it is on."""
    nonlinear: tuple[tuple[NonlinearForce, int, float], ...]


def acts_at_ports(modification: ModelModification) -> bool:
    """Whether a modification is nothing but attachments, whichever drive acts, and local forces that do not slide.

    Over its usual step a slider's force bends too much for its slope to stand for what it does.
    """
    attachments, nonlinear = modification.attachments, modification.nonlinear
    return (
        modification == ModelModification(attachments=attachments, nonlinear=nonlinear)
        and all(attachment.drive is None for attachment in attachments)
        and all(force.slider is None for force in nonlinear)
    )


def port_changes(
    with_ports: Callable[..., PortModel],
    structure: Structure,
    baseline: BaselineParameters,
    each: Sequence[Change],
    *,
    added: Array | None = None,
) -> Iterator[Array]:
    """Derivatives of the whitened prediction (r,) by changes that act at ports, in their order.

    Parameters
    ----------
    with_ports
        Makes the model with ports (n, d) beside its own.
    structure
        The model's.
    added
        As for :meth:`PortModel.changes`.
    """
    first = 0
    while first < len(each):
        ports = _Ports(structure)
        for change in each[first:]:
            ports.put(change)
            if len(ports.rows) >= AT_A_TIME:
                break
        last = first + len(ports.forces)
        part = None if added is None else added[:, :, first:last]
        yield from with_ports(ports=ports.stacked).changes(baseline, ports.forces, added=part).T
        first = last


class _Ports:
    """Ports of a structure, and what acts on them; neighbours often share theirs."""

    def __init__(self, structure: Structure) -> None:
        self.structure, self.rows = structure, list[Array]()
        self.forces: list[PortForces] = []
        self._number: dict[bytes, int] = {}

    @property
    def stacked(self) -> Array:
        """Their rows (n, d)."""
        return np.array(self.rows).reshape(-1, self.structure.size)

    def put(self, each: Change) -> None:
        """One more column."""
        attached = [
            (a, np.array([self._at(row) for row in a.rows(self.structure)]), times)
            for one, times in each
            for a in one.attachments
        ]
        nonlinear = [(f, self._at(f.row(self.structure)), times) for one, times in each for f in one.nonlinear]
        self.forces.append(PortForces(tuple(attached), tuple(nonlinear)))

    def _at(self, row: Array) -> int:
        if row.tobytes() not in self._number:
            self._number[row.tobytes()] = len(self.rows)
            self.rows.append(row)
        return self._number[row.tobytes()]


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
        free = Attachment(lambda structure: ports, lambda omega: np.zeros((len(omega), 0)))
        super().__init__(evidence, modification.merged(ModelModification(attachments=(free,))), harmonics, held=held)
        self.held = held
        before = sum(len(a.rows(self.model.structure)) for a in self.modification.attachments[:-1])
        self.at = self.model.ports.extra.start + before + np.arange(len(ports))

    def changes(self, baseline: BaselineParameters, each: Sequence[PortForces], *, added: Array | None = None) -> Array:
        """D predicted (r, k), whitened as the residual is, by each of these forces.

        Parameters
        ----------
        added : ndarray, (s, 2 p, k)
            What goes with each to the stiffness of the layers' points, where that is known: by default what harmonics
            add once they follow.
        """
        held = self.held
        blocks = [
            real_ones(whitening.columns(self._of_broadband(data, baseline, each)))
            for data, whitening in zip(self.evidence.broadband, held.broadband, strict=True)
        ]
        if len(self.evidence.steps):
            blocks += self._of_steps(baseline, each, added)
        return np.concatenate(blocks)

    def _of_broadband(self, data: BinnedResponse, baseline: BaselineParameters, each: Sequence[PortForces]) -> Array:
        """Changes (b, o, k) of the log responses."""
        alone, omega = self.broadband_receptance(data, baseline, data.omega)
        R, motion = alone, noise_motion(self, alone, omega, data, self.at)
        if self.local.act_in_noise:
            R = in_noise(self, alone, omega, noise_motion(self, alone, omega, data, self.nonlinear_ports))
        into = self.driven(R, omega)[:, self.at]
        force = _attached(each, omega, into)
        for k, one in enumerate(each):
            for local, port, times in one.nonlinear:
                if local.random is not None:
                    force[:, port, k] += times * local.random(motion[port], omega) * into[:, port]
        return self.log_response_change(-R[:, self.model.ports.outputs][:, :, self.at] @ force, R, omega)

    def _of_steps(self, baseline: BaselineParameters, each: Sequence[PortForces], added: Array | None) -> list[Array]:
        """Whitened changes (r, k) of the steps, and of their harmonics where these are data."""
        reference, held = self.evidence.reference, self.held
        R, omega, balance = self.step_receptance(baseline, inner=False, held=self.balance_at(held, baseline))
        motion, influence = self.port_motion(R, omega)
        scale = self.undrifted_reading / self.responses(R, omega)[:, reference]
        driven = self.driven(R, omega)
        at_ports = driven[:, self.at] * scale[:, None]
        orders = self.harmonics.orders if self.harmonics is not None else np.zeros(0, int)
        count = int(max([1, *self.orders, *orders]))
        force = _attached(each, omega, at_ports)
        own: Array = np.zeros((count, *force.shape), complex)
        outputs = len(self.evidence.channels)
        made: Array = np.zeros((len(omega), len(orders), outputs, len(each)), complex)
        for k, one in enumerate(each):
            for local, port, times in one.nonlinear:
                x, here = at_ports[:, port], omega.real
                force[:, port, k] += times * local.equivalent(np.abs(x), here) * x
                wave = times * local.harmonics(np.abs(x), count, here) * turned(x, count)
                own[:, :, port, k] += wave.T
                if self.harmonics is not None:  # on the mesh that these were reduced with
                    read = self.harmonics.field @ local.row(self.harmonics.structure)
                    made[..., k] -= read * wave[:, orders - 1, None]
        per_force = force / scale[:, None, None]
        response = self.log_response_change(-R[:, self.model.ports.outputs][:, :, self.at] @ per_force, R, omega)
        moved = -R[:, self.moving][:, :, self.at] @ per_force / driven[:, self.moving, None]
        moved = moved - response[:, None, reference]
        if len(self.points):
            added = self._added(baseline, balance, each, own) if added is None else added
            response = response + influence.response[:, :, : 2 * len(self.points)] @ added
            moved = moved + influence.motion[:, :, : 2 * len(self.points)] @ added
        change = self.local.follow(
            baseline.laws, np.abs(motion), omega, influence, moved, response, balance.added
        )[::-1]  # fmt: skip
        found = [columns for _, columns in self._steps(R, omega, held.steps, change)[1]]
        if self.harmonics is not None:
            whitening = held.harmonics or self.harmonics.whitening(self.errors.harmonics)
            columns = self.harmonics.whiten(made, whitening)
            for _, of_others in self._harmonics(baseline, R, balance, whitening, change)[1]:
                columns = columns + of_others
            found.append(columns)
        return found

    def _added(self, baseline: BaselineParameters, balance: Balance, each: Sequence[PortForces], own: Array) -> Array:
        """Changes (s, 2 p, k) of the stiffness that harmonics add at the points, at fundamentals that are held."""
        harmonics = PointHarmonics.at(self, baseline, balance)
        moved = []
        for h, (R, _, omega), motion in zip(self.orders, harmonics.around, harmonics.motion, strict=True):
            forces = _attached(each, omega, motion[:, self.at]) + (own[h - 1] if h else 0.0)
            moved.append(-R[:, self.moving[: 2 * len(self.points), None], self.at] @ forces)
        return harmonics.followed(np.stack(moved, axis=1))


def _attached(each: Sequence[PortForces], omega: Array, motion: Array) -> Array:
    """Forces (f, n, k) of what is attached, by the motion (f, n) of the ports."""
    force = np.zeros((*motion.shape, len(each)), complex)
    for k, one in enumerate(each):
        for attachment, ports, times in one.attached:
            Z, x = attachment.stiffness(omega), motion[:, ports]
            force[:, ports, k] += times * (Z * x if Z.ndim == 2 else np.einsum("fpq,fq->fp", Z, x))
    return force
