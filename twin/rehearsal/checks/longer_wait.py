"""What several checks ask for: a wait that the data end, later than the one there was."""

from twin.procedures import Dwell, Multisine, RingDown, SteppedSine

USUAL_S = 60.0


def longer_wait(
    procedure: SteppedSine | Dwell | RingDown | Multisine,
    *,
    most_s: float = USUAL_S,
    least_s: float | None = None,
    tolerance: float = 5e-4,
) -> dict[str, object]:
    """The change to an automatic wait; where it is automatic already, twice as long at most, up to ten minutes.

    With `least_s` no wait ends earlier, and only that is changed of a wait that is automatic already.
    """
    settle = procedure.settle
    if settle.seconds is not None:
        return {"settle": {"tolerance": tolerance, "maximum": max(USUAL_S, most_s)}}
    same = settle.model_dump(exclude_none=True, exclude_defaults=True)
    if least_s is not None:
        minimum = max(settle.minimum, float(f"{min(least_s, 30.0):.2g}"))
        return {"settle": {**same, "minimum": minimum, "maximum": max(settle.maximum, 2 * minimum)}}
    return {
        "settle": {
            **same,
            "tolerance": min(settle.tolerance, tolerance),
            "maximum": min(max(2 * settle.maximum, most_s), max(600.0, settle.maximum)),
        }
    }
