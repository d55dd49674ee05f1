"""Numbers that decide something in `twin/rigs/imported`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # facing.py
    facing_gap: float = 0.5
    """Of the distance between a part's own neighbours: nodes farther apart do not face each other."""
    facing_edge: float = 3.0
    """Times the usual edge of a patch's triangles: longer ones bridge from one patch to the next and carry nothing."""

    # places.py
    places_far: float = 0.05
    """Of the structure's size: a nearest node farther off is told."""

    # text.py
    coincident_height_m: float = 0.001
    """Of a layer between nodes that coincide: its moduli are per this height, and nothing else depends on it."""

    # units.py
    units_sound_m_per_s: float = 5000.0
    """Bar waves in steel, aluminium and glass; 3400 in brass, 1700 in a polymer, 9000 in carbon fibre."""
    units_size_m: float = 0.4
    """Of a part on a bench; a factor of 10 more or less is common."""
    units_unlikely: float = 0.5
    """Weight of a decade of size beside a decade of the speed of sound, which differs less from part to part."""
    least_decades: float = 0.7
    """Decades by which the best of the units must be better than the next."""
    units_strange: float = 1.5
    units_impossible: float = 4.0
    """Decades off the usual speed of sound from which the units are doubted, and from which these are no such
    matrices."""


LIMITS = Limits()
