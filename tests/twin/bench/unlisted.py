"""Physics that no listed cause explains, for tests of the answer ``unknown``.  Not part of the package."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from twin.bench import EFFECTS, Bench, BenchSetup, open_bench
from twin.bench.plan import Element, Matrices, Plan
from twin.joint import ForceTable, PiecewiseLinearContact, Polynomial
from twin.rigs import Effect, Rig


def quintic_spring(plan: Plan, strength: float = 1.0) -> None:
    """A spring to ground at the tip, f = k v^5: 60 N/m more at 3 mm."""
    law = Polynomial((0.0, 0.0, 0.0, 0.0, strength * 60.0 / 3e-3**4))
    plan.element_makers.append(lambda m: [Element(m.row(plan.place(position_m=plan.rig.length)), law)])


def quadratic_spring(plan: Plan, strength: float = 1.0) -> None:
    """A smooth spring that pushes one way, f = k v^2, at the tip."""
    law = ForceTable.of(lambda v: strength * 3e4 * v**2, limit_m=0.02)
    plan.element_makers.append(lambda m: [Element(m.row(plan.place(position_m=plan.rig.length)), law)])


def backlash_pendulum(plan: Plan, strength: float = 1.0) -> None:
    """A mass on a soft hanger that rattles between two stops fixed to the upper beam."""

    def hang(matrices: Matrices) -> None:
        matrices.append_resonator(plan.place(position_m=0.35), 0.006 * strength, 8.0, 0.05)

    def stops(matrices: Matrices) -> list[Element]:
        row = matrices.row(plan.place(position_m=0.35))
        row[-1] = -1.0
        return [Element(row, PiecewiseLinearContact((2e3, 2e3), (4e-4, -4e-4), (1, -1)))]

    plan.matrix_changes.append(hang)
    plan.element_makers.append(stops)


def fractional_damper(plan: Plan, strength: float = 1.0) -> None:
    """A damper to ground of order one half at the tip: Maxwell elements spread over the logarithm of frequency."""

    def chain(matrices: Matrices) -> None:
        for frequency_Hz in np.geomspace(1.0, 2000.0, 12):
            w = 2 * np.pi * frequency_Hz
            stiffness = strength * 1.5 * np.sqrt(w)
            matrices.append_resonator(
                plan.place(position_m=plan.rig.length), 1e-7, np.sqrt(stiffness / 1e-7) / (2 * np.pi), 0.0
            )
            matrices.C[-1, -1] += stiffness / w

    plan.matrix_changes.append(chain)


UNLISTED: dict[str, Callable[..., None]] = {
    "quintic-spring": quintic_spring,
    "quadratic-spring": quadratic_spring,
    "backlash-pendulum": backlash_pendulum,
    "fractional-damper": fractional_damper,
}


@contextmanager
def acting(name: str, *, strength: float = 1.0) -> Iterator[Effect]:
    """One of :data:`UNLISTED` as an effect that benches opened meanwhile know."""
    EFFECTS[name] = lambda plan: UNLISTED[name](plan, strength)
    try:
        yield Effect(cause=name, parameters={})
    finally:
        del EFFECTS[name]


def open_unlisted(rig: Rig, name: str, *, setup: BenchSetup, strength: float = 1.0) -> Bench:
    """A bench with one of :data:`UNLISTED`."""
    with acting(name, strength=strength) as effect:
        return open_bench(rig, effects=[effect], setup=setup)
