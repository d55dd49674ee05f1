"""How large a hidden effect is to be: by what it does to the response near resonance, with it and without."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.second_bench.effects import Effect, Rig
from tests.second_bench.mechanics.bench import Bench
from tests.second_bench.mechanics.specimen import Specimen

CHANGES = (0.02, 0.1)
"""Of the response at resonance, relative, that effects of normal size make; drawn in between."""
FORCE_N, RATE_Hz = 4.5, 6144
OFFSETS_Hz = (-0.3, -0.05)
"""Where it is compared: below the resonance at small amplitude, and about where that lies under load."""
SETTLING_s, COMPARED_s = 8, 1
LATE_s = 200.0
"""Recorded time, about in the middle of a campaign: what drifts has drifted so far."""
STEPS = 4
AT_ONCE = 5.0
"""Largest factor from one size to the next of a search."""


def sized(effect: Effect, rig: Rig, rng: np.random.Generator, strength: float) -> float:
    """Size of an effect in a rig, of normal size times the strength."""
    if not effect.sought:
        return effect.usual * strength
    wanted = float(np.exp(rng.uniform(*np.log(CHANGES))))
    sound, size = near_resonance(rig.specimen), effect.usual
    for _ in range(STEPS):
        changed = near_resonance(effect.apply(rig, size)[0].specimen)
        change = np.linalg.norm(changed - sound) / np.linalg.norm(sound)
        size *= float(np.clip(wanted / max(change, 1e-12), 1 / AT_ONCE, AT_ONCE))
    return size * strength


def near_resonance(specimen: Specimen) -> NDArray[np.float64]:
    """Accelerations about mode 1 when they have settled, m/s2, sensors and frequencies one after the other."""
    responses = []
    for offset in OFFSETS_Hz:
        bench = Bench(specimen, clock_s=LATE_s)
        frequency = bench.modes.omega[0] / (2 * np.pi) + offset
        phase = 2 * np.pi * frequency / RATE_Hz * np.arange(1, (SETTLING_s + COMPARED_s) * RATE_Hz + 1)
        bench.run(FORCE_N * np.sin(phase[: SETTLING_s * RATE_Hz]), RATE_Hz, recorded=False)
        responses.append(bench.run(FORCE_N * np.sin(phase[SETTLING_s * RATE_Hz :]), RATE_Hz, recorded=False))
    return np.concatenate(responses, axis=None)
