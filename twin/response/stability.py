"""Stability of a steady state: Floquet multipliers, the eigenvalues of the bench's own map over one period.

The map takes the poles' states and the laws' memories from one period to the next.  It is differentiated by marching
one period from states a little beside the steady one, so that friction, slap and running means count as they do on the
bench, whatever they are.  A perturbation grows, and a sweep leaves the branch, where a multiplier exceeds one.
"""

import numpy as np
from numpy.typing import NDArray

from twin.bench.linear import Poles
from twin.bench.marching import Elements, Step, coefficients, integrate, packed
from twin.joint.kernel import COMPILED, remember
from twin.joint.kinds import RUNNING_LOSS
from twin.response.limits import LIMITS

Matrix = NDArray[np.float64]
Complex = NDArray[np.complex128]


def floquet_multipliers(
    poles: Poles, elements: Elements, *, locals_: int, frequency_Hz: float, rate_Hz: float, outputs: Complex,
    inputs: Complex,
) -> Complex:  # fmt: skip
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
    phase = 2 * np.pi * np.arange(1, steps + 1) / steps
    waves = np.exp(1j * np.outer(np.arange(inputs.shape[1]), phase))
    path, drive, u = (outputs @ waves).real, (inputs[0] @ waves).real, inputs.sum(axis=1).real
    w = c.decay * (_pole_states(poles, inputs, 2 * np.pi * frequency_Hz) - c.G1 @ u) + c.Gamma @ u
    memory = elements.state.copy()
    running = elements.kind == RUNNING_LOSS
    taus = elements.parameters[running, 0] if running.any() else np.zeros(1)
    periods = 2 + int(np.ceil(LIMITS.stability_forgotten * taus.max() * frequency_Hz))
    _settle(c.step_s, periods, np.ascontiguousarray(path), elements._replace(state=memory))
    rows = len(outputs)
    size = np.abs(outputs[:locals_]).sum(axis=1)
    reach = np.max(np.abs(c.C[:locals_]) / np.maximum(size, 1e-30)[:, None], axis=0, initial=0.0)
    state = np.concatenate([packed(w), memory.ravel()])
    beside = np.concatenate([
        packed((1 + 1j) * LIMITS.stability_beside / np.maximum(reach, 1e-30)),
        (
            LIMITS.stability_beside * np.maximum(np.abs(memory), 1e-3 * np.abs(memory).max(axis=1, keepdims=True))
        ).ravel(),
    ])  # fmt: skip
    moves = np.flatnonzero(beside > 0.0)
    step = c.packed(locals_, rows - locals_, rows=rows)
    J = _differentiated(step, elements, state, beside, moves, path[:locals_, -1].copy(), drive)
    multipliers = np.linalg.eigvals(J)
    return np.asarray(multipliers[np.argsort(-np.abs(multipliers))])


def _pole_states(poles: Poles, inputs: Complex, omega: float) -> Complex:
    """The poles' states at the phase zero of periodic inputs."""
    y = 1j * omega * np.arange(inputs.shape[1])
    forward, backward = poles.B @ inputs, poles.B @ inputs.conj()
    lam = poles.pole[:, None]
    return np.asarray(0.5 * np.sum(forward / (y - lam) + backward / (-y - lam), axis=1))


@COMPILED
def _settle(step_s: float, periods: int, path: Matrix, elements: Elements) -> None:
    """Lead the memories along the periodic path until they are periodic too."""
    kind, coordinate, auxiliary, _, parameters, memory = elements
    for _ in range(periods):
        for t in range(path.shape[1]):
            for e in range(kind.shape[0]):
                displacement = path[auxiliary[e], t] if auxiliary[e] >= 0 else 0.0
                remember(kind[e], parameters, memory, e, path[coordinate[e], t], displacement, step_s)


@COMPILED
def _differentiated(
    step: Step, elements: Elements, start: Matrix, beside: Matrix, moves: NDArray[np.int64], guess: Matrix,
    drive: Matrix,
) -> Matrix:  # fmt: skip
    """Differences of the map over one period, (moves, moves)."""
    m = step.decay.shape[0]
    J = np.empty((moves.shape[0], moves.shape[0]))
    end = np.empty(start.shape[0])
    u, out = np.zeros(1 + step.locals_), np.empty((drive.shape[0], 0))
    for column in range(-1, moves.shape[0]):
        state = start.copy()
        if column >= 0:
            state[moves[column]] += beside[moves[column]]
        memory = state[m:].reshape(elements.state.shape)
        moved = Elements(
            elements.kind, elements.coordinate, elements.auxiliary, elements.scale, elements.parameters, memory
        )
        integrate(step, moved, state[:m], guess.copy(), u, drive, out)
        if column < 0:
            end[:] = state
        else:
            for row in range(moves.shape[0]):
                J[row, column] = (state[moves[row]] - end[moves[row]]) / beside[moves[column]]
    return J
