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
from twin.identify.nonlinear.opening_harmonics import balance_openings, sensitivity
from twin.identify.nonlinear.running_amplitude import counts_of, running_loss_by_squares, squares_of
from twin.identify.residuals.linearisation import LostContact


def harmonics_by_unknowns(
    model: ForwardModel, baseline: BaselineParameters, found: Balance
) -> tuple[Array, LostContact | None]:
    """Derivatives (s, 2 p, u) of the stiffness that harmonics add at the points; the openings where contact is lost."""
    p, drive = len(model.points), model.model.ports.drive
    ports = model.moving[: 2 * p]
    opening, slip = ports[:p], ports[p:]
    around = [model.at_harmonic(h, baseline, found, inner=True) for h in model.orders]
    openings = model.openings(baseline, found, around)
    harmonics = balance_openings(baseline.laws, openings, model.slaps)
    u = len(baseline.blocks)
    moved = np.zeros((*harmonics.motion.shape[:2], 2 * p, u + p), complex)
    own_forces = model.forced_harmonics(baseline, found, openings.orders)
    for order, (h, (R, force, omega)) in enumerate(zip(openings.orders, around, strict=True)):
        by_force = np.einsum("spq,sq->sp", R[:, :, opening], harmonics.force[:, order])
        by_force += np.einsum("spq,sq->sp", R[:, :, model.nonlinear_ports], own_forces[order])
        into = R[:, :, drive] * force[:, None] - by_force
        change = model.base_change(model.step_model, R, omega, baseline, model.step_times, ports, into)
        moved[:, order, :, : change.shape[2]] = change
        # By the loss at each slip, whose change is not known yet.
        moved[:, order, :, u:] = -1j * h * R[:, ports[:, None], slip] * into[:, None, slip]
    by_softening, (of_openings, of_slips) = sensitivity(
        baseline.laws, openings, harmonics.motion, moved, slaps=model.slaps
    )
    for joint, columns in enumerate(by_softening):
        of_openings[:, :, baseline.softening(joint)], of_slips[..., baseline.softening(joint)] = columns
    direct, whole = _loss_by_unknowns(model, baseline, found, openings.slips(harmonics), of_slips)
    by_unknowns = np.concatenate([of_openings[:, :, :u] + of_openings[:, :, u:] @ whole, 1j * (whole - direct)], axis=1)
    if not model.modification.opening:
        return by_unknowns, None
    for joint in range(len(baseline.laws)):  # lost contact takes off E' itself
        change = LIMITS.local_difference * (np.arange(len(openings.modulus)) == joint)
        stiffer = replace(openings, modulus=openings.modulus * (1 + change))
        more = balance_openings(baseline.laws, stiffer, model.slaps, start=harmonics.motion).more
        by_E = (more - harmonics.more) / LIMITS.local_difference
        by_unknowns[:, :p, baseline.blocks["log_E"].start + joint] += by_E
    return by_unknowns, LostContact(openings, harmonics, model.read_of_openings(around))


def _loss_by_unknowns(
    model: ForwardModel, baseline: BaselineParameters, found: Balance, slips: Array, moved: Array
) -> tuple[Array, Array]:
    """Change of the slips' loss, N/m, by each unknown: with the harmonics held, and in all, (s, p, u).

    Harmonics move the running amplitude that the loss goes by, and more loss leaves less of them.

    Parameters
    ----------
    slips : ndarray, (s, h, p)
        Harmonics.
    moved : ndarray, (s, h, p, u + p)
        Their change by each unknown, and by the loss at each slip.
    """
    p, u, laws = len(model.points), len(baseline.blocks), baseline.laws
    amplitude = np.abs(found.motion)
    by_squares = running_loss_by_squares(
        laws, model.points.joint, amplitude[:, p : 2 * p], squares_of(slips, model.orders)
    )
    # d |S|^2 = 2 Re(S* dS), with what each order counts.
    counts, weights = counts_of(model.orders), model.local.weights[:, p:]
    weights = 2 * np.einsum("sp,spq,qh,shp->shp", weights, by_squares, counts, slips.conj())
    by_harmonics = np.sum((weights[..., None] * moved).real, axis=1)
    direct = np.zeros((len(slips), p, u))
    for joint, (_, by_loss) in enumerate(model.local.by_law(laws, amplitude, found.added.squares)):
        direct[:, model.local.of_joint(joint), baseline.loss(joint)] = by_loss.imag
    return direct, np.linalg.solve(np.eye(p) - by_harmonics[..., u:], direct + by_harmonics[..., :u])
