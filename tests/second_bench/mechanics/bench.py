"""A specimen under test: it is driven, it warms and loosens, and from test to test its resonances wander."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.second_bench.mechanics.march import at_rest, march
from tests.second_bench.mechanics.specimen import Specimen
from tests.second_bench.mechanics.structure import modes_of

Array = NDArray[np.float64]


class Bench:
    """Drives a specimen block by block.

    Drifts go by the time that is recorded, which is all that a recording can tell of time.

    Parameters
    ----------
    specimen
        As it is.
    clock_s
        Recorded time before, that drifts count from.
    wander
        Of all moduli, relative: what a room does to a structure between two tests.
    """

    def __init__(self, specimen: Specimen, *, clock_s: float = 0.0, wander: float = 0.0) -> None:
        self.specimen, self.clock_s, self.wander = specimen, clock_s, wander
        self.modes = modes_of(specimen)
        self._state = at_rest(self.modes)

    def run(self, force: Array, rate_Hz: float, *, recorded: bool = True) -> Array:
        """Accelerations of the sensors under a force, m/s2, (s, t); see :func:`march`."""
        middle_s = self.clock_s + (len(force) / rate_Hz / 2 if recorded else 0.0)
        if recorded:
            self.clock_s += len(force) / rate_Hz
        return march(
            self.modes, self._state, force, rate_Hz,
            layer=1 - self.specimen.preload_rate * middle_s,
            all_moduli=(1 + self.wander) * (1 - self.specimen.moduli_rate * middle_s),
        )  # fmt: skip
