"""What harmonics add at the layer's points as a function of the unknowns, at fundamentals that are held.

A harmonic may meet a resonance, whose frequency and damping are unknown, too.  Where it does, a loss at the slips damps
the very motion that sets it, and a fit that held this would step too far.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward.forward_model import AtHarmonic, ForwardModel
from twin.identify.limits import LIMITS
from twin.identify.nonlinear.balance import Balance
from twin.identify.nonlinear.opening_harmonics import OpeningBalance, Openings, balance_openings, sensitivity
from twin.identify.nonlinear.running_amplitude import counts_of, running_loss_by_squares, squares_of
from twin.identify.residuals.linearisation import LostContact


@dataclass(frozen=True)
class PointHarmonics:
    """Harmonics of the layer's points, and how they follow what changes around these."""

    model: ForwardModel
    baseline: BaselineParameters
    found: Balance
    around: Sequence[AtHarmonic]
    """Of each order, see :meth:`~twin.identify.forward.forward_model.ForwardModel.at_harmonic`."""
    openings: Openings
    balance: OpeningBalance

    @classmethod
    def at(
        cls, model: ForwardModel, baseline: BaselineParameters, found: Balance, *, inner: bool = False
    ) -> PointHarmonics:
        """At fundamentals in balance, with receptances of the inner ports or without."""
        around = [model.at_harmonic(h, baseline, found, inner=inner) for h in model.orders]
        openings = model.openings(baseline, found, around)
        return cls(model, baseline, found, around, openings, balance_openings(baseline.laws, openings, model.slaps))

    @cached_property
    def motion(self) -> list[Array]:
        """Of all ports, m, (s, n), for each order."""
        model, found = self.model, list[Array]()
        opening, drive = model.moving[: len(model.points)], model.model.ports.drive
        of_forces = model.forced_harmonics(self.baseline, self.found, model.orders)
        for number, (R, force, _) in enumerate(self.around):
            by_force = np.einsum("spq,sq->sp", R[:, :, opening], self.balance.force[:, number])
            by_force += np.einsum("spq,sq->sp", R[:, :, model.nonlinear_ports], of_forces[number])
            found.append(R[:, :, drive] * force[:, None] - by_force)
        return found

    def followed(self, moved: Array, *, of_law: bool = False) -> Array:
        """Change (s, 2 p, k) of the stiffness that they add at the points, N/m.

        Parameters
        ----------
        moved : ndarray, (s, h, 2 p, k)
            Change of the points' harmonics with k parameters of what is around, at forces that are held.
        of_law
            Whether these are the unknowns, among them the law's, with which the forces change as well.
        """
        laws, local, p, k = self.baseline.laws, self.model.local, len(self.model.points), moved.shape[3]
        ports, slip = self.model.moving[: 2 * p], self.model.moving[p : 2 * p]
        by_loss = [  # at each slip, whose change is not known yet
            -1j * h * R[:, ports[:, None], slip] * motion[:, None, slip]
            for h, (R, *_), motion in zip(self.model.orders, self.around, self.motion, strict=True)
        ]
        moved = np.concatenate([moved, np.stack(by_loss, axis=1)], axis=3)
        by_softening, (of_openings, of_slips) = sensitivity(
            laws, self.openings, self.balance.motion, moved, slaps=self.model.slaps
        )
        direct = np.zeros((len(moved), p, k))
        if of_law:
            by_law = local.by_law(laws, np.abs(self.found.motion), self.found.added.squares)
            for joint, (columns, (_, lossier)) in enumerate(zip(by_softening, by_law, strict=True)):
                softening = self.baseline.softening(joint)
                of_openings[:, :, softening], of_slips[..., softening] = columns
                direct[:, local.of_joint(joint), self.baseline.loss(joint)] = lossier.imag
        whole = self._loss(direct, of_slips)
        return np.concatenate([of_openings[..., :k] + of_openings[..., k:] @ whole, 1j * (whole - direct)], axis=1)

    def _loss(self, direct: Array, moved: Array) -> Array:
        """Change of the slips' loss, N/m, (s, p, k).

        Harmonics move the running amplitude that the loss goes by, and more loss leaves less of them.

        Parameters
        ----------
        direct : ndarray, (s, p, k)
            The same with the harmonics held.
        moved : ndarray, (s, h, p, k + p)
            Change of the slips' harmonics, the last by the loss at each slip.
        """
        model, (*_, p, k) = self.model, direct.shape
        slips, amplitude = self.openings.slips(self.balance), np.abs(self.found.motion[:, p : 2 * p])
        squares = squares_of(slips, model.orders)
        by_squares = running_loss_by_squares(self.baseline.laws, model.points.joint, amplitude, squares)
        # d |S|^2 = 2 Re(S* dS), with what each order counts.
        counts, weights = counts_of(model.orders), model.local.weights[:, p:]
        weights = 2 * np.einsum("sp,spq,qh,shp->shp", weights, by_squares, counts, slips.conj())
        by_harmonics = np.sum((weights[..., None] * moved).real, axis=1)
        return np.linalg.solve(np.eye(p) - by_harmonics[..., k:], direct + by_harmonics[..., :k])


def harmonics_by_unknowns(
    model: ForwardModel, baseline: BaselineParameters, found: Balance
) -> tuple[Array, LostContact | None]:
    """Derivatives (s, 2 p, u) of the stiffness that harmonics add at the points; the openings where contact is lost."""
    here = PointHarmonics.at(model, baseline, found, inner=True)
    ports, p = model.moving[: 2 * len(model.points)], len(model.points)
    moved = np.zeros((*here.balance.motion.shape[:2], 2 * p, len(baseline.blocks)), complex)
    for number, ((R, _, omega), motion) in enumerate(zip(here.around, here.motion, strict=True)):
        change = model.base_change(model.step_model, R, omega, baseline, model.step_times, ports, motion)
        moved[:, number, :, : change.shape[2]] = change
    by_unknowns = here.followed(moved, of_law=True)
    if not model.modification.opening:
        return by_unknowns, None
    openings = here.openings
    for joint in range(len(baseline.laws)):  # lost contact takes off E' itself
        change = LIMITS.local_difference * (np.arange(len(openings.modulus)) == joint)
        stiffer = replace(openings, modulus=openings.modulus * (1 + change))
        more = balance_openings(baseline.laws, stiffer, model.slaps, start=here.balance.motion).more
        by_E = (more - here.balance.more) / LIMITS.local_difference
        by_unknowns[:, :p, baseline.blocks["log_E"].start + joint] += by_E
    return by_unknowns, LostContact(openings, here.balance, model.read_of_openings(here.around))
