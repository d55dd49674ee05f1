"""The tests of a campaign: noise, and sweeps about a mode, one of which is held out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Random force in a band.

    `stored_Hz` is how finely it is recorded, `march_Hz` how finely it is marched: so that every mode that can be told
    from the band is followed.
    """

    band_Hz: tuple[float, float] = (5.0, 1000.0)
    rms: float = 0.5
    seconds: int = 60
    march_Hz: int = 40960
    stored_Hz: int = 5120


@dataclass(frozen=True, kw_only=True)
class Sweeps:
    """Stepped sines of held force, upwards.

    Attributes
    ----------
    frequencies_Hz, forces_N
        Steps of each sweep, and one sweep for each peak force.
    name
        Comes before the sweeps' own names.
    march_Hz, stored_Hz
        How finely it is marched and recorded.
    block_s
        What is marched at once, and compared with the block before to see whether the response has settled.
    measured_s
        Of each step.
    """

    frequencies_Hz: tuple[float, ...]
    forces_N: tuple[float, ...]
    name: str = ""
    march_Hz: int
    stored_Hz: int
    block_s: float
    measured_s: float

    def sweep(self, force_N: float) -> str:
        """Name of a sweep."""
        return f"{self.name}{force_N:g}N-up"


AROUND_1_Hz = (*np.arange(-1.05, -0.44, 0.1), *np.arange(-0.36, 0.23, 0.03), *np.arange(0.3, 0.86, 0.11))
"""Steps about mode 1's resonance at small amplitude, close together where it moves to under load."""
AROUND_2_Hz = (*np.arange(-5.0, -1.9, 1.0), *np.arange(-1.6, 1.21, 0.16), *np.arange(1.6, 4.7, 1.0))


def sweeps_of(mode: int, resonance_Hz: float) -> tuple[Sweeps, Sweeps]:
    """The sweeps about a mode that are diagnosed, and the one at another force that is held out."""
    around, forces, other, march_Hz, stored_Hz, block_s = {
        1: (AROUND_1_Hz, (1.5, 3.0, 6.0), 4.5, 6144, 1024, 0.5),
        2: (AROUND_2_Hz, (0.5, 1.0, 2.0), 1.5, 16384, 2048, 0.25),
    }[mode]
    frequencies = tuple(round(resonance_Hz + float(offset), 2) for offset in around)
    name = "" if mode == 1 else f"mode{mode}-"
    learnt, held_out = (
        Sweeps(
            frequencies_Hz=frequencies, forces_N=levels, name=name, march_Hz=march_Hz, stored_Hz=stored_Hz,
            block_s=block_s, measured_s=2.0 if mode == 1 else 1.0,
        )
        for levels in (forces, (other,))
    )  # fmt: skip
    return learnt, held_out
