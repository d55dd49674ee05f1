"""What several checks ask for: other amplitudes, and a wait that the data end, later than the one there was."""

from twin.procedures import Dwell, Impact, Multisine, Procedure, Random, RingDown, SteppedSine

USUAL_S = 60.0


def amplitudes_at_most(procedure: Procedure, offending: float, highest: float) -> dict[str, object]:
    """The change that brings the amplitude `offending`, and all above, down to `highest`."""
    highest = _short(highest)
    if isinstance(procedure, (Random, Multisine)):
        return {"rms": highest}
    if isinstance(procedure, Impact):
        return {"hammer": {**procedure.hammer.model_dump(), "peak": highest}}
    if isinstance(procedure, (SteppedSine, Dwell, RingDown)):
        kept = [a for a in procedure.amplitudes if a < offending * (1 - 1e-9) and a < highest]
        return {"amplitudes": [*kept, highest]}
    return {"voltages": sorted({min(v, highest) for v in procedure.voltages})}


def amplitudes_at_least(procedure: Procedure, lowest: float) -> dict[str, object]:
    """The change that brings all amplitudes up to `lowest`."""
    lowest = _short(lowest, up=True)
    if isinstance(procedure, (SteppedSine, Dwell, RingDown)):
        return {"amplitudes": sorted({max(a, lowest) for a in procedure.amplitudes})}
    return {}


def _short(value: float, *, up: bool = False) -> float:
    """Three digits, rounded towards the safe side."""
    rounded = float(f"{value:.3g}")
    if not up and rounded > value:
        rounded = float(f"{value * 0.995:.3g}")
    if up and rounded < value:
        rounded = float(f"{value * 1.005:.3g}")
    return rounded


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
