"""What a diagnosis of tables assumes and decides by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Figures of the rules in the files that the comments name."""

    # frequencies.py
    fewest_frequencies: int = 3
    """Fewer leave nothing to contradict a model whose moduli they have to tell."""
    heavy_sensor_kg: float = 0.005
    light_sensor_kg: float = 0.002
    """Mass of a sensor that frequencies feel, and of a miniature one."""
    # order_in_time.py
    confounded_order: float = 0.9
    """Rank correlation of amplitude with order in time beyond which a drift and a law of amplitude look alike."""
    most_order: int = 4
    """Highest order of the law beside which a drift or a jump is looked for."""
    least_deviations: float = 4.0
    """Standard deviations that a drift or a jump must have."""
    # sweeps.py
    most_steps: int = 20_000
    most_sweeps: int = 60
    """Beyond them a table is hardly one of stepped sines, and the fit takes minutes."""
    sweeps_held: float = 0.2
    """How far the response may stray from its median within a sweep that holds it."""


LIMITS = Limits()
