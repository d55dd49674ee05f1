"""Signals too small: for the sensors' noise, as they are measured too briefly or driven too little; for the converter.

A signal of a few steps of the converter has harmonics that are the converter's.
"""

from collections.abc import Iterator, Sequence

from twin.procedures import SteppedSine, StepResult
from twin.rehearsal.checks.changes import amplitudes_at_least
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.rehearsal import Caution, Rehearsal


def check_noise(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge each sweep and channel by the steps whose phasor is not known well enough."""
    procedure = rehearsal.procedure
    for steps in rehearsal.sweeps().values():
        for name in rehearsal.channels:
            errors = [_relative(step, name) for step in steps]
            noisy = _concerned(rehearsal, steps, [error > LIMITS.noise_allowed for error in errors])
            if not noisy:
                continue
            worst = max(noisy, key=lambda i: errors[i])
            step = steps[worst]
            longer = min((errors[worst] / LIMITS.noise_wanted) ** 2, LIMITS.noise_longest)
            changes: dict[str, object] = {}
            if isinstance(procedure, SteppedSine):
                changes = {"measure": {"seconds": float(f"{step.measure_s * longer:.2g}")}}
            yield Caution.at(
                step, kind="noise-floor", severity="warning", channel=name, steps=len(noisy), size=errors[worst],
                reason=f"the noise of {name} leaves {100 * errors[worst]:.2g} % uncertainty in one step",
                advice=f"measure {longer:.2g} times as long ({step.measure_s * longer:.2g} s), or drive harder",
                changes=changes,
            )  # fmt: skip


def check_quantisation(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge each sweep and channel by how many steps of the converter its sine has."""
    if rehearsal.nominal.bits is None:
        return
    for steps in rehearsal.sweeps().values():
        for name, channel in rehearsal.channels.items():
            if channel.range is None or not any(name in step.phasors for step in steps):
                continue  # not a sensor's, or nothing fitted
            step_size = 2 * channel.range / 2**rehearsal.nominal.bits
            sizes = [abs(step.phasors.get(name, 0j)) / step_size for step in steps]
            few = _concerned(rehearsal, steps, [size < LIMITS.quantisation_fewest for size in sizes])
            if not few:
                continue
            worst = min(few, key=lambda i: sizes[i])
            step = steps[worst]
            lowest = step.target_amplitude * 1.2 * LIMITS.quantisation_fewest / max(sizes[worst], 1e-3)
            yield Caution.at(
                step, kind="quantisation", severity="warning", channel=name, steps=len(few),
                size=LIMITS.quantisation_fewest / max(sizes[worst], 1e-3),
                reason=f"the sine of {name} is {sizes[worst]:.2g} converter steps of {step_size:.2g} "
                f"{channel.unit} high: {rehearsal.nominal.bits} bits over a range of {channel.range:g} "
                f"{channel.unit}",
                advice=f"take a range of about {5 * sizes[worst] * step_size:.2g} {channel.unit}, "
                f"or an amplitude of {lowest:.3g}",
                changes=amplitudes_at_least(rehearsal.procedure, lowest),
            )  # fmt: skip


def _concerned(rehearsal: Rehearsal, steps: Sequence[StepResult], flags: Sequence[bool]) -> list[int]:
    """The flagged steps near a resonance, if more than the few around an antiresonance, where a channel is small."""
    near = rehearsal.near_resonance(steps)
    flagged = [i for i, flag in enumerate(flags) if flag and near[i]]
    return flagged if len(flagged) > LIMITS.most_few * near.sum() else []


def _relative(step: StepResult, name: str) -> float:
    phasor = step.phasors.get(name)
    return step.std[name] / max(abs(phasor), 1e-300) if phasor is not None else 0.0
