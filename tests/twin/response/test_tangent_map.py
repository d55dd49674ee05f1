"""The linearised map of a period against marches from states a little beside the steady one."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.rig_of_places import RigOfPlaces, rig_of_sliders
from twin.bench import BenchSetup, JointLaw, open_bench
from twin.bench.marching import coefficients, integrate, packed
from twin.joint import Cubic, jenkins, one_sided
from twin.response import HarmonicBalance
from twin.rigs import load_rig

STEPS = 400


def marched_multipliers(built, solution, poles):
    """Of the march's own map, differentiated by central differences about its own steady state."""
    c = coefficients(poles, 1.0 / (solution.frequency_Hz * STEPS))
    step = c.packed(built.locals, built.auxiliaries, rows=built.locals + built.auxiliaries)
    drive = solution.amplitude * np.sin(2 * np.pi * np.arange(1, STEPS + 1) / STEPS)
    out = np.empty((STEPS, 0))
    elements = built.elements()
    w, memory, y, u = (
        np.zeros_like(step.decay),
        elements.state.copy(),
        np.zeros(built.locals),
        np.zeros(1 + built.locals),
    )
    for _ in range(1500):
        integrate(step, elements._replace(state=memory), w, y, u, drive, out)
    start = np.concatenate([w, memory.ravel()])
    size = np.concatenate(
        [1e-5 * np.abs(packed(np.full(len(c.decay), np.abs(w).max() * (1 + 1j)))), 1e-5 * memory.ravel()]
    )
    moves = np.flatnonzero(size)

    def after(state):
        state = state.copy()
        own = state[len(w) :].reshape(memory.shape)
        integrate(step, elements._replace(state=own), state[: len(w)], y.copy(), u.copy(), drive, out)
        return state

    J = np.empty((len(moves), len(moves)))
    for column, move in enumerate(moves):
        beside = np.zeros_like(start)
        beside[move] = size[move]
        J[:, column] = (after(start + beside) - after(start - beside))[moves] / (2 * size[move])
    return np.sort(np.abs(np.linalg.eigvals(J)))[::-1]


RIGS = {
    "a cubic spring": RigOfPlaces(1, 6, Cubic(2e12)),
    "gaps at three places": RigOfPlaces(3, 6, one_sided(2e4, 1e-5)),
    "a slider": rig_of_sliders(1, modes=6),
    "six sliders": rig_of_sliders(6, modes=6),
}


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS)
def test_multipliers_are_those_of_the_march(rig):
    balance = HarmonicBalance(rig.built, harmonics=15, samples=STEPS)
    solution = balance.solve(31.0, 3.0)
    found = np.abs(balance.multipliers(solution, rate_Hz=STEPS * 31.0))
    expected = marched_multipliers(rig, solution, rig.poles(0.0, 0.0))
    np.testing.assert_allclose(found[:6], expected[:6], atol=4e-3)


@pytest.mark.parametrize("law", [{}, {"joint_law": JointLaw(jenkins(1e8, 60.0))}], ids=["running loss", "sliders"])
def test_multipliers_of_the_steel_rig_are_those_of_the_march(law):
    """With what its shaker's laws of two coordinates do."""
    built = open_bench(load_rig("steel-lap-joint"), **law, setup=BenchSetup(noise=False, converter=False)).built
    balance = HarmonicBalance(built)
    solution = balance.solve(26.2, 1.0)
    found = np.abs(balance.multipliers(solution, rate_Hz=STEPS * 26.2))
    expected = marched_multipliers(built, solution, built.poles(0.0, 51200.0))
    # A slider that never slips keeps its force for ever; whether it has one is the way's to the steady state.
    moving, marched = (values[values < 1.0 - 1e-4][:3] for values in (found, expected))
    np.testing.assert_allclose(moving, marched, atol=2e-3)
