"""How far all natural frequencies of a broadband run or of a sweep lie off, as a room's temperature has it."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.measured_data import MeasuredData
from twin.identify.spectra.broadband import BinnedResponse

SHIFT = 6e-5
"""Standard deviation of what all natural frequencies of one run or sweep are off by, relative: half a kelvin between
them, and a steel whose modulus falls by 2.4e-4 per kelvin."""


def unshifted(evidence: MeasuredData) -> Array:
    """Shifts (k,) of each broadband run and sweep to begin with; none of one alone, which no other differs from."""
    count = len(evidence.broadband) + len(evidence.steps.by_sweep)
    return np.zeros(count if count > 1 else 0)


def swept_modes(evidence: MeasuredData, count: int) -> NDArray[np.int64]:
    """Number (k,) of the mode that each sweep is about, as :func:`unshifted` has them; -1 of a broadband run.

    And of all, where so many shifts are those of other recordings.
    """
    if count != len(unshifted(evidence)) or not count:
        return np.full(count, -1)
    omega_r = evidence.model.basis.omega
    omega_r = omega_r[omega_r > 0]
    sweeps = [np.median(evidence.steps.omega[rows]) for rows in evidence.steps.by_sweep.values()]
    about = [int(np.argmin(np.abs(np.log(omega / omega_r)))) for omega in sweeps]
    return np.array([-1] * len(evidence.broadband) + about, np.int64)


def own_shifts(evidence: MeasuredData, shifts: Array) -> bool:
    """Whether shifts (k,) are those of these recordings: others feel nothing of them."""
    return len(shifts) > 0 and len(shifts) == len(unshifted(evidence))


def shifted_sweeps(evidence: MeasuredData, shifts: Array) -> Iterator[tuple[int, list[int]]]:
    """Place in the shifts of each sweep's, and the sweep's rows among the steps; none of other recordings."""
    if own_shifts(evidence, shifts):
        yield from enumerate(evidence.steps.by_sweep.values(), len(evidence.broadband))


def shift_of_run(evidence: MeasuredData, data: BinnedResponse, shifts: Array) -> float:
    """Relative shift of one broadband run."""
    number = next((k for k, own in enumerate(evidence.broadband) if own is data), None)
    return SHIFT * float(shifts[number]) if number is not None and own_shifts(evidence, shifts) else 0.0


def shift_of_steps(evidence: MeasuredData, shifts: Array) -> Array:
    """Relative shifts (s,) of the steps."""
    found = np.zeros(len(evidence.steps))
    for number, rows in shifted_sweeps(evidence, shifts):
        found[rows] = SHIFT * shifts[number]
    return found
