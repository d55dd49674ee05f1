"""Amplifier or armature at its limit: what is cut off, or knocks at a stop, comes back as harmonics of the force."""

from collections.abc import Iterator

from twin.rehearsal.checks.amplitudes import amplitudes_at_most
from twin.rehearsal.rehearsal import Caution, Rehearsal

HELD, NEAR, WANTED = 0.99, 0.9, 0.8


def check_drive(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge every sweep by the step that comes nearest to each limit of the rig's drive."""
    for name, limit in rehearsal.nominal.drive_limits.items():
        unit = rehearsal.channels[name].unit
        for sweep in dict.fromkeys(step.sweep for step in rehearsal.result.steps):
            steps = [step for step in rehearsal.result.steps if step.sweep == sweep]
            worst = max(steps, key=lambda step: step.peak.get(name, 0.0))
            use = worst.peak.get(name, 0.0) / limit
            if use < NEAR:
                continue
            held = use >= HELD
            whose = "the end stops, at" if name == "stroke" else "the amplifier's limit of"
            state = f"{'is held at' if held else f'comes to {100 * use:.0f} % of'} {whose} {limit:g} {unit}"
            # what was cut off hides how much would have been needed
            wanted = worst.target_amplitude * WANTED / use * (0.8 if held else 1.0)
            yield Caution(
                kind="limit-reached", severity="warning", channel=name, sweep=sweep, index=worst.index,
                frequency_Hz=worst.frequency_Hz,
                steps=sum(step.peak.get(name, 0.0) >= NEAR * limit for step in steps), size=use,
                reason=f"{name} {state}" + (", which distorts the force" if held and name != "stroke" else ""),
                advice=f"an amplitude of {wanted:.3g} leaves it in hand",
                changes=amplitudes_at_most(rehearsal.procedure, worst.target_amplitude, wanted),
            )  # fmt: skip
