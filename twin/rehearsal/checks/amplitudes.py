"""What several checks ask for: other amplitudes."""

from twin.procedures import Dwell, Impact, Multisine, Procedure, Random, RingDown, SteppedSine


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
