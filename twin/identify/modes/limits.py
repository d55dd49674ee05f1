"""Numbers that decide something in `twin/identify/modes`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # fit.py
    fit_window: float = 4.0
    """Ratio of the ends of the narrower bands."""
    fit_rounds: int = 2
    """Of looking for modes in what is left, with a better estimate of the noise each time."""
    fit_same: float = 0.5
    """Two poles this share of a damping ratio apart, relative to their frequency, are one mode."""
    fit_narrowest: float = 0.1
    """Least half-width of a mode, in line spacings."""
    fit_vague: float = 0.5
    """Relative standard deviation of a damping from which on a pole is no mode."""
    fit_needed: float = 3.0
    """A mode stays if it lowers chi-square by this many times what Schwarz's criterion asks for its parameters."""

    # from_record.py
    from_record_averages: float = 12.0
    """Stretches of the first estimate."""

    # noise.py
    noise_surroundings: int = 201
    noise_spacing: int = 10
    """Lines over which noise is taken to be alike, and at every how many of them it is looked at."""

    # rational.py
    rational_chunk: int = 4096
    """Lines that are summed at once."""
    rational_edge: float = 0.98
    """Share of the unit half circle that the band takes: a pole at its very end would be real."""

    # refinement.py
    refinement_dependent: float = 1e-13
    """Singular value over the largest below which residues count as dependent."""
    largest_step: float = 0.5
    """Of a step of log damping; of log frequency in half-widths."""

    # stabilisation.py
    frequency_tolerance: float = 0.003
    damping_tolerance: float = 0.15
    """Relative changes from one order to the next that a stable pole may have."""
    widest_half_widths: float = 2.0
    """Poles of different orders belong together if they are this many damping ratios apart, or the tolerance."""
    largest_damping: float = 0.2
    """A pole damped more than this makes up for what lies outside the band, and is no mode."""
    stabilisation_share: float = 0.4
    """Least share of the orders, from its first on, in which a mode must be stable."""


LIMITS = Limits()
