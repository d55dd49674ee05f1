"""Numbers that decide something in `twin/joint`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # named_law.py
    at_rest_m: float = 1e-12
    """A motion at which every law is at rest."""
    # saturating.py
    saturating_small: float = 1e-3
    """Below this m the elliptic form loses digits and its series is used."""
    # steel.py
    soft_share: float = 0.9
    """Share of E' that the law loses at large amplitudes."""
    reference_modulus: float = 3.9e8
    """E' at which `soft_opening` holds, N/m2; the softening starts later in a joint that is clamped harder."""
    soft_opening: float = 1.0e-6
    """Scale of the softening, m of a point's opening."""
    loss_modulus: float = 3.0e9
    """Loss modulus in shear at large amplitudes, N/m2: the paper's g2 reaches 1.5e9 within its range."""
    loss_slip: float = 1.65e-6
    """Scale of the loss, m of a point's slip, at `reference_modulus`."""
    loss_power: int = 4
    """Of the slip, at first."""
    loss_end: float = 6.0
    """End of the loss's table, over its scale."""
    # table.py
    run_out: float = 0.1
    """Share of the last given amplitude over which a softening levels off beyond it."""
    table_points: int = 4097
    """Points of a table; a linear interpolation of a curve this dense is good to about 1e-7 of its range."""


LIMITS = Limits()
