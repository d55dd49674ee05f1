"""A converter with fewer bits than it should have: all values are multiples of a coarse step."""

from collections.abc import Sequence

from recordings.run import Run
from twin.diagnose.signals.finding import Finding
from twin.diagnose.signals.levels import smallest_step

COARSEST = 3.0 / 2**15
"""Share of the range that a step may have: somewhat more than a 16-bit converter's."""


def find_quantisation(runs: Sequence[Run]) -> list[Finding]:
    """Channels whose smallest step is coarser than a 16-bit converter's."""
    findings = []
    for channel, what in runs[0].channels.items():
        steps = []
        for run in runs:
            if channel in run.channels:
                steps.append(smallest_step(run.device_of(channel).values[channel]))
        step = min(steps, default=0.0)
        if what.range and step > COARSEST * what.range:
            findings.append(
                Finding(
                    cause="quantisation",
                    summary=f"{channel} moves in steps of {step:.3g} {what.unit}",
                    values={"step": step},
                    std={"step": 0.01 * step},
                    names={"channel": channel},
                )
            )
    return findings
