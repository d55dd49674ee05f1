"""The simple terms that a force nobody has named may be made of: springs, dampers, a mass, each of one power."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twin.arrays import Array


@dataclass(frozen=True, kw_only=True)
class Term:
    """A restoring force of one coefficient, by displacement u, velocity v and acceleration a of its place."""

    name: str
    """In an engineer's words."""
    formula: str
    """With c for the coefficient."""
    unit: str
    """Of the coefficient, as a suffix of its name."""
    force: Callable[[Array, Array, Array], Array]
    """Of u, v, a at coefficient one."""
    power: int
    """Of the motion that the force grows with."""
    derivative: int
    """Of the displacement that it depends on: 0, 1 or 2."""

    def size(self, amplitude_m: float, omega: float) -> float:
        """Force at coefficient one, roughly, when the place moves with this amplitude."""
        return float((omega**self.derivative * amplitude_m) ** self.power)


def _of_displacement(name: str, formula: str, power: int, force: Callable[[Array], Array]) -> Term:
    unit = "N_per_m" if power == 1 else f"N_per_m{power}"
    return Term(name=name, formula=formula, unit=unit, force=lambda u, v, a: force(u), power=power, derivative=0)


def _of_velocity(name: str, formula: str, power: int, force: Callable[[Array], Array]) -> Term:
    unit = {0: "N", 1: "N_s_per_m"}.get(power, f"N_s{power}_per_m{power}")
    return Term(name=name, formula=formula, unit=unit, force=lambda u, v, a: force(v), power=power, derivative=1)


_ALL = (
    _of_displacement("spring", "c u", 1, lambda u: u),
    _of_displacement("one-sided spring", "c u²", 2, lambda u: u**2),
    _of_displacement("stiffening spring", "c u |u|", 2, lambda u: u * np.abs(u)),
    _of_displacement("cubic spring", "c u³", 3, lambda u: u**3),
    _of_displacement("quintic spring", "c u⁵", 5, lambda u: u**5),
    _of_velocity("dry friction", "c sign(v)", 0, np.sign),
    _of_velocity("dashpot", "c v", 1, lambda v: v),
    _of_velocity("drag", "c v |v|", 2, lambda v: v * np.abs(v)),
    _of_velocity("cubic damper", "c v³", 3, lambda v: v**3),
    Term(name="mass", formula="c a", unit="kg", force=lambda u, v, a: a, power=1, derivative=2),
)
TERMS = {term.name: term for term in _ALL}
"""By name."""
