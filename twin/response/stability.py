"""Stability of a steady state: Floquet multipliers, the eigenvalues of the bench's own map over one period.

The map takes the poles' states and the laws' memories from one period to the next.  It is differentiated step by step
along its own steady path (:mod:`twin.response.tangent_map`), so that friction, slap and running means count as they do
on the bench, whatever they are.  A perturbation grows, and a sweep leaves the branch, where a multiplier exceeds one.
"""

from dataclasses import replace

import numpy as np

from twin.arrays import Array
from twin.bench.linear import Poles
from twin.bench.marching import Elements, coefficients, integrate, packed
from twin.joint.kernel import COMPILED, remember
from twin.joint.kinds import RUNNING_LOSS
from twin.response.limits import LIMITS
from twin.response.tangent_map import tangent_map


def floquet_multipliers(
    poles: Poles, elements: Elements, *, locals_: int, frequency_Hz: float, rate_Hz: float, outputs: Array,
    inputs: Array,
) -> Array:  # fmt: skip
    """Multipliers of a periodic state, largest first.

    Parameters
    ----------
    poles
        Of the linear rig; local coordinates come first among the outputs, then auxiliary rows.
    elements
        Nonlinear elements at rest.
    locals_
        How many local coordinates there are.
    frequency_Hz
        Fundamental.
    rate_Hz
        Least number of steps a second; a whole number of them makes a period.
    outputs : ndarray, (locals + auxiliaries, H + 1)
        Complex harmonics of local coordinates and auxiliary rows: y = Re(sum Y_k exp(j k w t)).
    inputs : ndarray, (1 + locals, H + 1)
        Of the generator and of the local forces.
    """
    steps = int(np.ceil(rate_Hz / frequency_Hz))
    c = coefficients(poles, 1.0 / (frequency_Hz * steps))
    waves = np.exp(2j * np.pi * np.outer(np.arange(inputs.shape[1]), np.arange(1, steps + 1) / steps))
    balanced, drive = (np.ascontiguousarray((driven @ waves).real) for driven in (outputs, inputs[0]))
    memory = elements.state.copy()
    running = elements.kind == RUNNING_LOSS
    taus = elements.parameters[running, 0] if running.any() else np.zeros(1)
    periods = 2 + int(np.ceil(LIMITS.stability_forgotten * taus.max() * frequency_Hz))
    largest = np.zeros_like(memory)
    _settle(c.step_s, periods, balanced, elements._replace(state=memory), largest)
    size = LIMITS.stability_beside * np.maximum(np.abs(outputs).sum(axis=1), 1e-30)
    beside = LIMITS.stability_beside * largest
    poles_move = packed(np.full(len(c.decay), 1.0 + 1.0j))  # and what fills whole vectors does not
    moves = np.flatnonzero(np.concatenate([poles_move, beside.ravel()]))
    # The bench's own path, whose kinks no harmonics have: both local coordinates and channels are what is remembered.
    rows, u = len(outputs), inputs.sum(axis=1).real
    twice = replace(c, C=np.vstack([c.C[:rows]] * 2), D=np.vstack([c.D[:rows]] * 2))
    w = c.decay * (_pole_states(poles, inputs, 2 * np.pi * frequency_Hz) - c.G1 @ u) + c.Gamma @ u
    step, path = twice.packed(locals_, rows - locals_), np.empty((steps, rows))
    marched = elements._replace(state=memory.copy())
    integrate(step, marched, packed(w), balanced[:locals_, -1].copy(), np.zeros(1 + locals_), drive, path)
    path = np.ascontiguousarray(path.T)
    J = tangent_map(step, elements._replace(state=memory), path, size, beside, moves)
    multipliers = np.linalg.eigvals(J)
    return np.asarray(multipliers[np.argsort(-np.abs(multipliers))])


def _pole_states(poles: Poles, inputs: Array, omega: float) -> Array:
    """The poles' states at the phase zero of periodic inputs."""
    y = 1j * omega * np.arange(inputs.shape[1])
    forward, backward = poles.B @ inputs, poles.B @ inputs.conj()
    lam = poles.pole[:, None]
    return np.asarray(0.5 * np.sum(forward / (y - lam) + backward / (-y - lam), axis=1))


@COMPILED
def _settle(step_s: float, periods: int, path: Array, elements: Elements, largest: Array) -> None:
    """Lead the memories along the periodic path until they are periodic too; each one's `largest` size then is told."""
    kind, coordinate, auxiliary, _, parameters, memory = elements
    for period in range(periods):
        for t in range(path.shape[1]):
            for e in range(kind.shape[0]):
                displacement = path[auxiliary[e], t] if auxiliary[e] >= 0 else 0.0
                remember(kind[e], parameters, memory, e, path[coordinate[e], t], displacement, step_s)
                if period == periods - 1:
                    for i in range(memory.shape[1]):
                        largest[e, i] = max(largest[e, i], abs(memory[e, i]))
