"""Which steps make a sweep."""

from collections.abc import Sequence

import numpy as np

from twin.arrays import Array
from twin.identify.spectra.sine_fit import SteadyState


def rows_by_sweep(states: Sequence[SteadyState]) -> dict[str, Array]:
    """Rows of each sweep, in their order; its name with the run's where two runs have the same."""
    keys = [(state.run, state.sweep) for state in states]
    plain = [sweep for _, sweep in dict.fromkeys(keys)]
    label = {key: key[1] if plain.count(key[1]) == 1 else f"{key[0]}: {key[1]}" for key in keys}
    return {label[key]: np.flatnonzero([k == key for k in keys]) for key in dict.fromkeys(keys)}
