"""Cautions as they are told: the gravest first, causes before their consequences, one for all of a kind."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from twin.rehearsal.improve import merged_changes
from twin.rehearsal.rehearsal import Caution

SEVERITIES = ("stop", "warning", "note")
CAUSES_FIRST = (
    "implausible-rig",
    "dwell-too-short",
    "too-short",
    "sweep-too-fast",
    "limit-reached",
    "overload",
    "force-drop-out",
    "force-too-high",
    "response-drop-out",
    "response-too-high",
    "jump-ahead",
    "grid-too-coarse",
    "quantisation",
    "noise-floor",
    "branch-ends-early",
    "internal-resonance",
)
"""A transient or an amplifier at its limit puts the force off, and looks like noise: who mends it mends the rest."""
MOST_NAMED = 8


def gathered(cautions: Iterable[Caution]) -> tuple[Caution, ...]:
    """Put together what differs in sweep and channel only; the worst one stands for all.

    The others are kept as its `cases`, itself among them, and named in its reason; its changes are those of all.
    """
    alike: dict[tuple[object, ...], list[Caution]] = {}
    for caution in cautions:
        alike.setdefault(_kind(caution), []).append(caution)
    found = [group[0] if len(group) == 1 else _one_for_all(group) for group in alike.values()]
    return tuple(sorted(found, key=lambda one: (SEVERITIES.index(one.severity), CAUSES_FIRST.index(one.kind))))


def _kind(caution: Caution) -> tuple[object, ...]:
    # up and down jump at the folds of one branch, each force has its own
    branch = caution.sweep.removesuffix("-up").removesuffix("-down") if caution.kind == "jump-ahead" else ""
    return caution.kind, caution.severity, branch, frozenset(caution.changes)


def _one_for_all(group: Sequence[Caution]) -> Caution:
    worst = max(group, key=lambda one: (one.size, one.steps))
    others = [_named(one, worst) for one in group if one is not worst]
    more = f" and {len(others) - MOST_NAMED} more" if len(others) > MOST_NAMED else ""
    in_sweep: dict[str, int] = {}
    for one in group:
        in_sweep[one.sweep] = max(one.steps, in_sweep.get(one.sweep, 0))
    return replace(
        worst,
        steps=sum(in_sweep.values()),
        reason=f"{worst.reason}; likewise " + ", ".join(others[:MOST_NAMED]) + more,
        changes=merged_changes(group),
        cases=tuple(group),
    )


def _named(caution: Caution, beside: Caution) -> str:
    channel = f"{caution.channel} of " if caution.channel and caution.channel != beside.channel else ""
    at = f" at {caution.frequency_Hz:g} Hz" if caution.frequency_Hz else ""
    return f"{channel}{caution.sweep} (step {caution.index}{at})"
