"""Numbers that decide something in `twin/campaign`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # calibration.py
    least_cases: int = 10
    """Of each part."""
    least_probability: float = 1e-3
    """Given to a truth that was not tried: its score must not be without end."""
    calibration_wide: float = 2.0
    """Standard deviation of the prior of each number's logarithm: a factor of seven."""
    calibration_classes: int = 10
    """Of probability, evenly, for the calibration error (Naeini et al. 2015)."""
    # summary.py
    summary_power: float = 0.9
    """Share of cases in which an effect must be found for its size to count as detectable."""
    summary_bins: tuple[float, float, float, float, float, float] = (0.0, 0.5, 0.8, 0.95, 0.99, 1.0)
    """Edges of the classes of probability for the calibration."""
    # runner.py
    scheduler_s: float = 10.0
    """Patience with a scheduler that does not answer."""


LIMITS = Limits()
