"""A sweep whose steps were measured before the response had settled: a mistake of the procedure, not of the rig."""

from twin.bench.plan import Plan


def unsettled_dwell(plan: Plan, *, sweep: str) -> None:
    """Leave the rig as it is: whoever runs the procedure shortens the settling time of the named sweep.

    ValueError if the sweep has no name.
    """
    if not sweep:
        raise ValueError("unsettled-dwell needs the name of a sweep")
