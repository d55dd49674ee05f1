"""Limit reached: a guard ended the run, or a channel is at a limit or so near that the real rig may reach it.

The limits are the converter's (overload), those of amplifier and armature, and the procedure's.  What an amplifier cuts
off, or what knocks at a stop, comes back as harmonics of the force.
"""

from collections.abc import Iterator

from twin.rehearsal.checks.changes import amplitudes_at_most
from twin.rehearsal.rehearsal import Caution, Rehearsal, by_sweep

FULL, HELD, NEAR, WANTED = 0.9999, 0.99, 0.9, 0.8
"""Of a limit: where a converter clips, where amplifier or stop hold, what is told, and what is advised."""


def check_overload(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge every sweep and channel by the largest sample of its measurements."""
    for steps in by_sweep(rehearsal.result.steps).values():
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
            yield Caution.at(
                step, kind="overload", severity="stop" if full else "warning", channel=name,
                steps=sum(use >= NEAR for use in uses), size=uses[worst],
                reason=f"{name} {state} its converter's limit of {channel.range:g} {channel.unit}",
                advice=f"take a wider range for {name}, or less than "
                f"{step.target_amplitude * factor:.3g} as amplitude",
                changes=amplitudes_at_most(
                    rehearsal.procedure, step.target_amplitude, step.target_amplitude * factor
                ),
            )  # fmt: skip


def check_drive(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge every sweep by the step that comes nearest to each limit of the rig's drive."""
    for name, limit in rehearsal.nominal.drive_limits.items():
        unit = rehearsal.channels[name].unit
        for steps in by_sweep(rehearsal.result.steps).values():
            worst = max(steps, key=lambda step: step.peak.get(name, 0.0))
            use = worst.peak.get(name, 0.0) / limit
            if use < NEAR:
                continue
            held = use >= HELD
            whose = "the end stops, at" if name == "stroke" else "the amplifier's limit of"
            state = f"{'is held at' if held else f'comes to {100 * use:.0f} % of'} {whose} {limit:g} {unit}"
            # what was cut off hides how much would have been needed
            wanted = worst.target_amplitude * WANTED / use * (0.8 if held else 1.0)
            yield Caution.at(
                worst, kind="limit-reached", severity="warning", channel=name,
                steps=sum(step.peak.get(name, 0.0) >= NEAR * limit for step in steps), size=use,
                reason=f"{name} {state}" + (", which distorts the force" if held and name != "stroke" else ""),
                advice=f"an amplitude of {wanted:.3g} leaves it in hand",
                changes=amplitudes_at_most(rehearsal.procedure, worst.target_amplitude, wanted),
            )  # fmt: skip


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
        yield Caution.at(
            worst, kind="limit-reached", severity="warning", channel=name, steps=len(near),
            reason=f"{name} comes to {100 * worst.peak[name] / limit:.0f} % of its limit of {limit:g}",
            advice=f"an amplitude of {wanted:.3g} leaves a fifth in hand",
            changes=amplitudes_at_most(rehearsal.procedure, target, wanted),
        )  # fmt: skip


def _tripped(rehearsal: Rehearsal, channel: str, detail: str) -> Caution:
    stopped = rehearsal.result.last_step
    assert stopped is not None
    target = stopped.target_amplitude
    limit = rehearsal.procedure.limits.peak[channel]
    # the sweeps before tell how the peak grows; without one, halve
    earlier = [s for s in rehearsal.result.steps if s.sweep != stopped.sweep and s.target_amplitude < target]
    wanted = 0.5 * target
    if earlier:
        *_, last = by_sweep(earlier).values()
        peak = max(step.peak.get(channel, 0.0) for step in last)
        grown = last[0].target_amplitude * WANTED * limit / max(peak, 1e-300)
        wanted = min(max(grown, last[0].target_amplitude), 0.9 * target)
    return Caution.at(
        stopped, kind="limit-reached", severity="stop", channel=channel, steps=1,
        reason=f"the guard ended the run: {detail}",
        advice=f"go no higher than {wanted:.3g}, or raise the limit of {channel} if the rig bears it",
        changes=amplitudes_at_most(rehearsal.procedure, target, wanted),
    )  # fmt: skip
