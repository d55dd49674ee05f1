"""A better procedure: the changes that cautions ask for, put together."""

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from twin.procedures import Procedure
from twin.rehearsal.rehearsal import Caution


def improved_procedure(procedure: Procedure, cautions: Sequence[Caution]) -> Procedure | None:
    """`procedure` with the changes of all cautions; None if they change nothing.

    Where cautions disagree on how much, the careful one wins: of amplitudes and rates the lower, of measurements and
    waits the longer, of grids the finer.
    """
    table: dict[str, Any] = procedure.model_dump(exclude_none=True, exclude_defaults=True)
    changed = merged_changes(cautions)
    for name, value in changed.items():
        table.pop(name, None)
        if value is not None:
            table[name] = value
    try:
        better = type(procedure).model_validate(table)
    except ValidationError:  # the changes do not go together: better none than a procedure nobody asked for
        return None
    return None if better == procedure else better


def merged_changes(cautions: Sequence[Caution]) -> dict[str, Any]:
    """The changes of several cautions as one, the careful one of two."""
    changed: dict[str, Any] = {}
    for caution in cautions:
        for name, value in caution.changes.items():
            changed[name] = _careful(name, changed[name], value) if name in changed else value
    return changed


def _careful(name: str, first: Any, second: Any) -> Any:
    if name in ("amplitudes", "voltages"):
        highest = min(max(first), max(second))
        lowest = min(max(min(first), min(second)), highest)
        return sorted({min(max(value, lowest), highest) for value in [*first, *second]})
    if name in ("rms", "rate"):
        return min(first, second)
    if name == "frequencies" and first and second:
        return sorted({*first, *second})
    if name == "grid" and first and second:
        return {**first, **{part: min(first[part], second[part]) for part in ("step", "smallest", "change")}}
    if name == "measure" and "seconds" in first and "seconds" in second:
        return max(first, second, key=lambda measure: measure["seconds"])
    if name == "settle":
        return _longer(first, second)
    return second


def _longer(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, Any]:
    """Of two automatic waits, the one that ends neither too early nor with too much left."""
    pick = {"tolerance": min, "minimum": max, "maximum": max}
    both = {
        name: choose(first[name], second[name]) for name, choose in pick.items() if name in first and name in second
    }
    return {**first, **second, **both}
