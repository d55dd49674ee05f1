"""A finer grid where a resonance or a fold lies, and as coarse as before elsewhere."""

import bisect
import math
from collections.abc import Sequence

from twin.identify.spectra.resonances import same_resonance
from twin.procedures import SteppedSine, StepResult
from twin.procedures.grid import fixed_frequencies
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.rehearsal import Rehearsal

SMALLEST_CHANGE = 0.1


def finer_grid(rehearsal: Rehearsal, places_Hz: Sequence[tuple[float, float]]) -> dict[str, object]:
    """The change of a stepped sine's grid that resolves what lies in some intervals of frequency.

    Fixed frequencies stay and get more between them; an adaptive grid is made to look more closely.  About several
    resonances an adaptive grid would do so between them too: there its widest steps stay, with more about each peak.
    """
    procedure = rehearsal.procedure
    assert isinstance(procedure, SteppedSine)
    frequencies = fixed_frequencies(procedure)
    added: set[float] = set()
    if procedure.grid is not None and procedure.grid.kind == "adaptive":
        if all(len(rehearsal.bands(steps)) == 1 for steps in rehearsal.sweeps().values()):
            return {"grid": _more_careful(rehearsal, procedure, places_Hz)}
        peaks_Hz = {summary.peak_frequency_Hz for summary in rehearsal.summaries()}
        places_Hz = [*places_Hz, *((peak, peak) for peak in sorted(peaks_Hz))]
    for low_Hz, high_Hz in places_Hz:
        added |= _around(rehearsal, frequencies, low_Hz, high_Hz)
    return {"grid": None, "frequencies": sorted({*frequencies, *added})}


def resonance_between(rehearsal: Rehearsal, steps: Sequence[StepResult], index: int) -> float:
    """Frequency, Hz, between step `index` and the next where the real part of force over displacement vanishes.

    Of one degree of freedom that part is linear in the square of the frequency.
    """
    between = slice(index, index + 2)
    frequency_Hz = [step.frequency_Hz for step in steps[between]]
    w2 = [f**2 for f in frequency_Hz]
    stiffness = [(1 / one).real if one else math.inf for one in rehearsal.receptances(steps)[between]]
    if not all(map(math.isfinite, stiffness)) or stiffness[0] == stiffness[1]:
        return 0.5 * sum(frequency_Hz)
    at = w2[0] + (w2[1] - w2[0]) * stiffness[0] / (stiffness[0] - stiffness[1])
    return math.sqrt(min(max(at, min(w2)), max(w2)))


def _around(rehearsal: Rehearsal, frequencies: Sequence[float], low_Hz: float, high_Hz: float) -> set[float]:
    """Round frequencies about an interval, wider apart the farther out, up to the next known ones.

    Where those belong to another resonance, the gap between the two is left alone.
    """
    half_Hz = rehearsal.half_width_Hz(0.5 * (low_Hz + high_Hz))
    first, last = low_Hz - LIMITS.refine_reach * half_Hz, high_Hz + LIMITS.refine_reach * half_Hz
    below = bisect.bisect_left(frequencies, first) - 1
    above = bisect.bisect_right(frequencies, last)
    bottom, top = frequencies[max(below, 0)], frequencies[min(above, len(frequencies) - 1)]
    bottom = bottom if same_resonance(bottom, first) else first
    top = top if same_resonance(top, last) else last
    added: set[float] = set()
    for sign, begin, end in ((1.0, low_Hz, top), (-1.0, high_Hz, bottom)):
        frequency = begin
        while sign * (end - frequency) > 0:
            beyond = max(frequency - last, first - frequency, 0.0)
            step = _round_step(max(LIMITS.refine_finest * half_Hz, LIMITS.refine_widening * beyond))
            # multiples of the step: what two sweeps ask for falls together
            multiple = math.floor(frequency / step + 1e-6) + 1 if sign > 0 else math.ceil(frequency / step - 1e-6) - 1
            frequency = round(multiple * step, 10)
            if _is_new(frequencies, frequency, 0.5 * step) and sign * (end - frequency) > 0:
                added.add(frequency)
    return added


def _round_step(wanted: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above."""
    power = 10.0 ** math.floor(math.log10(wanted) + 1e-9)
    return next(factor * power for factor in (5, 2, 1) if factor * power <= wanted * (1 + 1e-9))


def _is_new(frequencies: Sequence[float], frequency: float, apart: float) -> bool:
    at = bisect.bisect_left(frequencies, frequency)
    return all(abs(frequency - one) >= apart for one in frequencies[max(at - 1, 0) : at + 1])


def _more_careful(
    rehearsal: Rehearsal, procedure: SteppedSine, places_Hz: Sequence[tuple[float, float]]
) -> dict[str, object]:
    grid = procedure.grid
    assert grid is not None
    assert grid.step is not None
    assert grid.smallest is not None
    width_Hz = 2 * rehearsal.half_width_Hz(min(low for low, _ in places_Hz))
    # a step beyond the resonance's own width could pass over it; beside it, what the last round had is not enough
    step = max(min(0.5 * grid.step, max(width_Hz, 0.25 * grid.step)), 0.1 * width_Hz)
    smallest = min(grid.smallest, max(0.5 * grid.smallest, 0.02 * width_Hz), 0.5 * step)
    return {
        "kind": "adaptive",
        "start": grid.start,
        "stop": grid.stop,
        "step": float(f"{step:.3g}"),
        "smallest": float(f"{smallest:.2g}"),
        "change": float(f"{max(0.7 * grid.change, min(grid.change, SMALLEST_CHANGE)):.2g}"),
    }
