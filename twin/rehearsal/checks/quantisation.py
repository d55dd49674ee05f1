"""Quantisation: a signal of a few steps of the converter, whose harmonics are the converter's."""

from collections.abc import Iterator

from twin.rehearsal.checks.amplitudes import amplitudes_at_least
from twin.rehearsal.checks.noise import concerned
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.rehearsal import Caution, Rehearsal


def check_quantisation(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge each sweep and channel by how many steps of the converter its sine has."""
    if rehearsal.nominal.bits is None:
        return
    for sweep, steps in rehearsal.sweeps().items():
        for name, channel in rehearsal.channels.items():
            if channel.range is None or not any(name in step.phasors for step in steps):
                continue  # not a sensor's, or nothing fitted
            step_size = 2 * channel.range / 2**rehearsal.nominal.bits
            sizes = [abs(step.phasors.get(name, 0j)) / step_size for step in steps]
            few = concerned(rehearsal, steps, [size < LIMITS.quantisation_fewest for size in sizes])
            if not few:
                continue
            worst = min(few, key=lambda i: sizes[i])
            step = steps[worst]
            lowest = step.target_amplitude * 1.2 * LIMITS.quantisation_fewest / max(sizes[worst], 1e-3)
            yield Caution(
                kind="quantisation", severity="warning", channel=name, sweep=sweep, index=step.index,
                frequency_Hz=step.frequency_Hz, steps=len(few),
                size=LIMITS.quantisation_fewest / max(sizes[worst], 1e-3),
                reason=f"the sine of {name} is {sizes[worst]:.2g} converter steps of {step_size:.2g} "
                f"{channel.unit} high: {rehearsal.nominal.bits} bits over a range of {channel.range:g} "
                f"{channel.unit}",
                advice=f"take a range of about {5 * sizes[worst] * step_size:.2g} {channel.unit}, "
                f"or an amplitude of {lowest:.3g}",
                changes=amplitudes_at_least(rehearsal.procedure, lowest),
            )  # fmt: skip
