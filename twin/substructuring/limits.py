"""Numbers by which substructures are synthesised, coupled and their joints identified."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # joint_identification.py
    loose: tuple[float, float, float] = 0.3, 0.03, 0.0
    """Relative errors of the model that the rounds of the fit allow for: far from the answer every resonance is off."""
    guessed: float = 3.0
    """Standard deviation beforehand of a stiffness' logarithm: nobody knows more than its power of ten."""
    guessed_loss: float = 1.0
    """The same of a loss factor, whose largest is this, too."""
    tried: tuple[float, ...] = 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0
    """Times the file's stiffness, with which the fit may begin."""
    bounds: float = 1e4
    """Factor up to which a stiffness is sought about the file's: beyond it a joint is rigid or gone."""
    vague: float = 0.3
    """Relative standard deviation from which on a stiffness is told not to be seen by these responses."""
    # substructures.py
    fewest_lines: int = 16
    """Common lines of the coupled response and the part's own."""
    noisiest: float = 0.3
    """Relative standard deviation of a line beyond which its logarithm says nothing."""
    most_points: int = 16
    """Of a part known by its responses: all pairs of them are measured."""
    # synthesis.py
    remainders: int = 6
    """R_n: as many as follow the next modes above a band closely enough for resonances of a hundred half widths."""
    rigid: float = 1e-3
    """Motion below all lines, over the largest, from which on it is one: rigid motions all show, noise is less."""
    damping: float = 1e-4
    rounds: int = 30
    settled: float = 1e-6
    """Of the search for the synthesis: the damping it begins with, its most rounds, and the gain that ends it."""
    ridge: float = 1e-10
    """Over the information of each parameter: rigid motions may be turned among themselves without any effect."""
    poor: float = 1.5
    """Chi2 per degree of freedom from which on the synthesis is told not to follow the responses."""


LIMITS = Limits()
