"""The works of ``twin speed --scaling``, each at a few sizes beside its peer."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.balance_by_hand import BalanceByHand
from benchmarks.equivalent_linear import softening_sweep, woodbury
from benchmarks.march_by_hand import march_jenkins, march_saturating
from benchmarks.measured import timed_in_turns
from benchmarks.rig_of_places import RigOfPlaces, rig_of_sliders
from benchmarks.scaling import Cost, Scaling
from benchmarks.sparse_structure import long_rig, ready, structure_by_hand
from twin.bench.marching import coefficients, integrate
from twin.joint import Saturating
from twin.response import HarmonicBalance

Array = NDArray[np.float64]

RATE_Hz, FREQUENCY_Hz, FORCE_N = 25600.0, 28.0, 3.0
SOFTENING = Saturating(1e4, 2e-5)
FREQUENCIES_Hz = np.linspace(29.0, 33.0, 9)
"""Through the resonance of the rig of sliders, about which all of them slip."""
HARMONICS, SAMPLES = 5, 128


def _drive(count: int) -> Array:
    return FORCE_N * np.sin(2 * np.pi * FREQUENCY_Hz * np.arange(count) / RATE_Hz)


def march(rig: RigOfPlaces, drive: Array) -> Callable[[], Array]:
    """Our march of a rig from rest, and what it shows."""
    c = coefficients(rig.poles(0.0, 0.0), 1.0 / RATE_Hz)
    step, elements, out = c.packed(rig.places, 0), rig.elements(), np.empty((len(drive), 1))

    def work() -> Array:
        at_rest = elements._replace(state=np.zeros_like(elements.state))
        start = np.zeros_like(step.decay), np.zeros(rig.places), np.zeros(1 + rig.places)
        assert integrate(step, at_rest, *start, drive, out) == 0
        return out[:, 0]

    return work


def march_over_poles() -> Scaling:
    """One softening place, more and more modes."""
    drive, costs = _drive(25600), []
    for modes in (5, 11, 32, 64):
        rig = RigOfPlaces(1, modes, SOFTENING)
        c = coefficients(rig.poles(0.0, 0.0), 1.0 / RATE_Hz)
        costs.append(_cost(modes, march(rig, drive), partial(march_saturating, c, 1e4, 2e-5, drive), len(drive)))
    return Scaling(
        sized="poles, one law", per="step", against="the scheme written by hand in numba for this law alone",
        limit="11 poles: 0.75 of the speed by hand", held=lambda costs: costs[1].other_s / costs[1].ours_s >= 0.75,
        costs=costs,
    )  # fmt: skip


def march_over_sliders() -> Scaling:
    """Jenkins elements at their own places; 11 modes."""
    drive, costs = _drive(2560), []
    for places in (3, 10, 30, 100):
        rig = rig_of_sliders(places)
        c, (k, slip) = coefficients(rig.poles(0.0, 0.0), 1.0 / RATE_Hz), rig.law.parameters[1:3]
        by_hand = partial(march_jenkins, c, k, slip, drive)
        costs.append(_cost(places, march(rig, drive), by_hand, len(drive), tries=3))
    return Scaling(
        sized="sliders at own places", per="step", against="by hand in numba, LAPACK at each change of state",
        limit="100 sliders in real time at 25.6 kHz", held=lambda costs: costs[-1].ours_s < 1 / RATE_Hz, costs=costs,
    )  # fmt: skip


def balance_over_places() -> Scaling:
    """A sweep through the resonance of a rig of sliders."""
    costs = []
    for places in (1, 10, 30, 60):
        rig = rig_of_sliders(places)
        ours = HarmonicBalance(rig.built, harmonics=HARMONICS, samples=SAMPLES)
        other = BalanceByHand(rig, HARMONICS, SAMPLES)

        by_hand = partial(other.sweep, FREQUENCIES_Hz, FORCE_N)
        costs.append(_cost(places, partial(_swept, ours), by_hand, len(FREQUENCIES_Hz), tries=3))
    return Scaling(
        sized="places with a slider", per="steady state", against="numpy and LAPACK, all places at once",
        limit="faster at every size", held=lambda costs: all(cost.ours_s < cost.other_s for cost in costs), costs=costs,
    )  # fmt: skip


def _swept(balance: HarmonicBalance) -> NDArray[np.complex128]:
    return np.array([state.channels[0, 1] for state in balance.sweep(list(FREQUENCIES_Hz), FORCE_N)])


def stability_over_places() -> Scaling:
    """Floquet multipliers of a steady state beside the finding of it; the error is that of a multiplier's size."""
    costs = []
    for places in (1, 10, 30):
        rig = rig_of_sliders(places)
        ours = HarmonicBalance(rig.built, harmonics=HARMONICS, samples=SAMPLES)
        near, at = ours.sweep([30.0, 30.5], FORCE_N)
        first = ours.multipliers(at)
        finer = ours.multipliers(at, rate_Hz=4 * 11264.0)
        mine, point = timed_in_turns(
            partial(ours.multipliers, at),
            partial(ours.solve, 30.5, FORCE_N, start=near),
            tries=3,
        )
        costs.append(Cost(places, mine, point, abs(abs(first[0]) - abs(finer[0]))))
    return Scaling(
        sized="places with a slider", per="steady state", against="the steady state itself", limit="twice the point",
        held=lambda costs: all(cost.ours_s <= 2 * cost.other_s for cost in costs), costs=costs,
    )  # fmt: skip


def equivalent_linear_over_steps() -> Scaling:
    """A sweep whose layer is softer at every step."""
    costs = []
    for steps in (100, 400, 1600):
        sweep = softening_sweep(steps)
        costs.append(_cost(steps, sweep.receptance, partial(woodbury, sweep), steps))
    return Scaling(
        sized="steps of the sweep", per="step", against="Woodbury in numpy on the needed ports", limit="6 times",
        held=lambda costs: all(cost.other_s >= 6 * cost.ours_s for cost in costs), costs=costs,
    )  # fmt: skip


def structure_over_elements() -> Scaling:
    """The lap joint on a finer and finer mesh: assembled, reduced, and ready to march."""
    costs = []
    for elements in (200, 400, 800, 1600):
        rig, layout = long_rig(elements)
        costs.append(
            _cost(3 * (elements + 1), partial(ready, rig, layout), partial(structure_by_hand, rig, layout), 1, tries=3)
        )
    return Scaling(
        sized="degrees of freedom", per="rig", against="sparse by hand: assembly, factors, 30 modes by Lanczos",
        limit="2400 in 0.3 s", held=lambda costs: costs[2].ours_s <= 0.3, costs=costs,
    )  # fmt: skip


def _cost(
    size: int, ours: Callable[[], NDArray[Any]], other: Callable[[], NDArray[Any]], units: int, *, tries: int = 7
) -> Cost:
    """Seconds a unit of both, and the largest difference of their answers over the largest answer."""
    mine, theirs = timed_in_turns(ours, other, tries=tries)
    found, expected = ours(), other()
    return Cost(size, mine / units, theirs / units, float(np.max(np.abs(found - expected)) / np.max(np.abs(expected))))


WORKS: dict[str, Callable[[], Scaling]] = {
    "march-poles": march_over_poles,
    "march-sliders": march_over_sliders,
    "harmonic-balance": balance_over_places,
    "stability": stability_over_places,
    "equivalent-linear": equivalent_linear_over_steps,
    "structure": structure_over_elements,
}
"""In the order they are measured."""
