"""Where a proposed sweep may go: about the resonances that were swept, or about another mode of the same joint."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.diagnose.fitted_model import FittedModel, modification_of
from twin.identify.linear_model import DAMPED_MODES
from twin.identify.measured_data import MeasuredData
from twin.identify.receptance import update_receptance
from twin.identify.residual_model import ResidualModel
from twin.identify.resonances import by_resonance, same_resonance

Array = NDArray[Any]

HEADROOM = 0.8
"""Share of a converter's range that may be used."""
STEPS = 35
"""Of a proposed sweep."""
HARDER = (0.5, 1.0, 1.3)
"""Largest forces of a sweep over the largest of the recordings; beyond these the joint's law is not known."""
OPENED = (0.3, 0.9)
"""Largest opening or slip of a layer point at another mode's resonance, over the largest that was measured: the law
is known up to there."""
LINEAR = 1e-3
"""The same of a joint that acts as a linear one."""
SEARCHED, FINE = 0.1, 400
"""Relative range below and above a natural frequency in which its resonance is sought, and the frequencies there."""
TURNS = 8
"""Of the motion of the layer's points and the stiffness that it leaves; each halves what is left to change."""
WIDTHS = 4.0
"""Half-power widths to each side of the resonances, with the joint linear and as soft as was measured."""
LOUDEST = 2.0
"""Force over the largest that was used up to which the shaker is trusted."""


@dataclass(frozen=True)
class Band:
    """Frequencies of a sweep, and the forces that may be used there.

    Attributes
    ----------
    frequencies_Hz : tuple of float
    amplitudes_N : tuple of float
    mode : int
        Number of another mode, from 1; 0 where the recordings went already.
    """

    frequencies_Hz: tuple[float, ...]
    amplitudes_N: tuple[float, ...]
    mode: int = 0


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
        forces = [float(np.round(share * at_most, 3)) for share in HARDER]
        kept = tuple(force for force in forces if _within_range(evidence, rows, force))
        if kept:
            yield Band(_picked(used[group]), kept)
    loudest = LOUDEST * max(states[i].target_amplitude for i in at_force)
    yield from _other_modes(evidence, model, used, highest_Hz, loudest)


def _other_modes(
    evidence: MeasuredData, model: FittedModel, used: Array, highest_Hz: float, loudest_N: float
) -> Iterator[Band]:
    residual_model = ResidualModel(evidence, modification_of(evidence, model.hypotheses))
    motion = np.abs(residual_model.step_receptance(model.baseline, inner=False)[2].motion).max(axis=0)
    ranges = np.array([sensor.range for sensor in evidence.rig.response_sensors if sensor.channel in evidence.channels])
    for mode, natural in enumerate(residual_model.model.basis.omega[:DAMPED_MODES] / (2 * np.pi), start=1):
        if natural > highest_Hz or same_resonance(natural, used).any():
            continue
        f = np.linspace((1 - SEARCHED) * natural, (1 + SEARCHED) * natural, FINE)
        found = [_at(residual_model, model, 2 * np.pi * f, motion, share) for share in (LINEAR, *OPENED)]
        edges = np.array([_half_power(f, readings[:, evidence.reference]) for _, readings in found])
        (low, high), width = (edges[:, 0].min(), edges[:, 1].max()), np.max(edges[:, 1] - edges[:, 0])
        low, high = max(low - WIDTHS / 2 * width, f[0]), min(high + WIDTHS / 2 * width, f[-1])
        forces = []
        for opening, readings in found[1:]:
            headroom = HEADROOM * float(np.min(ranges / np.max(readings, axis=0)))
            forces.append(min(opening, headroom, HEADROOM * evidence.rig.force_sensor.range, loudest_N))
        kept = dict.fromkeys(float(f"{force:.2g}") for force in forces)
        yield Band(tuple(np.round(np.linspace(low, high, STEPS), 3).tolist()), tuple(kept), mode)


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
    for _ in range(TURNS):
        at = np.broadcast_to(amplitude, (len(omega), len(amplitude)))
        R = update_receptance(free, residual_model.moving, forces.stiffness(model.baseline.laws, at, omega)[0])
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
    """At most :data:`STEPS` of the frequencies that were used, at even places among them."""
    different = np.unique(np.round(used, 4))
    picked = np.unique(np.round(np.linspace(0, len(different) - 1, min(STEPS, len(different)))).astype(int))
    return tuple(float(f) for f in different[picked])


def _within_range(evidence: MeasuredData, rows: Array, amplitude_N: float) -> bool:
    """Whether force and responses stay within their converters' ranges, the responses growing as the force does."""
    rig, steps = evidence.rig, evidence.steps
    louder = amplitude_N / max(steps.states[row].target_amplitude for row in rows)
    if amplitude_N > HEADROOM * rig.force_sensor.range:
        return False
    ranges = {sensor.channel: sensor.range for sensor in rig.response_sensors}
    peaks = np.max(np.abs(steps.response[rows, :, 0]), axis=0)
    return all(
        louder * peak < HEADROOM * ranges[channel] for channel, peak in zip(evidence.channels, peaks, strict=True)
    )
