"""The responses that a force-controlled sweep has to choose from: all branches, stable or not, by continuation."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from twin.bench import BenchSetup, open_bench
from twin.identify.spectra.resonances import by_resonance
from twin.procedures import SteppedSine
from twin.procedures.grid import fixed_frequencies
from twin.response import HarmonicBalance
from twin.rigs import Rig


@dataclass(frozen=True, kw_only=True)
class PredictedBranch:
    """One force's curve from the first frequency to the last, through whatever folds it has.

    `response` holds complex amplitudes by channel, relative to the phase of the force; `folds_Hz` are the frequencies
    where the curve turns back: a sweep jumps there.  `stable` tells where the rig can stay.  `ends_early` says why the
    curve stops before the last frequency; it is empty where it does not.
    """

    force_N: float
    frequency_Hz: list[float]
    response: dict[str, list[complex]]
    folds_Hz: list[float]
    stable: list[bool]
    ends_early: str = ""


def predicted_branches(rig: Rig, *, preload: str | None, procedure: SteppedSine) -> list[PredictedBranch]:
    """One curve for each amplitude of a force-controlled stepped sine, by harmonic balance without shaker or noise.

    About several resonances each amplitude has a curve of its own about each.
    """
    frequencies = fixed_frequencies(procedure)
    if procedure.control != "force" or procedure.order != "frequency" or len(frequencies) < 2:
        return []
    free = open_bench(rig, preload=preload, setup=BenchSetup(drive="force"))
    balance = HarmonicBalance(free.built)
    names = [channel.name for channel in free.channels]
    force = next(channel.name for channel in free.channels if channel.quantity == "force")
    found = []
    groups = [[frequencies[i] for i in group] for group in by_resonance(np.array(frequencies))]
    for about, amplitude in product([group for group in groups if len(group) > 1], procedure.amplitudes):
        points = balance.branch(about[0], about[-1], amplitude)
        first = np.array([point.channels[:, 1] for point in points]).reshape(-1, len(names))
        turned = first * np.exp(-1j * np.angle(first[:, [names.index(force)]]))
        frequency_Hz = [point.frequency_Hz for point in points]
        told = {name: list(map(complex, turned[:, i])) for i, name in enumerate(names)}
        found.append(
            PredictedBranch(
                force_N=amplitude,
                frequency_Hz=frequency_Hz,
                response=told if len(points) else {},
                folds_Hz=[place for place, _ in turning_points(frequency_Hz)],
                stable=[balance.stable(point) for point in points],
                ends_early="" if points.failure is None else str(points.failure),
            )
        )
    return found


def turning_points(frequency_Hz: Sequence[float]) -> list[tuple[float, bool]]:
    """Where the frequency along a curve changes its direction, and whether it rose until then."""
    ways = np.sign(np.diff(frequency_Hz))
    turns = np.flatnonzero(ways[1:] * ways[:-1] < 0).tolist()
    return [(float(frequency_Hz[i + 1]), bool(ways[i] > 0)) for i in turns]
