"""The frequencies of a sweep: fixed grids, and one that refines itself where the response changes fast."""

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from twin.procedures.kinds import Impact, Multisine, Procedure, Random, RingDown, SteppedSine, SweptSine
from twin.procedures.tables import Grid, ways


def fixed_frequencies(procedure: SteppedSine) -> list[float]:
    """The frequencies of a procedure, rising, in Hz; of an adaptive grid, those it would take at its widest step."""
    grid = procedure.grid
    if grid is None:
        return list(procedure.frequencies)
    if grid.kind == "logarithmic":
        assert grid.count is not None
        return [float(f) for f in np.geomspace(grid.start, grid.stop, grid.count)]
    assert grid.step is not None
    count = math.floor((grid.stop - grid.start) / grid.step + 1e-6) + 1
    # ten decimals: 25.3 + 3 * 0.05 should read 25.45 in a file, not 25.450000000000003
    frequencies = [round(grid.start + i * grid.step, 10) for i in range(count)]
    if grid.kind == "adaptive" and frequencies[-1] < grid.stop:
        frequencies.append(grid.stop)
    return frequencies


def planned_steps(procedure: Procedure) -> int:
    """How many steps a procedure will measure; an adaptive grid may take more."""
    if isinstance(procedure, (Random, Multisine)):
        return 1
    if isinstance(procedure, Impact):
        return procedure.hits * len(procedure.places)
    sweeps = len(ways(procedure.direction))
    if isinstance(procedure, SweptSine):
        return sweeps * len(procedure.voltages)
    frequencies = len(fixed_frequencies(procedure)) if isinstance(procedure, SteppedSine) else 1
    decays = 2 if isinstance(procedure, RingDown) else 1
    return sweeps * decays * len(procedure.amplitudes) * frequencies


def step_frequencies(
    procedure: SteppedSine, *, upwards: bool, responses: Callable[[], Sequence[tuple[float, complex]]]
) -> Iterator[float]:
    """The frequencies of one sweep in the order they are taken.

    Parameters
    ----------
    responses
        Returns frequency (Hz) and complex response of the steps measured so far in this sweep; an adaptive grid
        looks at the last two before it chooses the next frequency.
    """
    if procedure.grid is not None and procedure.grid.kind == "adaptive":
        yield from _adaptive(procedure.grid, upwards, responses)
        return
    frequencies = fixed_frequencies(procedure)
    yield from frequencies if upwards else reversed(frequencies)


def _adaptive(grid: Grid, upwards: bool, responses: Callable[[], Sequence[tuple[float, complex]]]) -> Iterator[float]:
    """Choose each step so that the response changes by about `grid.change` of its size, extrapolating the last change.

    A step may grow at most by half, so that a resonance met after a flat stretch is not stepped over.
    """
    assert grid.step is not None
    assert grid.smallest is not None
    first, last = (grid.start, grid.stop) if upwards else (grid.stop, grid.start)
    sign = 1.0 if upwards else -1.0
    frequency, step = first, min(grid.step, 4 * grid.smallest)
    yield frequency
    while sign * (last - frequency) > 1e-9 * last:
        step = _next_step(grid, step, responses())
        remaining = sign * (last - frequency)
        # a sliver at the end would be a step of its own: take it along
        frequency = last if remaining < 1.25 * step else round(frequency + sign * step, 10)
        yield frequency


def _next_step(grid: Grid, step: float, measured: Sequence[tuple[float, complex]]) -> float:
    assert grid.step is not None
    assert grid.smallest is not None
    if len(measured) < 2:
        return step
    (f0, r0), (f1, r1) = measured[-2:]
    size = max(abs(r0), abs(r1), 1e-300)
    per_hertz = abs(r1 - r0) / size / max(abs(f1 - f0), 1e-12)
    # a resonance ahead steepens the change: aim at 70 % of what is allowed
    wanted = 0.7 * grid.change / per_hertz if per_hertz > 0 else math.inf
    return float(min(max(min(wanted, 1.5 * step), grid.smallest), grid.step))
