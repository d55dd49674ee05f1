"""A converter whose clock is not the generator's: within each step all channels turn by the same phase."""

from collections.abc import Sequence

import numpy as np

from recordings.run import Run
from twin.diagnose.signals.clock import with_clock
from twin.diagnose.signals.finding import Finding
from twin.diagnose.signals.limits import LIMITS
from twin.identify.spectra.sine_fit import SteadyState, steady_states

LEAST_STEPS = 8


def find_sample_clock(runs: Sequence[Run]) -> list[Finding]:
    """One finding if the runs' sines are all higher or lower than commanded by one part.

    A generator that shares the converter's clock shows no turn; what such a clock does to the frequencies is a cause
    with a forward model, :mod:`twin.causes.sample_clock.model`.
    """
    error, std = _error(runs)
    if abs(error) < LIMITS.sample_clock_least_ppm or abs(error) < LIMITS.sample_clock_least_sigma * std:
        return []
    for _ in range(2):  # a turn is a drift only while small: each round takes the last error off
        more, std = _error([with_clock(run, error_ppm=error) for run in runs])
        error += more
    return [
        Finding(
            cause="sample-clock",
            summary=f"the converter's clock is off by {error:.0f} ppm beside the generator's: all channels turn alike",
            values={"error_ppm": error},
            std={"error_ppm": float(np.hypot(std, LIMITS.sample_clock_own_error_ppm))},
        )
    ]


def _error(runs: Sequence[Run]) -> tuple[float, float]:
    """Median over all steps and its standard deviation, in parts per million; nothing where steps are few."""
    errors = np.array([_of_step(state) for run in runs for state in steady_states(run)])
    if len(errors) < LEAST_STEPS:
        return 0.0, np.inf
    middle = float(np.median(errors))
    spread = 1.4826 * float(np.median(np.abs(errors - middle)))
    return middle, 1.2533 * spread / np.sqrt(len(errors))


def _of_step(state: SteadyState) -> float:
    """A clock that is fast by a part e sees the sine low by e: its phase falls behind by e omega T."""
    turn = float(np.median([drift.imag for drift in state.drift.values()]))
    return -1e6 * turn / (state.omega * state.duration_s)
