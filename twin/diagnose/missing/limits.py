"""Numbers that decide something in `twin/diagnose/missing`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # force.py
    usual_n: float = 2.0
    """Force of a term at the largest measured motion of the tip, one standard deviation of its prior."""

    # picture.py
    picture_follows: float = 4.0
    """Chi2 per degree of freedom, with a sound rig's errors, up to which a model follows the data."""
    least_fundamental: float = 0.01
    """Of the largest force within a period, below which its phase says nothing."""
    most_left: float = 0.05
    """Of a large chi2 per degree of freedom, for a force to be a picture of what is missing."""
    picture_places: int = 14
    """At which it is tried along the structure."""


LIMITS = Limits()
