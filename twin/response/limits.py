"""Numbers that decide something in `twin/response`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # harmonic_balance.py
    model_rate_Hz: float = 51200.0
    """Selects the modes where no rate is asked for: all that the bench ever keeps."""
    balance_tolerance: float = 1e-9
    """Residual over the size of the unknowns, coordinate by coordinate."""
    neutral_multiplier: float = 1e-4
    """What a multiplier may exceed one by and count as one: a hundredth of what light damping takes off in a period."""
    from_rest: float = 0.25
    """Most of the first step from the linear response that the second may be: nearly linear."""
    least_drive: float = 2.0**-40
    """Part of the drive at which a rig that is not nearly linear counts as one without a steady state."""
    branch_step: float = 0.2
    most_points: int = 2000
    """Greatest arclength of a step, and most points, on the way from one steady state to another."""
    balance_narrow: float = 0.02
    """Least unit of frequency on that way, over the frequency: about the width of a resonance."""
    # stability.py
    stability_beside: float = 1e-8
    """Change for the differences of one law at one step, over the coordinate's amplitude or the memory's: rounding
    leaves eight digits, and few steps lie so near to a slip that a difference reaches over it."""
    stability_forgotten: float = 20.0
    """Time constants after which running means have forgotten how they began."""


LIMITS = Limits()
