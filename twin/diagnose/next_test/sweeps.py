"""Where a proposed sweep may go: about the resonances that were swept, or about another mode of the same joint."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from twin.arrays import Array
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.next_test.limits import LIMITS
from twin.identify.limits import LIMITS as IDENTIFY
from twin.identify.linear.structural_modification import update_receptance
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.spectra.resonances import by_resonance, same_resonance


@dataclass(frozen=True)
class Band:
    """Frequencies of a sweep, and the forces that may be used there."""

    frequencies_Hz: tuple[float, ...]
    amplitudes_N: tuple[float, ...]
    mode: int = 0
    """Number of another mode, from 1; 0 where the recordings went already."""


def sweep_bands(evidence: MeasuredData, model: FittedModel, *, highest_Hz: float) -> Iterator[Band]:
    """The resonances that were swept, then every other mode's.

    Parameters
    ----------
    model
        The best one, for where the other modes' resonances are and how far they open the joint.
    highest_Hz
        Largest frequency that the instruments follow.
    """
    states = evidence.steps.states
    at_force = np.array([i for i, state in enumerate(states) if state.target_channel == evidence.force], int)
    if not len(at_force):
        return
    used = np.array([states[i].frequency_Hz for i in at_force])
    for group in by_resonance(used):
        rows = at_force[group]
        at_most = max(states[row].target_amplitude for row in rows)
        forces = [float(np.round(share * at_most, 3)) for share in LIMITS.sweeps_harder]
        kept = tuple(force for force in forces if _within_range(evidence, rows, force))
        if kept:
            yield Band(_picked(used[group]), kept)
    loudest = LIMITS.sweeps_loudest * max(states[i].target_amplitude for i in at_force)
    yield from _other_modes(evidence, model, used, highest_Hz, loudest)


def _other_modes(
    evidence: MeasuredData, model: FittedModel, used: Array, highest_Hz: float, loudest_N: float
) -> Iterator[Band]:
    residual_model = model.residual_model(evidence)
    motion = np.abs(residual_model.step_receptance(model.baseline, inner=False)[2].motion).max(axis=0)
    ranges = np.array([sensor.range for sensor in evidence.rig.response_sensors if sensor.channel in evidence.channels])
    for mode, natural in enumerate(residual_model.model.basis.omega[: IDENTIFY.damped_modes] / (2 * np.pi), start=1):
        if natural > highest_Hz or same_resonance(natural, used).any():
            continue
        f = np.linspace(
            (1 - LIMITS.sweeps_searched) * natural, (1 + LIMITS.sweeps_searched) * natural, LIMITS.sweeps_fine
        )
        found = [
            _at(residual_model, model, 2 * np.pi * f, motion, share)
            for share in (LIMITS.sweeps_linear, *LIMITS.sweeps_opened)
        ]
        edges = np.array([_half_power(f, readings[:, evidence.reference]) for _, readings in found])
        (low, high), width = (edges[:, 0].min(), edges[:, 1].max()), np.max(edges[:, 1] - edges[:, 0])
        low, high = (
            max(low - LIMITS.sweeps_widths / 2 * width, f[0]),
            min(high + LIMITS.sweeps_widths / 2 * width, f[-1]),
        )
        forces = []
        for opening, readings in found[1:]:
            headroom = LIMITS.sweeps_headroom * float(np.min(ranges / np.max(readings, axis=0)))
            forces.append(min(opening, headroom, LIMITS.sweeps_headroom * evidence.rig.force_sensor.range, loudest_N))
        kept = dict.fromkeys(float(f"{force:.2g}") for force in forces)
        yield Band(tuple(np.round(np.linspace(low, high, LIMITS.sweeps_steps), 3).tolist()), tuple(kept), mode)


def _at(
    residual_model: ResidualModel, model: FittedModel, omega: Array, motion: Array, share: float
) -> tuple[float, Array]:
    """Force that opens the layer by a share of `motion` (n,) at most, N, and the readings (f, o) per N there.

    By iteration: how stiff the points are, and how much they lose, goes by how the mode moves each of them.  Without a
    joint no force is too much.
    """
    forces = replace(residual_model.local, weights=np.tile(residual_model.points.weights, (len(omega), 1)))
    free = residual_model.receptance(omega, model.baseline.base, np.zeros(len(omega)), inner=False, points=True)
    points, amplitude, force = 2 * len(residual_model.points), share * motion, np.inf
    for _ in range(LIMITS.sweeps_turns):
        at = np.broadcast_to(amplitude, (len(omega), len(amplitude)))
        stiffness, _ = forces.stiffness(model.baseline.laws, at, omega, np.zeros((len(omega), points // 2, 2)))
        R = update_receptance(free, residual_model.moving, stiffness)
        if not points:
            break
        moved = np.abs(residual_model.driven(R, omega)[:, residual_model.moving])
        there = moved[np.argmax(np.max(moved[:, :points] / motion[:points], axis=1))]
        force = share / float(np.max(there[:points] / motion[:points]))
        amplitude = np.sqrt(amplitude * force * there)
    return force, np.abs(residual_model.responses(R, omega))


def _half_power(f: Array, size: Array) -> tuple[float, float]:
    """Frequencies about the largest response between which it is at least its 0.7-fold."""
    peak = int(np.argmax(size))
    below = np.flatnonzero(size < size[peak] / np.sqrt(2))
    left, right = below[below < peak].max(initial=0), below[below > peak].min(initial=len(f) - 1)
    return float(f[left]), float(f[right])


def _picked(used: Array) -> tuple[float, ...]:
    """At most ``LIMITS.sweeps_steps`` of the frequencies that were used, at even places among them."""
    different = np.unique(np.round(used, 4))
    picked = np.unique(
        np.round(np.linspace(0, len(different) - 1, min(LIMITS.sweeps_steps, len(different)))).astype(int)
    )
    return tuple(float(f) for f in different[picked])


def _within_range(evidence: MeasuredData, rows: Array, amplitude_N: float) -> bool:
    """Whether force and responses stay within their converters' ranges, the responses growing as the force does."""
    rig, steps = evidence.rig, evidence.steps
    louder = amplitude_N / max(steps.states[row].target_amplitude for row in rows)
    if amplitude_N > LIMITS.sweeps_headroom * rig.force_sensor.range:
        return False
    ranges = {sensor.channel: sensor.range for sensor in rig.response_sensors}
    peaks = np.max(np.abs(steps.response[rows, :, 0]), axis=0)
    return all(
        louder * peak < LIMITS.sweeps_headroom * ranges[channel]
        for channel, peak in zip(evidence.channels, peaks, strict=True)
    )
