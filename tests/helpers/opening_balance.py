"""Plain numpy twin of the compiled balance of the layer's openings: all steps at once, by its own algebra."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from twin.identify.limits import LIMITS
from twin.identify.model_modification import Opening
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.nonlinear.opening_harmonics import (
    SAMPLES,
    SHORTEST,
    TURNS,
    OpeningBalance,
    Openings,
    _odd_force,
)

__all__ = ["balance_openings_numpy"]

Array = NDArray[Any]


def balance_openings_numpy(law: LayerLaw, openings: Openings, slap: Opening | None = None) -> OpeningBalance:
    """What `balance_openings` of the model returns; here all steps turn until the last is done."""
    a, orders = openings.fundamental, np.array(openings.orders)
    size = np.maximum(np.max(np.abs(a), axis=1), 1e-300)
    theta = 2 * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES
    waves, wave = np.exp(1j * np.outer(orders, theta)), np.exp(1j * theta)
    project = waves.conj().T * np.where(orders == 0, 1.0, 2.0) / SAMPLES
    X = np.zeros((len(a), len(orders), a.shape[1]), complex)
    # A static opening has no imaginary part.
    real = np.repeat(orders > 0, a.shape[1])
    nearest, share, unsettled = np.full(len(a), np.inf), np.ones(len(a)), np.full(len(a), np.inf)
    base, taken = X, np.zeros_like(X)
    for turn in range(TURNS + 1):
        opening = (a[:, :, None] * wave).real + np.einsum("shp,ht->spt", X, waves).real
        force, tangent = _force(law, openings, slap, opening)
        harmonics = np.moveaxis(force @ project, 2, 1)
        miss = X - openings.driven + np.einsum("shpq,shq->shp", openings.compliance, harmonics)
        flat = miss.reshape(len(a), -1)
        step = _newton_step(openings, orders, tangent, flat, real)
        left = np.linalg.norm(flat, axis=1)
        # Where a contact opens within a step, whole steps may go round in circles: half of one, until it comes nearer.
        nearer = (left < nearest) | (share <= SHORTEST)
        unsettled = np.where(nearer, np.max(np.abs(step), axis=1) / size, unsettled)
        if np.max(unsettled, initial=0.0) < 1e-4 * LIMITS.opening_balanced or turn == TURNS:
            break
        # Nor is any step larger than half the motion itself to be trusted.
        step = (step * np.minimum(1.0, 0.5 / np.maximum(unsettled, 1e-300))[:, None]).reshape(X.shape)
        pick = nearer[:, None, None]
        base, taken = np.where(pick, X, base), np.where(pick, step, taken)
        nearest, share = np.where(nearer, left, nearest), np.where(nearer, 1.0, share / 2)
        X = base - share[:, None, None] * taken
    # Less what the time form makes of the fundamental alone: nothing, but for its table and where a spline must bend.
    alone = _force(law, openings, None, (a[:, :, None] * wave).real)[0]
    first = (force - alone) @ wave.conj() * (2 / SAMPLES)
    return OpeningBalance(X, harmonics, first / np.where(a == 0, 1.0, a), float(np.max(unsettled, initial=0.0)))


def _newton_step(openings: Openings, orders: Array, tangent: Array, miss: Array, real: Array) -> Array:
    """Complex changes (s, h p) that undo `miss`, from the tangent (s, p, t) of the force along the samples."""
    count, p, H = len(tangent), tangent.shape[1], len(orders)
    shifted = np.exp(-0.5j * np.arange(SAMPLES) * 2 * np.pi / SAMPLES)  # the samples lie half a step late
    tau = np.fft.fft(tangent, axis=2) * shifted / SAMPLES
    less, more = orders[:, None] - orders, orders[:, None] + orders
    static = np.where(orders == 0, 0.5, 1.0)
    wave = _harmonic(tau, less) * static[:, None] * np.where(orders == 0, 2.0, 1.0)
    conjugate = _harmonic(tau, more) * static[:, None] * np.where(orders == 0, 0.0, 1.0)
    eye = np.eye(H * p)
    A, B = (
        np.einsum("shpq,sqhk->shpkq", openings.compliance, part).reshape(count, H * p, H * p)
        for part in (wave, conjugate)
    )
    J = np.empty((count, 2 * H * p, 2 * H * p))
    J[:, : H * p, : H * p], J[:, : H * p, H * p :] = eye + (A + B).real, (B - A).imag
    J[:, H * p :, : H * p], J[:, H * p :, H * p :] = (A + B).imag, eye + (A - B).real
    keep = np.concatenate([np.ones(H * p, bool), real])
    right = np.concatenate([miss.real, miss.imag], axis=1)[:, keep]
    solved = np.zeros((count, 2 * H * p))
    solved[:, keep] = np.linalg.solve(J[:, keep][:, :, keep], right[:, :, None])[:, :, 0]
    return np.asarray(solved[:, : H * p] + 1j * solved[:, H * p :])


def _harmonic(tau: Array, order: Array) -> Array:
    """Fourier coefficients (s, p, h, k) of given orders, negative ones too; aliases stand for none."""
    return np.asarray(np.where(order >= 0, tau[:, :, np.abs(order)], tau[:, :, np.abs(order)].conj()))


def _force(law: LayerLaw, openings: Openings, slap: Opening | None, opening: Array) -> tuple[Array, Array]:
    """The law's force beyond its secant stiffness and its tangent, (s, p, t), N and N/m."""
    x, _, slope = _odd_force(law, openings.modulus[0])
    size, sign = np.abs(opening), np.sign(opening)
    tangent = np.interp(size, x, slope)
    whole = make_interp_spline(x, slope, k=1).antiderivative()
    odd = whole(np.minimum(size, x[-1])) + np.maximum(size - x[-1], 0.0) * slope[-1]
    force = sign * odd
    if slap is not None:
        lost = np.where(opening > slap.gap_m, 1 - slap.factor, 0.0)
        force = force - lost * (odd - whole(slap.gap_m))
        tangent = tangent * (1 - lost)
    w, E = openings.weight[:, :, None], openings.modulus[0]
    rest = openings.secant[:, :, None] + E * w
    return w * force - rest * opening, w * tangent - rest
