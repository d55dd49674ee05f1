"""A converter with fewer bits than it should have: all values are multiples of a coarse step."""

from collections.abc import Sequence

from recordings.run import Run
from twin.diagnose.signals.finding import Finding
from twin.diagnose.signals.levels import smallest_step
from twin.diagnose.signals.limits import LIMITS


def find_quantisation(runs: Sequence[Run]) -> list[Finding]:
    """Channels whose smallest step is coarser than a 16-bit converter's."""
    findings = []
    for channel, what in runs[0].channels.items():
        recorded = [run.device_of(channel).values[channel] for run in runs if channel in run.channels]
        step = min(map(smallest_step, recorded), default=0.0)
        if what.range and step > LIMITS.quantisation_coarsest * what.range:
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
