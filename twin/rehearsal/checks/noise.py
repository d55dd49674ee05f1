"""Noise floor too high: the measurement is too short, or the level too low, for the sensors' noise."""

from collections.abc import Iterator, Sequence

from twin.procedures import SteppedSine, StepResult
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.rehearsal import Caution, Rehearsal


def check_noise(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge each sweep and channel by the steps whose phasor is not known well enough."""
    procedure = rehearsal.procedure
    for sweep, steps in rehearsal.sweeps().items():
        for name in rehearsal.channels:
            errors = [_relative(step, name) for step in steps]
            noisy = concerned(rehearsal, steps, [error > LIMITS.noise_allowed for error in errors])
            if not noisy:
                continue
            worst = max(noisy, key=lambda i: errors[i])
            step = steps[worst]
            longer = min((errors[worst] / LIMITS.noise_wanted) ** 2, LIMITS.noise_longest)
            changes: dict[str, object] = {}
            if isinstance(procedure, SteppedSine):
                changes = {"measure": {"seconds": float(f"{step.measure_s * longer:.2g}")}}
            yield Caution(
                kind="noise-floor", severity="warning", channel=name, sweep=sweep, index=step.index,
                frequency_Hz=step.frequency_Hz, steps=len(noisy), size=errors[worst],
                reason=f"the noise of {name} leaves {100 * errors[worst]:.2g} % uncertainty in one step",
                advice=f"measure {longer:.2g} times as long ({step.measure_s * longer:.2g} s), or drive harder",
                changes=changes,
            )  # fmt: skip


def concerned(rehearsal: Rehearsal, steps: Sequence[StepResult], flags: Sequence[bool]) -> list[int]:
    """The flagged steps near a resonance, if more than the few around an antiresonance, where a channel is small."""
    near = rehearsal.near_resonance(steps)
    flagged = [i for i, flag in enumerate(flags) if flag and near[i]]
    return flagged if len(flagged) > LIMITS.most_few * near.sum() else []


def _relative(step: StepResult, name: str) -> float:
    phasor = step.phasors.get(name)
    return step.std[name] / max(abs(phasor), 1e-300) if phasor is not None else 0.0
