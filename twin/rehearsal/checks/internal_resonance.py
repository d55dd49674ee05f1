"""Internal resonance: a harmonic of the response meets another mode, which then moves the fundamental, too."""

from collections.abc import Iterator

from twin.procedures import StepResult
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.rehearsal import Caution, Rehearsal


def check_internal_resonance(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Say for each sweep where a mode is driven by a harmonic of what moves at another one."""
    for steps in rehearsal.sweeps().values():
        near = rehearsal.near_resonance(steps)
        met = [found for step, counts in zip(steps, near, strict=True) if counts for found in _met(rehearsal, step)]
        if not met:
            continue
        share, step, name, order, (number, mode_Hz) = max(met, key=lambda found: found[0])
        yield Caution.at(
            step, kind="internal-resonance", severity="note", channel=name,
            steps=len({id(found[1]) for found in met}), size=share,
            reason=f"harmonic {order} of {name} is {100 * share:.2g} % of the fundamental: at "
            f"{order * step.frequency_Hz:.4g} Hz it meets mode {number} ({mode_Hz:.4g} Hz)",
            advice="expect resonance curves that no single mode has; lower levels keep the modes apart",
        )  # fmt: skip


def _met(rehearsal: Rehearsal, step: StepResult) -> Iterator[tuple[float, StepResult, str, int, tuple[int, float]]]:
    """Each large harmonic at a mode: over the largest fundamental of its quantity, step, channel, order, mode."""
    channels = [name for name in rehearsal.response_channels if step.harmonics.get(name)]
    for name in channels:
        alike = [one for one in channels if rehearsal.channels[one].quantity == rehearsal.channels[name].quantity]
        largest = max(step.harmonics[one][0] for one in alike)
        for order, size in enumerate(step.harmonics[name][1:], 2):
            mode = _mode_at(rehearsal, order * step.frequency_Hz)
            if mode and size > LIMITS.harmonic_share * largest:
                yield size / largest, step, name, order, mode


def _mode_at(rehearsal: Rehearsal, frequency_Hz: float) -> tuple[int, float] | None:
    """Number and frequency of the nearest mode, if it is near."""
    modes = [(number, f) for number, (f, _) in enumerate(rehearsal.nominal.modes, 1)]
    nearest = min(modes, key=lambda mode: abs(mode[1] - frequency_Hz), default=None)
    return nearest if nearest and abs(nearest[1] / frequency_Hz - 1.0) < LIMITS.harmonic_near else None
