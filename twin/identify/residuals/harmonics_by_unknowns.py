"""What harmonics add at the layer's points as a function of the unknowns, at fundamentals that are held.

A harmonic may meet a resonance, whose frequency and damping are unknown, too.  Where it does, a loss at the slips damps
the very motion that sets it, and a fit that held this would step too far.
"""

from dataclasses import replace

import numpy as np

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward.forward_model import ForwardModel
from twin.identify.limits import LIMITS
from twin.identify.nonlinear.balance import Balance
from twin.identify.nonlinear.opening_harmonics import (
    OpeningBalance,
    Openings,
    balance_openings,
    slips_sensitivity,
    stiffness_sensitivity,
)
from twin.identify.nonlinear.running_amplitude import running_loss_by_squares, squares_of
from twin.identify.residuals.linearisation import LostContact


def harmonics_by_unknowns(
    model: ForwardModel, baseline: BaselineParameters, found: Balance
) -> tuple[Array, LostContact | None]:
    """Derivatives (s, 2 p, u) of the stiffness that harmonics add at the points; the openings where contact is lost."""
    p, drive = len(model.points), model.model.ports.drive
    opening, slip = model.moving[:p], model.moving[p : 2 * p]
    around = [model.at_harmonic(h, baseline, found, inner=True) for h in model.orders]
    openings = model.openings(baseline, found, around)
    harmonics = balance_openings(baseline.laws, openings, model.slaps)
    moved = np.zeros((*harmonics.motion.shape, len(baseline.blocks)), complex)
    by_slip = np.empty((*harmonics.motion.shape[:2], 2 * p, p), complex)
    own_forces = model.forced_harmonics(baseline, found, openings.orders)
    for order, (h, (R, force, omega)) in enumerate(zip(openings.orders, around, strict=True)):
        by_force = np.einsum("spq,sq->sp", R[:, :, opening], harmonics.force[:, order])
        by_force += np.einsum("spq,sq->sp", R[:, :, model.nonlinear_ports], own_forces[order])
        into = R[:, :, drive] * force[:, None] - by_force
        change = model.base_change(model.step_model, R, omega, baseline, model.step_times, opening, into)
        moved[:, order, :, : change.shape[2]] = change
        by_slip[:, order] = -1j * h * R[:, model.moving[: 2 * p, None], slip] * into[:, None, slip]
    slips_by_loss, lossier = _slips_by_loss(model, baseline, found, (openings, harmonics), by_slip)
    for joint, by_loss in enumerate(lossier):
        moved[..., baseline.loss(joint)] = by_slip[:, :, :p] @ by_loss[:, None]
    by_softening, of_openings = stiffness_sensitivity(
        baseline.laws, openings, harmonics.motion, moved, slaps=model.slaps
    )
    by_unknowns = np.concatenate([of_openings, np.zeros_like(of_openings)], axis=1)
    for joint, by in enumerate(by_softening):
        by_unknowns[:, :p, baseline.softening(joint)] = by
        by_unknowns[:, p:, baseline.loss(joint)] = 1j * slips_by_loss[joint]
        if model.modification.opening:  # lost contact takes off E' itself
            change = LIMITS.local_difference * (np.arange(len(openings.modulus)) == joint)
            stiffer = replace(openings, modulus=openings.modulus * (1 + change))
            more = balance_openings(baseline.laws, stiffer, model.slaps, start=harmonics.motion).more
            by_E = (more - harmonics.more) / LIMITS.local_difference
            by_unknowns[:, :p, baseline.blocks["log_E"].start + joint] += by_E
    if not model.modification.opening:
        return by_unknowns, None
    return by_unknowns, LostContact(openings, harmonics, model.read_of_openings(around))


def _slips_by_loss(
    model: ForwardModel, baseline: BaselineParameters, found: Balance, at: tuple[Openings, OpeningBalance],
    by_slip: Array,
) -> tuple[list[Array], list[Array]]:  # fmt: skip
    """Change (s, p, m) of what harmonics add to the slips' loss, N/m, and of all their loss, by each joint's loss.

    More loss leaves less of a harmonic, and that moves the running amplitude which the loss goes by.

    Parameters
    ----------
    by_slip : ndarray, (s, h, 2 p, p)
        Changes of openings' and slips' harmonics by the loss at each slip, N/m, at forces that are held.
    """
    p, (openings, harmonics), laws = len(model.points), at, baseline.laws
    by_loss = slips_sensitivity(
        laws, openings, harmonics.motion, by_slip[:, :, :p], by_slip[:, :, p:], slaps=model.slaps
    )
    order, slips = np.array(openings.orders, float), openings.slips(harmonics)
    squares = 2 * (slips.conj()[..., None] * by_loss).real
    weight = np.stack([np.where(order == 0, 2.0, 1.0), order**2])
    amplitude = np.abs(found.motion[:, p : 2 * p])
    by_squares = running_loss_by_squares(laws, model.points.joint, amplitude, squares_of(slips, openings.orders))
    fed_back = openings.slip_weight[:, :, None] * np.einsum("spq,qh,shpr->spr", by_squares, weight, squares)
    added, whole = [], []
    for joint, (_, own) in enumerate(model.local.by_law(laws, np.abs(found.motion), found.added.squares)):
        direct = np.zeros((len(slips), p, own.shape[2]))
        direct[:, model.local.of_joint(joint)] = own.imag
        whole.append(np.linalg.solve(np.eye(p) - fed_back, direct))
        added.append(whole[-1] - direct)
    return added, whole
