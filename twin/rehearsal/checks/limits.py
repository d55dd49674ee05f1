"""Limit reached: a guard ended the run, or a channel came so near to its limit that the real rig may trip it."""

from collections.abc import Iterator

from twin.procedures import StepResult
from twin.rehearsal.checks.amplitudes import amplitudes_at_most
from twin.rehearsal.rehearsal import Caution, Rehearsal

NEAR, WANTED = 0.9, 0.8


def check_limits(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Report the guard that tripped, or the channels that came near theirs."""
    limits = rehearsal.procedure.limits.peak
    trip = next((event for event in rehearsal.result.events if event.kind == "limit"), None)
    if trip is not None:
        yield _tripped(rehearsal, trip.source, trip.detail)
        return
    for name, limit in limits.items():
        near = [step for step in rehearsal.result.steps if step.peak.get(name, 0.0) > NEAR * limit]
        if not near:
            continue
        worst = max(near, key=lambda step: step.peak[name])
        target = worst.target_amplitude
        wanted = target * WANTED * limit / worst.peak[name]
        yield Caution(
            kind="limit-reached", severity="warning", channel=name, sweep=worst.sweep, index=worst.index,
            frequency_Hz=worst.frequency_Hz, steps=len(near),
            reason=f"{name} comes to {100 * worst.peak[name] / limit:.0f} % of its limit of {limit:g}",
            advice=f"an amplitude of {wanted:.3g} leaves a fifth in hand",
            changes=amplitudes_at_most(rehearsal.procedure, target, wanted),
        )  # fmt: skip


def _tripped(rehearsal: Rehearsal, channel: str, detail: str) -> Caution:
    stopped = rehearsal.result.last_step
    assert stopped is not None
    target, sweep = stopped.target_amplitude, stopped.sweep
    limit = rehearsal.procedure.limits.peak[channel]
    # the sweeps before tell how the peak grows; without one, halve
    before: dict[str, list[StepResult]] = {}
    for step in rehearsal.result.steps:
        if step.sweep != sweep and step.target_amplitude < target:
            before.setdefault(step.sweep, []).append(step)
    wanted = 0.5 * target
    if before:
        last = list(before.values())[-1]
        peak = max(step.peak.get(channel, 0.0) for step in last)
        grown = last[0].target_amplitude * WANTED * limit / max(peak, 1e-300)
        wanted = min(max(grown, last[0].target_amplitude), 0.9 * target)
    return Caution(
        kind="limit-reached", severity="stop", channel=channel, sweep=sweep, index=stopped.index,
        frequency_Hz=stopped.frequency_Hz, steps=1,
        reason=f"the guard ended the run: {detail}",
        advice=f"go no higher than {wanted:.3g}, or raise the limit of {channel} if the rig bears it",
        changes=amplitudes_at_most(rehearsal.procedure, target, wanted),
    )  # fmt: skip
