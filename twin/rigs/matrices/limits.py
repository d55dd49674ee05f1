"""Numbers that decide something in `twin/rigs/matrices`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # abaqus.py
    abaqus_held: float = 1e35
    """Abaqus writes 1e36 on the diagonal of a degree of freedom that a boundary condition holds."""

    # dmig.py
    dmig_symmetric: int = 6
    dmig_square: int = 1
    """Forms of a matrix (field IFO): of the first only one triangle stands in the file."""
    dmig_real: tuple[int, int] = (1, 2)
    """Types (field TIN): single and double precision; 3 and 4 are complex."""

    # found.py
    found_components: int = 128
    """More than any program has degrees of freedom at a node."""

    # read.py
    read_asymmetry: float = 1e-6
    """Largest difference across the diagonal, over the largest entry, that is taken for rounding."""


LIMITS = Limits()
