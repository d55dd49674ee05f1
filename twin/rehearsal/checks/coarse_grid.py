"""Grid too coarse: the resonance lies between two steps, its height and width are guesses."""

from collections.abc import Iterator

from twin.procedures import SteppedSine
from twin.rehearsal.folds import jumping_steps
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.refine import finer_grid, resonance_between
from twin.rehearsal.rehearsal import Caution, Rehearsal
from twin.rehearsal.turns import phase_steps


def check_grid(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Look for steps over which the phase turns farther than allowed, and where the response does not jump."""
    if not isinstance(rehearsal.procedure, SteppedSine):
        return
    for steps in rehearsal.sweeps().values():
        turns, jumps = phase_steps(rehearsal, steps), jumping_steps(rehearsal, steps)
        coarse = [i for i, turn in enumerate(turns) if turn > LIMITS.turns_allowed_deg and i not in jumps]
        if not coarse:
            continue
        worst = max(coarse, key=lambda i: turns[i])
        here, there = steps[worst], steps[worst + 1]
        width_Hz = 2 * rehearsal.half_width_Hz(here.frequency_Hz)
        gap_Hz = abs(there.frequency_Hz - here.frequency_Hz)
        peaks_Hz = [resonance_between(rehearsal, steps, i) for i in coarse]
        yield Caution.at(
            there, kind="grid-too-coarse", severity="warning", steps=len(coarse), size=turns[worst],
            reason=f"the phase turns by {turns[worst]:.0f} degrees from {here.frequency_Hz:g} to "
            f"{there.frequency_Hz:g} Hz, a step of {gap_Hz:.3g} Hz where the resonance is {width_Hz:.2g} Hz wide: "
            "the peak lies between",
            advice="refine the grid near " + " and ".join(f"{peak:.4g}" for peak in sorted(peaks_Hz)) + " Hz",
            changes=finer_grid(rehearsal, [(peak, peak) for peak in peaks_Hz]),
        )  # fmt: skip
