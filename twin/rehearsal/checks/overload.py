"""Overload: a channel sits on its converter's limit, or comes so near that the real rig may."""

from collections.abc import Iterator

from twin.rehearsal.checks.amplitudes import amplitudes_at_most
from twin.rehearsal.rehearsal import Caution, Rehearsal

FULL, NEAR, WANTED = 0.9999, 0.9, 0.8


def check_overload(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge every sweep and channel by the largest sample of its measurements."""
    for sweep in dict.fromkeys(step.sweep for step in rehearsal.result.steps):
        steps = [step for step in rehearsal.result.steps if step.sweep == sweep]
        for name, channel in rehearsal.channels.items():
            if channel.range is None:
                continue
            uses = [step.peak.get(name, 0.0) / channel.range for step in steps]
            worst = max(range(len(steps)), key=lambda i: uses[i])
            if uses[worst] < NEAR:
                continue
            step, full = steps[worst], uses[worst] >= FULL
            state = "is on" if full else f"comes to {100 * uses[worst]:.0f} % of"
            # a clipped peak hides how far it would have gone
            factor = WANTED / uses[worst] * (0.6 if full else 1.0)
            yield Caution(
                kind="overload", severity="stop" if full else "warning", channel=name, sweep=sweep,
                index=step.index, frequency_Hz=step.frequency_Hz, steps=sum(use >= NEAR for use in uses),
                size=uses[worst],
                reason=f"{name} {state} its converter's limit of {channel.range:g} {channel.unit}",
                advice=f"take a wider range for {name}, or less than "
                f"{step.target_amplitude * factor:.3g} as amplitude",
                changes=amplitudes_at_most(
                    rehearsal.procedure, step.target_amplitude, step.target_amplitude * factor
                ),
            )  # fmt: skip
